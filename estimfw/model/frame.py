"""Frames: named axes, and the nominal variables of a frame's rotation and rate.

A frame hangs below a parent: ``rotation`` names the matrix variable that takes a vector from this frame to the parent
(``C_bn`` for b below n), ``rate`` the angular rate of this frame against the parent, in parent axes. From the tree follow
rotations between any two frames, as products of coefficients.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, identity, matrix, skew, zeros

__all__ = ["Frame", "between_frames", "relative_rate", "rotation"]


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame.

    Attributes
    ----------
    name : str
        ``n``, ``b``, ``p`` ...
    axes : tuple of 3 str
        ``("E", "N", "U")``.
    parent : str or None
    rotation : str or None
        Nominal variable (3, 3) from this frame to the parent.
    rate : str or None
        Nominal variable (3,), rad/s: rate of this frame against the parent, in parent axes. None: they do not turn
        against each other.
    """

    name: str
    axes: tuple[str, ...]
    parent: str | None = None
    rotation: str | None = None
    rate: str | None = None


def _path(name: str, frames: Mapping[str, Frame]) -> list[str]:
    path = [name]
    while (parent := frames[path[-1]].parent) is not None:
        path.append(parent)
    return path


def rotation(source: str, target: str, frames: Mapping[str, Frame]) -> Coefficient:
    """The coefficient (3, 3) that takes a vector from ``source`` to ``target``.

    Raises
    ------
    ConfigError
        The frames are not connected.
    """
    if source == target:
        return identity(3)
    up, down = _path(source, frames), _path(target, frames)
    meeting = next((f for f in up if f in down), None)
    if meeting is None:
        raise ConfigError(f"no rotation connects frame {source!r} with frame {target!r}")
    result: Coefficient | None = None
    for name in up[: up.index(meeting)]:
        step = matrix(str(frames[name].rotation))
        result = step if result is None else step @ result
    for name in reversed(down[: down.index(meeting)]):
        step = matrix(str(frames[name].rotation)).T
        result = step if result is None else step @ result
    assert result is not None
    return result


def between_frames(
    c: Coefficient, acting: str | None, target: str | None, source: str | None, frames: Mapping[str, Frame]
) -> Coefficient:
    """A coefficient that acts in a frame, between quantities in others: with the rotations around it that this takes.

    One that commutes with rotations gets a single one. ``None`` for ``target`` or ``source``: it is in the acting frame.
    """
    if acting is None or (target is None and source is None):
        return c
    to, come = target or acting, source or acting
    isotropic = c.isotropic
    if isotropic is not None and c.shape == (3, 3):
        if to == come:
            return c
        turn = rotation(come, to, frames)
        return turn * Coefficient((1, 1), ((0, 0, isotropic),), c.form if c.form != "I" else "")
    right = c if come == acting else c @ rotation(come, acting, frames)
    return right if to == acting else rotation(acting, to, frames) @ right


def relative_rate(source: str, target: str, frames: Mapping[str, Frame]) -> Coefficient:
    """[omega x] (3, 3) of ``source`` against ``target`` in ``target`` axes, for frames one step apart.

    A vector v constant in ``source`` obeys v' = [omega x] v in ``target`` axes. Zero where the frames do not turn.

    Raises
    ------
    ConfigError
        The frames are further apart than parent and child.
    """
    child = frames[source]
    if child.parent == target:
        return skew(child.rate) if child.rate else zeros(3, 3)
    parent = frames[target]
    if parent.parent == source:
        if not parent.rate:
            return zeros(3, 3)
        to_child = matrix(str(parent.rotation)).T
        return -(to_child @ skew(parent.rate) @ to_child.T)
    raise ConfigError(
        f"frames {source!r} and {target!r} are not neighbours; express the block in {child.parent!r} first"
    )
