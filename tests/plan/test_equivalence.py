"""What a provider computes and what the error model has are kept equivalent, or the run is refused naming both."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from estimfw.errors import ConfigError
from estimfw.model.model import Structure
from estimfw.model.nominal import AxisMirror, Operation, TermMirror
from estimfw.plan.equivalence import OperationCheck, Switch, settle_operations

CORIOLIS = Operation("coriolis", TermMirror("coriolis"))
VERTICAL = Operation("vertical_channel", AxisMirror("velocity", "U"))
POSITION = Operation("position_update", AxisMirror("position"))
FULL = Structure(frozenset({"coriolis", "gravity_tilt"}), frozenset({("velocity", a) for a in "ENU"}))
FLAT = Structure(frozenset({"gravity_tilt"}), frozenset({("velocity", "E"), ("velocity", "N")}))


def settle(
    structure: Structure, settings: Mapping[str, Switch] | None = None, allow_mismatch: bool = False
) -> dict[str, OperationCheck]:
    operations = (CORIOLIS, VERTICAL, POSITION)
    checks = settle_operations(operations, settings or {}, structure, "strapdown", allow_mismatch=allow_mismatch)
    return {c.operation: c for c in checks}


def test_an_operation_follows_its_mirror() -> None:
    full, flat = settle(FULL), settle(FLAT)
    assert {n: c.computed for n, c in full.items()} == {
        "coriolis": True, "vertical_channel": True, "position_update": False,
    }  # fmt: skip
    assert not any(c.computed for c in flat.values())
    assert all(c.equivalent for c in (*full.values(), *flat.values()))


@pytest.mark.parametrize(
    ("structure", "settings", "message"),
    [
        (FLAT, {"coriolis": "on"}, "strapdown computes coriolis, the model does not have the term coriolis"),
        (FULL, {"coriolis": "off"}, "strapdown does not compute coriolis, the model has the term coriolis"),
        (
            FLAT, {"vertical_channel": "on"},
            "strapdown computes vertical_channel, the model does not have a state block of velocity with axis U",
        ),
        (
            FULL, {"position_update": "on"},
            "strapdown computes position_update, the model does not have a state block of position",
        ),
    ],
)  # fmt: skip
def test_a_mismatch_is_refused_naming_both_sides(
    structure: Structure, settings: dict[str, Switch], message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        settle(structure, settings)
    assert message in caught.value.message
    assert "allow_mismatch: true" in str(caught.value.hint)
    allowed = settle(structure, settings, allow_mismatch=True)
    (name,) = settings
    assert not allowed[name].equivalent
    assert allowed[name].computed == (settings[name] == "on")
    assert allowed[name].as_json()["status"] == "mismatch"


def test_two_mismatches_are_told_together() -> None:
    with pytest.raises(ConfigError) as caught:
        settle(FLAT, {"coriolis": "on", "vertical_channel": "on"})
    assert "computes coriolis" in caught.value.message
    assert "computes vertical_channel" in caught.value.message


def test_a_forced_setting_that_agrees_is_fine() -> None:
    assert settle(FULL, {"coriolis": "on"})["coriolis"].equivalent
    assert settle(FLAT, {"coriolis": "off"})["coriolis"].equivalent


def test_a_recorded_trajectory_cannot_switch() -> None:
    recorded = Operation("coriolis", TermMirror("coriolis"), switchable=False)
    with pytest.raises(ConfigError, match="cannot switch it off"):
        settle_operations([recorded], {}, FLAT, "trajectory")
    (check,) = settle_operations([recorded], {}, FULL, "trajectory")
    assert check.computed
    assert check.equivalent


def test_an_unknown_operation_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="strapdown has no operation 'corriolis'") as caught:
        settle(FULL, {"corriolis": "on"})
    assert "did you mean 'coriolis'" in str(caught.value)
