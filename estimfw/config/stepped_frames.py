"""A block that is constant in a frame that is turned in steps is not constant in another: no term could say how it jumps."""

from __future__ import annotations

from collections.abc import Sequence

from estimfw.errors import ConfigError
from estimfw.model.frame import rotation
from estimfw.model.model import Model
from estimfw.model.nominal import NominalVariable

__all__ = ["refuse_stepped_turns"]


def refuse_stepped_turns(model: Model, variables: Sequence[NominalVariable]) -> None:
    """Raise `ConfigError` where a policy has expressed a block in a frame to which its own is turned in steps."""
    stepped = {v.name for v in variables if v.changes == "stepped"}
    for block in model.blocks:
        own, now = block.declared_frame, block.frame
        if own is None or now is None or own == now:
            continue
        turned = stepped & rotation(own, now, model.frame_map).needs
        if turned:
            raise ConfigError(
                f"block {block.name!r} is expressed in frame {now!r}, but {sorted(turned)[0]} changes in steps: what is constant "
                f"in {own!r} jumps in {now!r} there",
                hint=f"leave it in {own!r}; its Phi and Q are made once a segment, which costs next to nothing",
            )
