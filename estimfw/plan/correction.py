"""How the estimate corrects the provider: blocks go into the slots of their quantities, each in the frame of its slot."""

from __future__ import annotations

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, identity, zeros
from estimfw.model.frame import rotation
from estimfw.model.model import Model
from estimfw.model.nominal import CorrectionSlot
from estimfw.model.parts import StateBlock

__all__ = ["correction", "slot_of"]


def correction(model: Model, slots: tuple[CorrectionSlot, ...]) -> Coefficient:
    """delta = C x, (3 * slots, states), over the nominal at the instant of the correction.

    A slot without a block is not corrected: its rows are zero. A state without a slot has a zero column, and is not reset.

    Raises
    ------
    ConfigError
        No rotation takes a block to the frame of its slot.
    """
    shape = (3 * len(slots), len(model.states))
    total = zeros(*shape)
    for block in model.blocks:
        slot = slot_of(block, slots)
        if slot is not None:
            turn = _turn(model, block, slots[slot])
            turn = turn.select(range(turn.shape[0]), block.live).substitute(dict(model.fixed))
            total = total + turn.embed(shape, 3 * slot, model.offsets[block.name])
    return total


def slot_of(block: StateBlock, slots: tuple[CorrectionSlot, ...]) -> int | None:
    """Position of the slot of a block's quantity, in the block's own frame if there is one; None where none has it."""
    same = [k for k, slot in enumerate(slots) if slot.quantity == block.quantity]
    return next((k for k in same if slots[k].frame == block.frame), same[0] if same else None)


def _as_it_is(block: StateBlock, slot: CorrectionSlot) -> Coefficient:
    if block.frame is not None or len(block.all_axes) > 3:
        raise ConfigError(
            f"block {block.name!r} corrects the {slot.quantity} of the nominal, which takes up to three numbers in no frame",
            hint="leave out its frame, or give it another quantity",
        )
    return identity(len(block.all_axes))


def _turn(model: Model, block: StateBlock, slot: CorrectionSlot) -> Coefficient:
    """From the frame of the block to that of the slot, (3, 3); (axes, axes) where the slot has none."""
    if slot.frame is None:
        return _as_it_is(block, slot)
    what = f"block {block.name!r} corrects the {slot.quantity} of the nominal in frame {slot.frame!r}"
    if block.frame is None or len(block.all_axes) != 3:
        raise ConfigError(f"{what}, but is no triad in a frame", hint="give the block a frame, or another quantity")
    frames = model.frame_map
    if block.frame != slot.frame and not {block.frame, slot.frame} <= set(frames):
        raise ConfigError(f"{what}, and the model knows no rotation to it from {block.frame!r}")
    try:
        return rotation(block.frame, slot.frame, frames)
    except ConfigError as error:
        raise ConfigError(f"{what}: {error.message}", hint=f"express the block in {slot.frame!r}") from error
