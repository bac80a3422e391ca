"""Wrong units, wrong axes and dead sensors in a standing record are found, with the guess."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.data.record import Record
from estimfw.errors import DataError

Load = Callable[..., Record]
Write = Callable[..., Path]

PERIOD = 0.01


def refusal(load: Load, path: Path, **settings: object) -> str:
    with pytest.raises(DataError) as caught:
        load(path, **settings)
    return str(caught.value)


def test_milliseconds_for_seconds(load: Load, npz_of: Write, csv_of: Write, standing: Any) -> None:
    slow = standing.changed(t=standing.t * 1000.0)
    against_header = refusal(load, npz_of(slow))
    assert "the time stamps are 10 s apart, the sampling interval is 0.01 s: time in ms, not in s?" in against_header
    assert "by the factor 0.001" in against_header
    assert "the time stamps are 10 s apart: time in ms, not in s?" in refusal(load, csv_of(slow.rows()))
    assert load(csv_of(slow.rows()), units={"time": "ms"}).events == ()


def test_another_rate_than_the_configured_one(load: Load, csv_of: Write, standing: Any) -> None:
    text = refusal(load, csv_of(standing.rows()), rate="200 Hz")
    assert "the time stamps are 0.01 s apart (100 Hz), the sampling interval is 0.005 s (200 Hz)" in text


def test_g_for_metres_per_second_squared(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=standing.dvel / 9.80665)))
    assert "gravity is 9.7965 m/s^2: g for m/s^2? (factor 9.80665)" in text


def test_degrees_for_radians(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dtheta=np.degrees(standing.dtheta))))
    assert "the Earth's is 7.2921e-05 rad/s: deg for rad? (factor 0.0174533)" in text


def test_rates_for_increments(load: Load, npz_of: Write, standing: Any) -> None:
    rates = standing.changed(dtheta=standing.dtheta / PERIOD, dvel=standing.dvel / PERIOD)
    text = refusal(load, npz_of(rates))
    assert text.count("rates taken for increments? (factor 0.01)") == 2
    assert "say `values: rate`" in text


def test_increments_for_rates(load: Load, csv_of: Write, standing: Any) -> None:
    text = refusal(load, csv_of(standing.rows()), values="rate")
    assert text.count("increments taken for rates? (factor 100)") == 2
    assert "say `values: increment`" in text


def test_rates_in_degrees_and_g_for_increments(load: Load, npz_of: Write, standing: Any) -> None:
    rates = standing.changed(dtheta=np.degrees(standing.dtheta) / PERIOD, dvel=standing.dvel / 9.80665 / PERIOD)
    text = refusal(load, npz_of(rates))
    assert "rates taken for increments, and g for m/s^2?" in text
    assert "rates taken for increments, and deg for rad?" in text


def test_a_force_that_is_no_known_mistake(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=1.7 * standing.dvel)))
    assert "this is no record of a standing vehicle in SI units" in text
    assert "`checks: false`" in text


def test_z_down(load: Load, npz_of: Write, standing: Any) -> None:
    turn = np.diag([1.0, -1.0, -1.0])
    down = standing.changed(dtheta=standing.dtheta @ turn, dvel=standing.dvel @ turn)
    text = refusal(load, npz_of(down))
    assert "the reaction to gravity shows on -z, not on +z: z points down?\n  say in `source.mounting`" in text
    assert load(npz_of(down), mounting={"roll": "180 deg"}).streams["imu"].values[:, 5].min() > 0.0


def test_accelerometers_with_flipped_signs_are_told_from_z_down(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=-standing.dvel)))
    assert "the signs of the accelerometers are flipped" in text


@pytest.mark.parametrize(("order", "axis"), [([2, 0, 1], "+x"), ([1, 2, 0], "+y")])
def test_axes_swapped(load: Load, npz_of: Write, standing: Any, order: list[int], axis: str) -> None:
    swapped = standing.changed(dtheta=standing.dtheta[:, order], dvel=standing.dvel[:, order])
    text = refusal(load, npz_of(swapped))
    assert f"the reaction to gravity shows on {axis}, not on +z: axes swapped?" in text


def test_checks_can_be_switched_off(load: Load, npz_of: Write, standing: Any) -> None:
    assert load(npz_of(standing.changed(dvel=-standing.dvel)), checks=False).events == ()


def test_a_large_gyro_bias_is_a_warning_not_a_unit(load: Load, npz_of: Write, standing: Any) -> None:
    biased = standing.changed(dtheta=standing.dtheta + np.radians([0.24, 0.0, 0.0]) * PERIOD)
    (event,) = load(npz_of(biased)).events
    assert event.kind == "rate"
    assert "large gyro biases, or the vehicle turns" in event.text


def test_a_stuck_sensor_is_flagged_with_its_instant(load: Load, npz_of: Write, standing: Any) -> None:
    dtheta = standing.dtheta.copy()
    dtheta[400:, 1] = dtheta[400, 1]
    (event,) = load(npz_of(standing.changed(dtheta=dtheta))).events
    assert (event.kind, event.count) == ("stuck", 600)
    assert event.time == pytest.approx(4.01)
    assert event.text.startswith("gyro y shows")


def test_coarse_resolution_is_not_taken_for_a_stuck_sensor(load: Load, npz_of: Write, standing: Any) -> None:
    count = 60_000
    rng = np.random.default_rng(1)
    dvel = np.tile(standing.dvel.mean(axis=0), (count, 1))
    flips = np.cumsum(rng.random(count) < 0.01)
    assert np.diff(np.flatnonzero(np.diff(flips))).max() * PERIOD > 5.0
    dvel[:, 0] += 1e-3 * (flips % 2)
    dvel += 1e-6 * rng.standard_normal((count, 3)) * [0.0, 1.0, 1.0]
    long = standing.changed(
        t=PERIOD * np.arange(1, count + 1), dtheta=np.tile(standing.dtheta, (count // 1000, 1)), dvel=dvel
    )
    assert load(npz_of(long)).events == ()
