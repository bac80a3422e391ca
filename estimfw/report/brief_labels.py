"""Labels of states in few words: a block by its name where all of it is meant, else with its axes."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["brief_labels"]

MOST = 8
"""Blocks that are named; of more the last ones are counted."""


def brief_labels(labels: Sequence[str], every: Sequence[str]) -> str:
    """``velocity, tilt[x, y], azimuth`` for some of all the labels ``every``, in their order."""
    axes: dict[str, list[str]] = {}
    for label in labels:
        block, _, axis = label.partition("[")
        axes.setdefault(block, []).append(axis.removesuffix("]"))
    sizes = [label.partition("[")[0] for label in every]
    named = [block if len(own) == sizes.count(block) else f"{block}[{', '.join(own)}]" for block, own in axes.items()]
    if len(named) <= MOST:
        return ", ".join(named)
    return f"{', '.join(named[: MOST - 1])} and {len(named) - MOST + 1} more"
