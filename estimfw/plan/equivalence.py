"""Equivalence of error model and nominal provider: what is dropped on one side must be dropped on the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from estimfw.errors import ConfigError
from estimfw.model.model import Structure
from estimfw.model.nominal import AxisMirror, Operation
from estimfw.spelling import did_you_mean

__all__ = ["OperationCheck", "Switch", "settle_operations"]

Switch = Literal["follow", "on", "off"]


@dataclass(frozen=True, slots=True)
class OperationCheck:
    """One operation of the provider against its mirror in the model."""

    operation: str
    mirror: str
    in_model: bool
    setting: Switch
    computed: bool
    equivalent: bool
    text: str

    def as_json(self) -> dict[str, object]:
        return {
            "operation": self.operation,
            "mirror": self.mirror,
            "in_model": self.in_model,
            "setting": self.setting,
            "computed": self.computed,
            "status": "equivalent" if self.equivalent else "mismatch",
            "text": self.text,
        }


def settle_operations(
    operations: Sequence[Operation],
    settings: Mapping[str, Switch],
    structure: Structure,
    provider: str,
    *,
    allow_mismatch: bool = False,
) -> tuple[OperationCheck, ...]:
    """Decide which operations are computed, and check them against the model.

    ``follow`` (default): an operation is computed exactly if its mirror lives in the model. An operation that cannot be
    switched is computed always.

    Raises
    ------
    ConfigError
        An unknown operation, or a mismatch without ``allow_mismatch``, naming the operation and the label.
    """
    known = {o.name for o in operations}
    for name in settings:
        if name not in known:
            hint = did_you_mean(name, known)
            raise ConfigError(f"nominal provider {provider} has no operation {name!r}", hint=hint)
    checks = tuple(_check(o, settings.get(o.name, "follow"), structure, provider) for o in operations)
    wrong = [c for c in checks if not c.equivalent]
    if wrong and not allow_mismatch:
        raise ConfigError(
            "error model and nominal are not equivalent: " + "; ".join(c.text for c in wrong),
            hint="set the operation to follow, or change the policies; "
            "nominal.allow_mismatch: true runs it all the same, to show the damage",
        )
    return checks


def _check(operation: Operation, setting: Switch, structure: Structure, provider: str) -> OperationCheck:
    mirror = operation.mirror
    if isinstance(mirror, AxisMirror):
        in_model = structure.has_axis(mirror.quantity, mirror.axis)
        name = f"a state block of {mirror.quantity}" + (f" with axis {mirror.axis}" if mirror.axis else "")
    else:
        in_model, name = structure.has_term(mirror.label), f"the term {mirror.label}"
    computed = True if not operation.switchable else in_model if setting == "follow" else setting == "on"
    does, has = "computes" if computed else "does not compute", "has" if in_model else "does not have"
    text = f"{provider} {does} {operation.name}, the model {has} {name}"
    if not operation.switchable and not in_model:
        text += " (this provider cannot switch it off)"
    return OperationCheck(operation.name, name, in_model, setting, computed, computed == in_model, text)
