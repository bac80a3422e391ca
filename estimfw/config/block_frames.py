"""Blocks that live in a frame which other blocks bring: they take that frame's axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from estimfw.errors import ConfigError
from estimfw.model.frame import Frame
from estimfw.model.parts import BlockParts
from estimfw.spelling import did_you_mean

__all__ = ["AXES_OF_FRAME", "with_frame_axes"]

#: Stand for the axes of a frame until the frame is known.
AXES_OF_FRAME = ("first", "second", "third")


def with_frame_axes(parts: Sequence[BlockParts]) -> list[BlockParts]:
    """The parts, each in a frame that is there and with its axes.

    Raises
    ------
    ConfigError
        A block names a frame that no block brings, or axes that are not those of its frame.
    """
    frames = {frame.name: frame for part in parts for frame in part.frames}
    return [_settled(part, frames) for part in parts]


def _settled(part: BlockParts, frames: dict[str, Frame]) -> BlockParts:
    block = part.block
    if block.frame is None:
        return part
    if block.frame not in frames:
        known = did_you_mean(block.frame, frames) if frames else "no block of this config brings a frame"
        raise ConfigError(f"there is no frame {block.frame!r}", hint=known, within=("blocks", block.name, "frame"))
    axes = frames[block.frame].axes
    if block.all_axes not in (axes, AXES_OF_FRAME):
        raise ConfigError(
            f"{', '.join(block.all_axes)} are not the axes of frame {block.frame!r}, which are {', '.join(axes)}",
            hint="leave out `axes`, or `frame`",
            within=("blocks", block.name, "axes"),
        )
    if block.all_axes == axes:
        return part
    noises = tuple(replace(n, all_axes=axes, axes=axes) for n in part.noises)
    return replace(part, block=replace(block, all_axes=axes, axes=axes), noises=noises)
