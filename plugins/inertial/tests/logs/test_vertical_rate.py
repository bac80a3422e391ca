"""The rate along gravity against that of the site: flagged with what it may be, where averaging allows to say so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.standing_means import StandingMeans

from estimfw.config.types import Site
from estimfw.data.record import Event, Record

Load = Callable[..., Record]
Write = Callable[..., Path]

DEG_PER_H = np.radians(1.0) / 3600.0
PERIOD = 0.01


def at(latitude: float, longitude: float = 75.0) -> Site:
    return Site.model_validate({"latitude": f"{latitude} deg", "longitude": f"{longitude} deg", "height": "0 m"})


def flagged(record: Record) -> Event:
    (event,) = record.events
    assert event.kind == "vertical rate"
    return event


def test_the_latitude_with_the_wrong_sign(load: Load, npz_of: Write, standing: Any) -> None:
    text = flagged(load(npz_of(standing), site=at(-34.0))).text
    # 2 x 15.041 deg/h x sin 34 deg
    assert "the rate along gravity is 8.41 deg/h, at latitude -34 deg the Earth's is -8.41 deg/h" in text
    assert "the sign of the latitude, or of the gyros, or a gyro bias of 16.8 deg/h along the vertical?" in text


def test_gyros_with_the_wrong_sign(load: Load, npz_of: Write, standing: Any) -> None:
    text = flagged(load(npz_of(standing.changed(dtheta=-standing.dtheta)))).text
    assert "the sign of the latitude, or of the gyros, or a gyro bias of -16.8 deg/h" in text


def test_latitude_and_longitude_swapped(load: Load, npz_of: Write, standing: Any) -> None:
    text = flagged(load(npz_of(standing), site=at(75.0, 34.0))).text
    assert "latitude and longitude swapped, or a gyro bias of -6.1" in text


def test_another_place(load: Load, npz_of: Write, standing: Any) -> None:
    assert "another latitude (the log looks like 34 deg)" in flagged(load(npz_of(standing), site=at(60.0))).text


@pytest.mark.parametrize(("bias", "limit", "told"), [(1.9, 2.0, False), (2.2, 2.0, True), (0.4, 0.3, True)])
def test_a_bias_is_flagged_beyond_the_tolerance(
    bias: float, limit: float, told: bool, load: Load, npz_of: Write, standing: Any
) -> None:
    up = standing.dvel.mean(axis=0) / np.linalg.norm(standing.dvel.mean(axis=0))
    biased = standing.changed(dtheta=standing.dtheta + bias * DEG_PER_H * PERIOD * up)
    events = load(npz_of(biased), rate_tolerance=f"{limit} deg/h").events
    assert [e.kind for e in events] == (["vertical rate"] if told else [])
    if told:
        assert f"gyro bias of {bias:.1f}" in events[0].text


def test_what_a_noisy_gyro_cannot_tell_is_not_flagged(load: Load, npz_of: Write, standing: Any) -> None:
    """10 s of 1 deg/sqrt(h) leave 19 deg/h of noise in the mean."""
    rng = np.random.default_rng(3)
    walk = np.radians(1.0) / 60.0 * np.sqrt(PERIOD)
    for _ in range(20):
        noisy = standing.changed(dtheta=standing.dtheta + walk * rng.standard_normal(standing.dtheta.shape))
        assert not [e for e in load(npz_of(noisy), site=at(-34.0)).events if e.kind == "vertical rate"]


def test_the_error_of_the_mean_is_that_of_white_noise() -> None:
    rng = np.random.default_rng(7)
    level = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 9.8 * PERIOD], (2000, 1))
    found = []
    for _ in range(300):
        values = level.copy()
        values[:, :3] += 1e-6 * rng.standard_normal((2000, 3))
        found.append(StandingMeans.of(values, PERIOD).vertical_sigma)
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(1e-6 / PERIOD / np.sqrt(2000), rel=0.05)
