"""Express a block in another frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient
from estimfw.model.frame import relative_rate, rotation
from estimfw.model.model import Model
from estimfw.model.parts import ProcessTerm
from estimfw.policies.change import Change, FloatArray, compare
from estimfw.policies.order import LostAxisError
from estimfw.spelling import did_you_mean

__all__ = ["ExpressInFrame", "frame_rotation_label"]


def frame_rotation_label(block: str) -> str:
    """Label of the term that a re-framed block gets where the frames turn against each other."""
    return f"{block}.frame_rotation"


@dataclass(frozen=True, slots=True)
class ExpressInFrame:
    """Change the frame of a block: v_new = C v_old, v_new' = [omega x] v_new + C v_old'.

    Exact: the block's own dynamics are turned with it, the prior is rotated, and the term
    ``<block>.frame_rotation`` is added where the frames turn against each other. Dropping that term is a policy of its own.
    """

    block: str
    frame: str

    @property
    def label(self) -> str:
        return f"express_in_frame {self.block} in {self.frame}"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        if self.block not in model.offsets:
            raise LostAxisError(self.label, self.block, (), hint=did_you_mean(self.block, model.offsets))
        block = model.block(self.block)
        if self.frame not in model.frame_map:
            raise ConfigError(f"there is no frame {self.frame!r}", hint=did_you_mean(self.frame, model.frame_map))
        if block.frame is None:
            raise ConfigError(f"block {self.block!r} has no frame, so it cannot be expressed in {self.frame!r}")
        full = replace(block, axes=block.all_axes).labels
        if block.labels != full:
            raise LostAxisError(self.label, block.name, [s for s in full if s not in block.labels])
        if block.frame == self.frame:
            return model, compare(self.label, "exact", model, model, "the block is in that frame already")
        return self._turned(model)

    def _turned(self, model: Model) -> tuple[Model, Change]:
        block, at = model.block(self.block), model.offsets[self.block]
        old_frame = str(block.frame)
        turn = rotation(old_frame, self.frame, model.frame_map)
        blocks = tuple(b.in_frame(model.frame_map[self.frame]) if b.name == self.block else b for b in model.blocks)
        label = frame_rotation_label(self.block)
        others = tuple(t for t in model.terms if t.label != label)
        rate = relative_rate(old_frame, self.frame, model.frame_map)
        for former in (t for t in model.terms if t.label == label):
            rate = rate + turn @ former.coefficient @ turn.T  # on the way back the two cancel
        term = ProcessTerm(
            label=label, target=self.block, source=self.block, coefficient=rate, frame=self.frame,
            text=f"{self.block} turns in {self.frame} with the rate of {old_frame} against {self.frame}",
        )  # fmt: skip
        terms = (*others, term) if not rate.is_zero else others
        rows = list(range(at, at + len(block.axes)))
        after = model.with_parts(blocks=blocks, terms=terms, prior=model.prior.rotate(rows, turn))
        n = len(model.states)
        kept = Coefficient((n, n), tuple((i, i, ((1.0, ()),)) for i in range(n) if i not in rows))
        change = compare(
            self.label, "exact", model, after, "a change of coordinates", map=kept + turn.embed((n, n), at, at)
        )
        return after, change
