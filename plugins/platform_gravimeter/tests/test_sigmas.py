"""The standard deviations of the specification, to the digits that it prints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Sigmas = Callable[..., FloatArray]

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
    # Prior and noise of x and y are alike, so nothing that is not resolved in these axes knows alpha, at any time.
    free = [0, 1, 2, 3, 4, 9]
    np.testing.assert_allclose(along[:, free], one_position[:, free], rtol=1e-6)
    for second, row in TABLE.items():
        texts = [row.split()[i] for i in free]
        assert printed(along[second - 1, free], texts) == full(texts)


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


def test_floors(one_position: FloatArray) -> None:
    """No filter finds level and azimuth better than sensors of this prior let it: sigma(dA) / g and sigma(eps) / (W cos L)."""
    from estimfw_inertial.earth import RATE

    level = 50e-6 * 180.0 * 60.0 / np.pi
    azimuth = np.radians(0.02) / 3600.0 / (RATE * np.cos(np.radians(39.1))) * 180.0 * 60.0 / np.pi
    assert printed(np.array([level, azimuth]), [".1719", "5.890"]) == ["0.1719", "5.890"]
    assert np.all(one_position[:, 2:4] > level) and np.all(one_position[:, 4] > azimuth)
    np.testing.assert_allclose(one_position[-1, 2:5], [level, level, azimuth], rtol=2e-3)
