"""The standard deviations of the specification, to the digits that it prints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.run.observe import observe

FloatArray = NDArray[np.float64]
Sigmas = Callable[..., FloatArray]
Open = Callable[..., Problem]

#: SI of one of the units m/s, arcmin, ug, deg/h, state by state.
UNITS = np.repeat([1.0, np.pi / 10800.0, 9.80665e-6, np.pi / 180.0 / 3600.0], [2, 3, 2, 3])

#: By second: dV, phi, dA, eps in m/s, arcmin, ug, deg/h, as printed.
TABLE = {
    60: ".0026 .0032 .1877 .1741 42.43 49.98 49.98 .0199 .0199 .0200",
    300: ".0018 .0018 .1722 .1723 6.082 49.98 49.97 .0174 .0110 .0200",
    600: ".0016 .0016 .1721 .1721 5.925 49.98 49.97 .0173 .0103 .0200",
    1200: ".0016 .0016 .1720 .1721 5.892 49.98 49.97 .0173 .0101 .0197",
}


def printed(values: FloatArray, texts: list[str]) -> list[str]:
    """Values with as many digits as the texts have."""
    return [f"{v:.{len(t.partition('.')[2])}f}" for v, t in zip(values.tolist(), texts, strict=True)]


def full(texts: list[str]) -> list[str]:
    return [f"{float(t):.{len(t.partition('.')[2])}f}" for t in texts]


@pytest.fixture(scope="module")
def one_position(sigmas: Sigmas) -> FloatArray:
    return sigmas("gravimeter")


@pytest.mark.parametrize("second", TABLE)
def test_the_table_of_one_position(one_position: FloatArray, second: int) -> None:
    texts = TABLE[second].split()
    assert printed(one_position[second - 1], texts) == full(texts)


def test_a_platform_along_east_and_north_differs_in_two_drifts_only(one_position: FloatArray, sigmas: Sigmas) -> None:
    along = sigmas("gravimeter", "nominal.alpha=0 deg")
    end = along[-1]
    assert printed(end[7:9], [".0199", ".0019"]) == ["0.0199", "0.0019"]
    others = [0, 1, 2, 3, 4, 5, 6, 9]
    np.testing.assert_allclose(end[others], one_position[-1, others], rtol=1e-4)
    # In the plane F of alpha is F of 0 between turned axes, and prior and noise of x and y are alike, so turning changes
    # neither: nothing that is not resolved in these axes knows alpha, at any time.
    free = [0, 1, 2, 3, 4, 9]
    np.testing.assert_allclose(along[:, free], one_position[:, free], rtol=1e-6)
    for second, row in TABLE.items():
        texts = [row.split()[i] for i in free]
        assert printed(along[second - 1, free], texts) == full(texts)
    # And of the biases and drifts in the plane both together: the trace does not know by which axes.
    for pair in (slice(5, 7), slice(7, 9)):
        np.testing.assert_allclose(
            (along[:, pair] ** 2).sum(axis=1), (one_position[:, pair] ** 2).sum(axis=1), rtol=1e-6
        )


@pytest.mark.parametrize(("alpha", "told"), [(0, ".0019"), (10, ".0039"), (30, ".0101"), (45, ".0141"), (90, ".0199")])
def test_the_drift_of_the_second_gyro_shows_only_near_north(sigmas: Sigmas, alpha: int, told: str) -> None:
    assert printed(sigmas("gravimeter", f"nominal.alpha={alpha} deg")[-1][8:9], [told]) == full([told])


#: phi_z, level (mean of E and N), dA (mean of x and y), eps_x, eps_y after the second position.
TURNED = {
    90: (".853", ".0142", "2.9", ".0021", ".0027"),
    180: (".635", ".012", "2.0", ".0020", ".0020"),
}


@pytest.mark.parametrize("turn", TURNED)
def test_two_positions_free_what_one_cannot(sigmas: Sigmas, turn: int) -> None:
    positions = f"nominal.positions=[{{alpha: 30 deg}}, {{time: 600 s, alpha: {30 + turn} deg}}]"
    end = sigmas("gravimeter_two_positions", positions)[-1]
    texts = list(TURNED[turn])
    found = np.array([end[4], end[2:4].mean(), end[5:7].mean(), *end[7:9]])
    assert printed(found, texts) == full(texts)


def floor(opened: Open, alpha: int) -> FloatArray:
    """Sigmas (10,) that velocity readings without end leave of this prior, where nothing is noisy: in m/s, arcmin, ug, deg/h.

    Whatever they tell leaves the directions N that the model's F hides from them: c in x = N c keeps the information of the
    prior, N' P0^-1 N.
    """
    N = observe(opened("gravimeter", f"nominal.alpha={alpha} deg", "source.duration=60 s")).frozen.kernel
    prior = opened("gravimeter").model.prior.evaluate({})[1]
    left = N @ np.linalg.solve(N.T @ np.linalg.solve(prior, N), N.T)
    return np.asarray(np.sqrt(np.diag(left)) / UNITS)


@pytest.mark.parametrize("alpha", [0, 30])
def test_floors(opened: Open, sigmas: Sigmas, alpha: int) -> None:
    """No sigma is ever below its floor; level and azimuth come near it, and to it where noises are a thousandth."""
    least = floor(opened, alpha)
    found = sigmas("gravimeter", f"nominal.alpha={alpha} deg")
    assert np.all(found >= least * (1.0 - 1e-9))
    np.testing.assert_allclose(found[-1, 2:4], least[2:4], rtol=2e-3)
    np.testing.assert_allclose(
        found[-1, 4], least[4], rtol=5e-3
    )  # not all of an azimuth that the gyro noise moves is found
    quiet = sigmas(
        "gravimeter",
        f"nominal.alpha={alpha} deg",
        "process.platform_error.gyro_noise=1e-6 deg/sqrt(h)",
        "process.platform_error.accel_noise=5e-3 ug/sqrt(Hz)",
        "measurements.velocity.noise=1e-5 m/s",
    )
    np.testing.assert_allclose(quiet[-1, 2:7], least[2:7], rtol=1e-6)


def test_floors_are_those_of_sensors(opened: Open) -> None:
    """sigma(dA) / g and sigma(eps_E) / (W cos L), each together with the prior of the angle, which knows a little itself."""
    level, azimuth = 50e-6 * 180.0 * 60.0 / np.pi, 0.02 / 3600.0 / (7.292115e-5 * np.cos(np.radians(39.1))) * 60.0
    assert printed(np.array([level, azimuth]), [".1719", "5.890"]) == ["0.1719", "5.890"]
    alone = 1.0 / np.hypot(1.0 / azimuth, 1.0 / 60.0)
    np.testing.assert_allclose(floor(opened, 30)[2:5], [level, level, alone], rtol=2e-3)
