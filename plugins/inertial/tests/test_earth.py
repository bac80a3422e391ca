"""The Earth against its definition: an ellipse, its normal potential, and motion on it."""

from __future__ import annotations

import numpy as np
import pytest
from estimfw_inertial import earth
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GM = 3.986004418e14
A = earth.SEMI_MAJOR_AXIS
B = A * (1.0 - earth.FLATTENING)
E = np.sqrt(A * A - B * B)


def meridian_point(latitude: float, height: float) -> tuple[float, float]:
    """Distance from the polar axis and from the equator (m), by the parametric latitude of the ellipse."""
    reduced = np.arctan2(B * np.sin(latitude), A * np.cos(latitude))
    return A * np.cos(reduced) + height * np.cos(latitude), B * np.sin(reduced) + height * np.sin(latitude)


def normal_potential(rho: float, z: float) -> float:
    """Closed form in ellipsoidal coordinates (Heiskanen and Moritz, Physical Geodesy, 2-62)."""
    r2 = rho * rho + z * z - E * E
    u = np.sqrt(0.5 * (r2 + np.sqrt(r2 * r2 + 4.0 * E * E * z * z)))
    sine2 = (z / u) ** 2

    def q(v: float) -> float:
        return float(0.5 * ((1.0 + 3.0 * v * v / (E * E)) * np.arctan(E / v) - 3.0 * v / E))

    spin = 0.5 * earth.RATE**2
    return float(
        GM / E * np.arctan(E / u)
        + spin * A * A * q(u) / q(B) * (sine2 - 1.0 / 3.0)
        + spin * (u * u + E * E) * (1.0 - sine2)
    )


@pytest.mark.parametrize(("height", "within"), [(0.0, 2e-7), (3000.0, 3e-7), (10000.0, 2e-6)])
@pytest.mark.parametrize("latitude", [-80.0, -34.0, 1.0, 45.0, 89.0])
def test_gravity_is_the_gradient_of_the_normal_potential(latitude: float, height: float, within: float) -> None:
    rho, z = meridian_point(np.radians(latitude), height)
    d = 50.0
    outward = (normal_potential(rho + d, z) - normal_potential(rho - d, z)) / (2 * d)
    upward = (normal_potential(rho, z + d) - normal_potential(rho, z - d)) / (2 * d)
    pull = np.hypot(outward, upward)
    assert earth.normal_gravity(np.radians(latitude), height) == pytest.approx(pull, abs=within * 9.8)


def test_gravity_at_published_places() -> None:
    assert earth.normal_gravity(0.0) == pytest.approx(9.7803253359, abs=1e-10)
    assert earth.normal_gravity(np.pi / 2) == pytest.approx(9.8321849378, abs=1e-9)
    assert earth.normal_gravity(np.radians(34.0), 100.0) == pytest.approx(9.796184, abs=5e-7)


@pytest.mark.parametrize("latitude", [-75.0, 0.0, 34.0, 60.0])
def test_radii_measure_the_arcs_of_the_ellipsoid(latitude: float) -> None:
    L, d = np.radians(latitude), 1e-4
    ahead, behind = meridian_point(L + d, 0.0), meridian_point(L - d, 0.0)
    arc = np.hypot(ahead[0] - behind[0], ahead[1] - behind[1]) / (2 * d)
    assert earth.meridian_radius(L) == pytest.approx(arc, rel=1e-8)
    assert earth.prime_vertical_radius(L) == pytest.approx(meridian_point(L, 0.0)[0] / np.cos(L), rel=1e-12)


def test_earth_rate_at_34_degrees_is_the_published_one() -> None:
    assert earth.earth_rate_n(np.radians(34.0)) == pytest.approx([0.0, 6.045437e-5, 4.077699e-5], abs=5e-12)


def test_along_a_parallel_the_level_turns_about_the_polar_axis() -> None:
    """V_E = rho lambda' on a circle of radius rho, so omega_en = lambda' along the axis of the Earth."""
    L, h, rate = np.radians(50.0), 2000.0, 1e-5
    east = meridian_point(float(L), h)[0] * rate
    turn = earth.transport_rate_n([east, 0.0, 0.0], L, h)
    assert turn == pytest.approx([0.0, rate * np.cos(L), rate * np.sin(L)], rel=1e-12)


def test_along_a_meridian_the_level_turns_west_by_the_rate_of_latitude() -> None:
    L, h, rate, d = 0.7, 500.0, 1e-5, 1e-4
    ahead, behind = meridian_point(L + d, h), meridian_point(L - d, h)
    north = rate * np.hypot(ahead[0] - behind[0], ahead[1] - behind[1]) / (2 * d)
    assert earth.transport_rate_n([0.0, north, 0.0], L, h) == pytest.approx([-rate, 0.0, 0.0], rel=1e-8)


def test_leading_axes_are_places() -> None:
    latitude, height = np.array([[0.1, 0.9], [-0.3, 1.2]]), np.array([0.0, 800.0])
    velocity = np.random.default_rng(1).normal(size=(2, 2, 3))
    gravity, turn = earth.normal_gravity(latitude, height), earth.transport_rate_n(velocity, latitude, height)
    assert gravity.shape == (2, 2)
    assert turn.shape == earth.earth_rate_n(latitude).shape == (2, 2, 3)
    for i in np.ndindex(2, 2):
        assert gravity[i] == earth.normal_gravity(latitude[i], height[i[1]])
        assert np.array_equal(turn[i], earth.transport_rate_n(velocity[i], latitude[i], height[i[1]]))
