"""Take a re-framed block as constant in its new frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimfw.model.model import Model
from estimfw.policies.change import Change, ChangeKind, FloatArray, Measure, compare
from estimfw.policies.express_in_frame import frame_rotation_label

__all__ = ["DropFrameRotation", "turn_name"]


def turn_name(frame: str) -> str:
    """Name in the reference nominal of the largest angle (rad) by which a frame turns against its parent in the run."""
    return f"turn_angle_{frame}"


@dataclass(frozen=True, slots=True)
class DropFrameRotation:
    """Drop ``<block>.frame_rotation``: right where the two frames do not turn against each other.

    Its price is the turn angle times the block's sigma. The angle is known where the source declares it (a simulated
    sway); otherwise the price is given per degree.
    """

    block: str

    @property
    def label(self) -> str:
        return f"drop_term {frame_rotation_label(self.block)}"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        label = frame_rotation_label(self.block)
        after = model.with_parts(terms=tuple(t for t in model.terms if t.label != label))
        if after.terms == model.terms:
            return model, compare(self.label, "exact", model, model, "nothing turns: the term is not there")
        block = model.block(self.block)
        old, new = block.declared_frame, block.frame
        at = model.offsets[self.block]
        sigma = np.sqrt(np.diag(model.prior.evaluate(reference)[1]))[at : at + len(block.axes)].max()
        names = [turn_name(str(frame)) for frame in (old, new)]
        angle = next((reference[name] for name in names if name in reference), None)
        if angle is None:
            measure = Measure(f"drift of {self.block} per degree of turn", float(sigma * np.pi / 180.0), block.unit)
            condition = f"right if {old} and {new} do not turn against each other, which only the record can tell"
        else:
            measure = Measure(f"drift of {self.block}", float(sigma * angle), block.unit)
            turn = f"turn by at most {np.rad2deg(float(angle)):.3g} deg" if angle else "do not turn"
            then = "drifts" if angle else "is constant"
            condition = f"{old} and {new} {turn} against each other: what is constant in {old} {then} in {new}"
        kind: ChangeKind = "exact" if angle is not None and float(angle) == 0.0 else "approximate"
        return after, compare(self.label, kind, model, after, condition, measures=(measure,))
