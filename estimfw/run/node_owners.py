"""Groups of states as the nodes of a config: by names of whole blocks and measurements, else by labels of states and rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from estimfw.model.model import Model

__all__ = ["OwnedNode", "owned_nodes"]


@dataclass(frozen=True, slots=True)
class OwnedNode:
    """A node and what it owns.

    Attributes
    ----------
    name : str
    states : tuple of str
    rows : tuple of str
    blocks, measurements : tuple of str
        The same, in as few words as it goes.
    """

    name: str
    states: tuple[str, ...]
    rows: tuple[str, ...]
    blocks: tuple[str, ...]
    measurements: tuple[str, ...]


def owned_nodes(
    model: Model, labels: Sequence[str], groups: Sequence[Sequence[int]], owners: Sequence[int]
) -> tuple[OwnedNode, ...]:
    """A node for each group.

    Parameters
    ----------
    model : Model
    labels : sequence of str
        Rows of the measurements, in the order of the plan.
    groups : sequence of sequence of int
        States of each.
    owners : sequence of int
        Group of each row.
    """
    made = []
    for g, group in enumerate(groups):
        states = tuple(model.states[i] for i in group)
        rows = tuple(label for label, owner in zip(labels, owners, strict=True) if owner == g)
        blocks = _shortened(states, ((b.name, b.labels) for b in model.blocks))
        measurements = _shortened(rows, ((m.name, m.labels) for m in model.measurements))
        made.append(OwnedNode(f"node_{g + 1}", states, rows, blocks, measurements))
    return tuple(made)


def _shortened(labels: Sequence[str], families: Iterable[tuple[str, Sequence[str]]]) -> tuple[str, ...]:
    """The name of a family in place of its labels where all of them are there."""
    made: list[str] = []
    for name, members in families:
        own = [m for m in members if m in labels]
        made.extend([name] if own and len(own) == len(members) else own)
    return tuple(made)
