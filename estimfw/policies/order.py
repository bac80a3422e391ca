"""The fault of a frame change that comes after the removal of an axis, with the right order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from estimfw.errors import ConfigError
from estimfw.policies.change import Change

__all__ = ["LostAxisError"]


class LostAxisError(ConfigError):
    """A block is to be turned, but it has lost an axis, or is not there: the policy may stand too late.

    Parameters
    ----------
    policy : str
        Label of the policy that comes too late.
    block : str
    lost : sequence of str
        State labels; empty where the whole block is not there.
    remover : str, optional
        Label of the policy that removed them, where it is known.
    hint : str, optional
        Instead of the right order.
    """

    def __init__(
        self, policy: str, block: str, lost: Sequence[str], *, remover: str = "", hint: str | None = None
    ) -> None:
        self.block, self.lost, self.remover = block, tuple(lost), remover
        states = ", ".join(lost)
        fault = f"has already lost {states}, and a triad is rotated whole" if lost else "is not there"
        before = repr(remover) if remover else f"the policy that removes {states}"
        super().__init__(f"policy {policy!r}: block {block!r} {fault}", hint=hint or f"put {policy!r} before {before}")

    def as_met_in(self, policy: str, earlier: Iterable[Change]) -> LostAxisError:
        """The same fault, told of the policy that contains the frame change and of the earlier ones in its list."""
        removed = [(c.policy, s) for c in earlier for s in c.removed_states if s.partition("[")[0] == self.block]
        lost = self.lost or tuple(state for _, state in removed)
        remover = self.remover or next((label for label, _ in removed), "")
        return LostAxisError(policy, self.block, lost, remover=remover, hint=None if lost else self.hint)
