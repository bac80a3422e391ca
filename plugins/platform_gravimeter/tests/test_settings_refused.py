"""What a config of the platform may not say, and what it is told."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, EstimfwError, NumericalError
from estimfw.run.load import load_record

Open = Callable[..., Problem]

KIND = "kind: platform_gravimeter.platform"


@pytest.mark.parametrize(
    ("override", "kind", "told"),
    [
        (f"nominal={{{KIND}}}", ConfigError, "neither of alpha and positions"),
        (
            f"nominal={{{KIND}, alpha: 1 deg, positions: [{{alpha: 2 deg}}]}}",
            ConfigError,
            "both of alpha and positions",
        ),
        (
            f"nominal={{{KIND}, positions: [{{alpha: 1 deg}}, {{alpha: 2 deg}}]}}",
            ConfigError,
            "do not follow each other",
        ),
        (f"nominal={{{KIND}, alpha: 30}}", ConfigError, "such as"),
        ("site=null", ConfigError, "needs the latitude"),
        ("site.latitude=90 deg", NumericalError, "no East at a pole"),
        ("source.duration=0.5 s", ConfigError, "not even one reading"),
        ("measurements.velocity.noise=0 m/s", ConfigError, "perfect: true"),
        ("process.platform_error.gyro_drift=gyro_drif", ConfigError, "did you mean"),
    ],
)
def test_is_refused_with_its_reason(opened: Open, override: str, kind: type[EstimfwError], told: str) -> None:
    with pytest.raises(kind) as refused:
        load_record(opened("gravimeter", override))
    assert told in f"{refused.value.message} {refused.value.hint}"


def test_near_a_pole_there_is_a_warning(opened: Open) -> None:
    assert any("within a degree of a pole" in text for text in opened("gravimeter", "site.latitude=-89.5 deg").warnings)
    assert not any("pole" in text for text in opened("gravimeter").warnings)


def test_a_block_of_the_platform_stays_in_it_where_it_is_turned(opened: Open) -> None:
    """In one position drifts may be constant in n as well; turned, they go with the platform."""
    in_n = "policies=[{kind: express_in_frame, block: gyro_drift, frame: n}]"
    assert opened("gravimeter", in_n).model.block("gyro_drift").frame == "n"
    with pytest.raises(ConfigError, match="C_pn changes in steps"):
        opened("gravimeter_two_positions", in_n)
