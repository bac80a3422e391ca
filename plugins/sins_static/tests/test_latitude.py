"""No gyrocompass at a pole: refused there, a warning within a degree of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main
from estimfw.errors import ConfigError, NumericalError

EXAMPLE = Path(__file__).parents[3] / "examples" / "static_7.yaml"


@pytest.mark.parametrize("latitude", ["90 deg", "-90 deg"])
def test_a_pole_is_refused(latitude: str, composed: Callable[..., Any]) -> None:
    with pytest.raises(NumericalError) as caught:
        composed("static_7", f"site.latitude={latitude}")
    assert f"latitude {latitude}: there is no North at a pole, and no gyrocompass" in str(caught.value)
    assert caught.value.exit_code == 6


def test_a_pole_ends_the_program_with_6_and_says_where(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(EXAMPLE), "--json", "--set", "site.latitude=90 deg"]) == 6
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["kind"] == "numerical" and error["exit_code"] == 6
    assert error["line"] > 0 and "degree away" in error["hint"]


@pytest.mark.parametrize("latitude", [89.5, -89.01])
def test_within_a_degree_of_a_pole_there_is_a_warning(
    latitude: float, composed: Callable[..., Any], capsys: pytest.CaptureFixture[str]
) -> None:
    (warning,) = composed("static_7", f"site.latitude={latitude} deg").warnings
    assert warning.startswith(f"latitude {latitude:.4g} deg: within a degree of a pole")
    assert main(["check", str(EXAMPLE), "--set", f"site.latitude={latitude} deg"]) == 0
    assert "within a degree of a pole" in capsys.readouterr().err


@pytest.mark.parametrize("latitude", [0.0, 34.0, 88.9, -88.9])
def test_elsewhere_there_is_none(latitude: float, composed: Callable[..., Any]) -> None:
    assert composed("static_7", f"site.latitude={latitude} deg").warnings == ()


def test_beyond_a_pole_is_no_latitude(composed: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError, match="outside -90 deg"):
        composed("static_7", "site.latitude=91 deg")


def test_sigma_of_the_heading_grows_towards_the_pole_as_the_north_rate_falls(ran: Callable[..., Any]) -> None:
    # sigma ~ eps_E / (w_ie cos L): with the accelerometers out of the way, twice as far from the pole is half of it.
    settings = (
        "source.duration=3600 s",
        "source.noise=false",
        "estimator.kernel=numba",
        "blocks.accel_bias.sigma=1e-3 ug",
    )

    def sigma(latitude: float) -> float:
        done = ran("static_10", f"site.latitude={latitude} deg", "source.misalignment=0 deg", *settings)
        return float(done.output_sigma[-1, 0])

    ratio = sigma(60.0) / sigma(34.0)
    assert ratio == pytest.approx(np.cos(np.radians(34.0)) / np.cos(np.radians(60.0)), rel=0.02)
