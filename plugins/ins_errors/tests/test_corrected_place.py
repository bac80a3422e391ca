"""The correction of a record moves its place as the difference of two INS does, however large it is."""

from __future__ import annotations

import numpy as np
from estimfw_inertial.earth import meridian_radius, prime_vertical_radius
from estimfw_ins_errors import compiled_step, recorded_step
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
RECORDED = np.array([0.8, 0.26, 7.3, -7.1, 0.79])
CORRECTION = np.array([1e-3, -2e-3, 6e-3, 2.0, -3.0, 5e-3, -7e-3])


def place_rate(latitude: float, velocity: FloatArray) -> FloatArray:
    """(phi', lam') of an INS, rad/s."""
    across = prime_vertical_radius(latitude) * np.cos(latitude)
    return np.array([velocity[1] / meridian_radius(latitude), velocity[0] / across])


def test_the_place_moves_as_the_difference_of_record_and_corrected_ins_whatever_its_size() -> None:
    for size in (1.0, 1e-2):
        c = size * CORRECTION
        exact = place_rate(RECORDED[0], RECORDED[2:4]) - place_rate(RECORDED[0] - c[5], RECORDED[2:4] - c[3:5])
        found = recorded_step.error_rate(c, RECORDED, np.zeros(2), 9.80665)[5:]
        np.testing.assert_allclose(found, exact, rtol=1e-11, atol=0.0)


def test_the_compiled_step_is_the_readable_one() -> None:
    state, sample = np.concatenate([RECORDED, CORRECTION]), np.array([10.0, 0.80001, 0.26002, 7.35, -7.2, 0.8])
    parameters = np.array([0.5, 9.80665])
    expected = recorded_step.step(state, sample, parameters)
    rows = np.empty(12), np.empty(12)
    compiled_step.step(state, sample, parameters, *rows)
    for own, readable in zip((state, *rows), expected, strict=True):
        np.testing.assert_allclose(own, readable, rtol=1e-14, atol=1e-18)
