"""The truth model of a reduced filter: the unreduced model with the structure that the provider really runs.

What was dropped on both sides stays dropped: an operation that the provider does not compute has no error to model. All else
that policies took from the error model alone is there: removed states, dropped terms, held variables, other frames.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, constant
from estimfw.model.model import Model
from estimfw.model.nominal import AxisMirror, Operation
from estimfw.policies.change import Change, FloatArray
from estimfw.policies.drop_states import without_states
from estimfw.policies.drop_term import DropTerm

__all__ = ["TruthModel", "truth_model"]


@dataclass(frozen=True, slots=True)
class TruthModel:
    """A model of what really happens to the errors, and how it is seen by the filter.

    Attributes
    ----------
    model : Model
    map : Coefficient
        Filter states = map @ states of the truth model.
    not_computed : tuple of str
        Operations that the provider leaves out, and that are therefore missing here too.
    unmodelled : tuple of str
        Operations that the provider computes and that no model knows the errors of: they cannot be priced.
    absent : tuple of str
        States that the filter's own unreduced model has and this one does not: they are zero in truth.
    """

    model: Model
    map: Coefficient
    not_computed: tuple[str, ...] = ()
    unmodelled: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()

    @property
    def removed(self) -> tuple[str, ...]:
        """States that the filter does not see at all."""
        seen = {j for _, j, _ in self.map.entries}
        return tuple(s for j, s in enumerate(self.model.states) if j not in seen)

    def as_json(self) -> dict[str, object]:
        """For results and reports."""
        return {
            "states": list(self.model.states),
            "removed_states": list(self.removed),
            "not_computed": list(self.not_computed),
            "unmodelled": list(self.unmodelled),
        }


def truth_model(
    full: Model,
    changes: Sequence[Change],
    operations: Sequence[Operation],
    computed: frozenset[str],
    reference: Mapping[str, FloatArray],
    real: Model | None = None,
) -> TruthModel:
    """The truth model of a filter that policies made of ``full``.

    Parameters
    ----------
    full : Model
    changes : sequence of Change
        What the policies did, in order.
    operations : sequence of Operation
        Of the provider.
    computed : frozenset of str
        Those that it computes.
    reference : mapping of str to array
        The nominal frozen at the start.
    real : Model, optional
        A better model of reality than ``full``; states are matched by label. A state of ``full`` that it does not have is
        zero in truth.

    Raises
    ------
    ConfigError
        Nothing would be left; or the states of the two models are not in the same units and frames.
    """
    richest = full if real is None else real
    _refuse_other_units(full, richest)
    left_out = [o for o in operations if o.name not in computed and _mirrored(richest, o)]
    model = _without(richest, left_out, reference)
    return TruthModel(
        model=model,
        map=_columns(_composed(full, changes), full, model),
        not_computed=tuple(o.name for o in left_out),
        absent=tuple(s for s in full.states if s not in richest.states),
        unmodelled=tuple(o.name for o in operations if o.name in computed and not _mirrored(richest, o)),
    )


def _refuse_other_units(full: Model, real: Model) -> None:
    if not set(full.states) & set(real.states):
        raise ConfigError(
            "the truth model has no state in common with the filter's",
            hint=f"states are matched by label; it has {', '.join(real.states)}",
        )
    for block in full.blocks:
        for other in real.blocks:
            if not set(block.labels) & set(other.labels):
                continue
            if block.unit != other.unit:
                raise ConfigError(
                    f"block {block.name} is in {other.unit} in the truth model, in {block.unit} in the filter's"
                )
            if block.frame != other.frame:
                raise ConfigError(
                    f"block {block.name} is in frame {other.frame} in the truth model, in {block.frame} in the filter's"
                )


def _mirrored(model: Model, operation: Operation) -> bool:
    mirror, structure = operation.mirror, model.structure
    if isinstance(mirror, AxisMirror):
        return structure.has_axis(mirror.quantity, mirror.axis)
    return structure.has_term(mirror.label)


def _without(model: Model, operations: Iterable[Operation], reference: Mapping[str, FloatArray]) -> Model:
    for operation in operations:
        mirror = operation.mirror
        if isinstance(mirror, AxisMirror):
            model = without_states(model, _axis_labels(model, mirror))
        else:
            model, _ = DropTerm((mirror.label,), mirrored=True).apply(model, reference)
    return model


def _axis_labels(model: Model, mirror: AxisMirror) -> list[str]:
    blocks = [b for b in model.blocks if b.quantity == mirror.quantity]
    return [s for b in blocks for a, s in zip(b.axes, b.labels, strict=True) if mirror.axis in (None, a)]


def _composed(full: Model, changes: Sequence[Change]) -> Coefficient:
    n = len(full.states)
    total = constant([[float(i == j) for j in range(n)] for i in range(n)])
    for change in changes:
        total = change.map @ total
    return total


def _columns(map: Coefficient, before: Model, after: Model) -> Coefficient:
    """The columns of ``map`` for the states of ``after``, matched by label."""
    place = {label: i for i, label in enumerate(after.states)}
    taken = {j: place[label] for j, label in enumerate(before.states) if label in place}
    entries = sorted(((i, taken[j], p) for i, j, p in map.entries if j in taken), key=lambda e: e[:2])
    return Coefficient((map.shape[0], len(after.states)), tuple(entries))
