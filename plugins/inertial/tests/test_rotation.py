"""Rotations against scipy, in NumPy and compiled."""

from __future__ import annotations

import numpy as np
import pytest
from estimfw_inertial import compiled
from estimfw_inertial.rotation import (
    attitude_matrix,
    euler_angles,
    euler_jacobian,
    exponential,
    heading_of,
    logarithm,
    skew,
    wrapped,
)
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

ANGLE = st.floats(-3.1, 3.1)
VECTOR = st.tuples(*(st.floats(-4.0, 4.0),) * 3)


@given(VECTOR, st.sampled_from([1.0, 0.05, 1e-8, 0.0]))
def test_logarithm_is_the_inverse_of_the_exponential(vector: tuple[float, float, float], scale: float) -> None:
    v = scale * np.array(vector)
    v = v / max(1.0, float(np.linalg.norm(v)) / 3.14)
    stacked = exponential(np.stack([v, -v]).reshape((1, 2, 3)))
    assert logarithm(stacked) == pytest.approx(np.stack([v, -v])[None], abs=1e-12)


@given(VECTOR, st.sampled_from([1.0, 0.05, 1e-3, 1e-8, 1e-170]))
def test_exponential_is_scipys(vector: tuple[float, float, float], scale: float) -> None:
    v = scale * np.array(vector)
    expected = Rotation.from_rotvec(v).as_matrix()
    assert exponential(v) == pytest.approx(expected, abs=2e-15)
    assert np.reshape(compiled.exponential(*v), (3, 3)) == pytest.approx(expected, abs=2e-15)


@pytest.mark.parametrize("angle", [0.19999, 0.2, 0.20001, 1e-9])
def test_compiled_exponential_has_no_seam_between_series_and_sine(angle: float) -> None:
    v = angle * np.array([2.0, -1.0, 2.0]) / 3.0
    assert np.reshape(compiled.exponential(*v), (3, 3)) == pytest.approx(exponential(v), abs=3e-16)


def test_exponential_of_nothing_is_the_identity_to_the_last_bit() -> None:
    assert np.array_equal(exponential(np.zeros(3)), np.eye(3))
    assert np.array_equal(np.reshape(compiled.exponential(0.0, 0.0, 0.0), (3, 3)), np.eye(3))


def test_tiny_rotations_keep_their_digits() -> None:
    v = np.array([1e-12, -2e-12, 3e-12])
    assert exponential(v) - exponential(v).T == pytest.approx(2.0 * skew(v), rel=1e-12, abs=0.0)


@given(VECTOR, VECTOR)
def test_skew_is_the_cross_product(a: tuple[float, float, float], b: tuple[float, float, float]) -> None:
    assert skew(a) @ np.array(b) == pytest.approx(np.cross(a, b), abs=1e-14)


@given(ANGLE, st.floats(-1.55, 1.55), ANGLE)
def test_attitude_is_z_x_y_of_scipy_and_back(yaw: float, pitch: float, roll: float) -> None:
    C = attitude_matrix(yaw, pitch, roll)
    assert pytest.approx(Rotation.from_euler("ZXY", [yaw, pitch, roll]).as_matrix(), abs=1e-15) == C
    assert euler_angles(C) == pytest.approx([yaw, pitch, roll], abs=1e-12)


def test_the_signs_of_the_convention_sheet() -> None:
    forward = np.array([0.0, 1.0, 0.0])
    east, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    assert attitude_matrix(np.radians(-90.0), 0.0, 0.0) @ forward == pytest.approx(east, abs=1e-15)
    assert (attitude_matrix(0.0, np.radians(90.0), 0.0) @ forward) == pytest.approx(up, abs=1e-15)
    right = attitude_matrix(0.0, 0.0, np.radians(10.0)) @ east
    assert right[2] < 0.0, "positive roll puts the right side down"


def test_heading_runs_clockwise_from_north_and_back_to_yaw() -> None:
    yaw = np.radians([0.0, -90.0, 90.0, 180.0, -179.0])
    assert np.degrees(heading_of(yaw)) == pytest.approx([0.0, 90.0, 270.0, 180.0, 179.0])
    assert wrapped(-heading_of(yaw)) == pytest.approx(yaw, abs=1e-15)
    assert heading_of(1e-300) == 0.0, "360 deg is 0"


def test_leading_axes_equal_loops() -> None:
    v = np.random.default_rng(2).normal(size=(2, 4, 3))
    C, angles = exponential(v), attitude_matrix(v[..., 0], v[..., 1] / 3.0, v[..., 2])
    assert C.shape == angles.shape == (2, 4, 3, 3)
    for i in np.ndindex(2, 4):
        assert pytest.approx(exponential(v[i]), abs=1e-16) == C[i]
        assert np.array_equal(angles[i], attitude_matrix(v[i][0], v[i][1] / 3.0, v[i][2]))
        assert euler_angles(angles[i]) == pytest.approx(euler_angles(angles)[i], abs=1e-15)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.6, 0.9, -0.4), (-3.0, -0.2, 2.9)])
def test_the_jacobian_of_the_angles_is_that_of_finite_differences(angles: tuple[float, float, float]) -> None:
    C, size = attitude_matrix(*angles), 1e-6
    for axis in range(3):
        phi = size * np.eye(3)[axis]
        slope = wrapped(euler_angles(exponential(phi) @ C) - euler_angles(exponential(-phi) @ C)) / (2.0 * size)
        assert euler_jacobian(C)[:, axis] == pytest.approx(slope, abs=1e-8)
