"""The fault of a frame change that comes after the removal of an axis, with the right order."""

from __future__ import annotations

from collections.abc import Iterable

from estimfw.errors import ConfigError
from estimfw.model.parts import StateBlock
from estimfw.policies.change import Change

__all__ = ["LostAxisError"]


class LostAxisError(ConfigError):
    """A block is to be turned, but it has lost an axis: the policy must stand before the one that removed it.

    Parameters
    ----------
    policy : str
        Label of the policy that comes too late.
    block : StateBlock
    remover : str, optional
        Label of the policy that removed the axis, where it is known.
    """

    def __init__(self, policy: str, block: StateBlock, remover: str = "") -> None:
        self.block, self.remover = block, remover
        self.lost = [f"{block.name}[{axis}]" for axis in block.all_axes if axis not in block.axes]
        states = ", ".join(self.lost)
        before = repr(remover) if remover else f"the policy that removes {states}"
        super().__init__(
            f"policy {policy!r}: block {block.name!r} has already lost {states}, and a triad is rotated whole",
            hint=f"put {policy!r} before {before}",
        )

    def as_met_in(self, policy: str, earlier: Iterable[Change]) -> LostAxisError:
        """The same fault, told of the policy that contains the frame change and of the earlier ones in its list."""
        removers = (c.policy for c in earlier if set(self.lost) & set(c.removed_states))
        return LostAxisError(policy, self.block, self.remover or next(removers, ""))
