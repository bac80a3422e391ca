"""What is dropped in the error model must be dropped in the mechanization: refused otherwise, and the damage shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import ConfigError

FloatArray = NDArray[np.float64]

ALLOWED = "nominal.allow_mismatch=true"
CLEAN = ("source.noise=false", "estimator.kernel=numba")
SLOPE = 2.0 * np.tan(np.radians(34.0))  # 1.349


@pytest.mark.parametrize(
    ("example", "switch", "slope"),
    [
        ("static_7", "on", -SLOPE),  # the mechanization alone has Coriolis
        ("static_10", "off", SLOPE),  # the model alone has it
        ("static_12", "off", SLOPE),
    ],
)
def test_coriolis_on_one_side_turns_the_heading_by_the_north_tilt(
    example: str, switch: str, slope: float, end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    assert abs(SLOPE - 1.349) < 5e-4

    def damage(tilt: float) -> float:
        settings = (misaligned(0.0, tilt, 0.0), *CLEAN)
        wrong = end_error(example, *settings, ALLOWED, f"nominal.operations.coriolis={switch}")
        return float((wrong - end_error(example, *settings))[0])

    assert abs((damage(0.1) - damage(-0.1)) / 0.2 - slope) < 0.01


@pytest.mark.parametrize(
    ("example", "switch", "angle", "heading"),
    [
        ("static_7", "on", 1.0, -1.260),
        ("static_10", "off", 1.0, 1.363),
        ("static_7", "on", 10.0, -12.79),
        ("static_10", "off", 10.0, 11.0),
    ],
)
def test_damage_of_a_mismatch_at_the_papers_misalignments(
    example: str, switch: str, angle: float, heading: float, end_error: Callable[..., FloatArray],
    misaligned: Callable[..., str],
) -> None:  # fmt: skip
    # To the digits that the specification prints.
    wrong = end_error(example, misaligned(angle), *CLEAN, ALLOWED, f"nominal.operations.coriolis={switch}")
    assert abs(wrong[0] - heading) < 10.0 ** -(3 if angle < 2.0 else 2)


@pytest.mark.parametrize("angle", [1.0, 5.0])
def test_coriolis_removed_on_both_sides_leaves_the_attitude_unchanged(
    angle: float, end_error: Callable[..., FloatArray], misaligned: Callable[..., str]
) -> None:
    bare = (
        "policies=[sins_static.constant_specific_force, sins_static.bias_in_navigation_frame, "
        "sins_static.remove_vertical_channel, sins_static.prune_unobservable]"
    )
    kept = end_error("static_7", misaligned(angle), *CLEAN, bare)
    assert np.all(np.abs(kept - end_error("static_7", misaligned(angle), *CLEAN)) < 1e-3)


@pytest.mark.parametrize(("example", "switch"), [("static_7", "on"), ("static_12", "off")])
def test_mismatch_is_refused_naming_operation_and_term(example: str, switch: str, composed: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError) as caught:
        composed(example, f"nominal.operations.coriolis={switch}")
    text = str(caught.value)
    assert "coriolis" in text and "the term coriolis" in text and "allow_mismatch" in text
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("example", "computed"),
    [
        ("static_12", {"coriolis", "vertical_channel"}),
        ("static_10", {"coriolis"}),
        ("static_7", set()),
    ],
)
def test_mechanization_follows_the_model_and_switches_transport_rate_off_by_itself(
    example: str, computed: set[str], composed: Callable[..., Any]
) -> None:
    problem = composed(example)
    assert problem.settings.computed == computed
    check = next(c for c in problem.checks if c.operation == "transport_rate")
    assert check.setting == "follow" and not check.computed and check.equivalent


def test_transport_rate_of_a_standing_base_is_refused(composed: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError, match="transport_rate"):
        composed("static_12", "nominal.operations.transport_rate=on")


@pytest.mark.parametrize(
    ("example", "angle", "least", "most"),
    [
        # The specification's numbers: +0.83 deg of heading at 0.1 deg, +7.8 at 1 deg (7.6 to 7.9 by the filter), +43 at 5 deg.
        ("static_7", 0.1, 0.825, 0.835),
        ("static_7", 1.0, 7.6, 7.9),
        ("static_12", 1.0, 7.75, 7.95),
        ("static_12", 5.0, 42.5, 43.5),
    ],
)
def test_transport_rate_from_the_computed_velocity_ruins_the_heading(
    example: str, angle: float, least: float, most: float, end_error: Callable[..., FloatArray],
    misaligned: Callable[..., str],
) -> None:  # fmt: skip
    wrong = end_error(example, misaligned(angle), *CLEAN, ALLOWED, "nominal.operations.transport_rate=on")
    assert least < wrong[0] < most
