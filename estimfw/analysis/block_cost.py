"""What a step of the filter cut into subsystems costs where zeros of Phi and H are left out, as straight-line code would."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.dense_cost import CutSizes
from estimfw.analysis.zero_pattern import OTHER, UNIT, ZERO, Pattern
from estimfw.estimators.decentralised.shares import Share, shares

__all__ = ["cut_of", "decentralised_pattern_cost", "selecting_rows"]

IntArray = NDArray[np.int64]
Groups = Sequence[Sequence[int]]


def decentralised_pattern_cost(
    Phi: Pattern, H: Pattern, groups: Groups, rows: Groups, *, triangular: bool = False
) -> int:
    """Multiplications of successive orthogonalisation; the covariance is taken to be full.

    Parameters
    ----------
    Phi : (n, n) array
        ZERO, UNIT or OTHER for each entry, see `estimfw.analysis.zero_pattern`.
    H : (m, n) array
    groups, rows : sequence of sequence of int
        States, and rows of H, of each subsystem.
    triangular : bool
        Of the covariance of a subsystem one half, upper or lower, whichever is cheaper.
    """
    each, n = np.count_nonzero(Phi == OTHER, axis=1), len(Phi)
    held = shares(groups)
    total = int(each.sum() * (1 + n)) + sum(_predicted(each, share, triangular=triangular) for share in held)
    stored = sum(len(share.entries[0]) for share in held)
    if not triangular:
        stored += sum(len(share.states) * (len(share.states) - 1) // 2 for share in held)
    for own_rows in rows:
        m, read = len(own_rows), int(np.count_nonzero(H[list(own_rows)] == OTHER))
        total += n * read + m * read + m**3 + n * m**2 + read + n * m + m * stored
    return total


def selecting_rows(states: int, groups: Groups, rows: Groups) -> Pattern:
    """A pattern of H in which each row reads one state of its own subsystem, as it is."""
    H = np.full((sum(len(own) for own in rows), states), ZERO, dtype=np.int8)
    for group, own in zip(groups, rows, strict=True):
        for place, row in enumerate(own):
            H[row, list(group)[place % len(group)]] = UNIT
    return H


def _predicted(each: IntArray, share: Share, *, triangular: bool) -> int:
    """Products of T = Phi P with Phi', for what a node holds; ``each`` (n,) are the non-zeros of the rows of Phi."""
    own, upto = each[share.states], np.arange(len(share.states)) + 1
    total = len(own) * int(own.sum())
    if triangular:
        total = min(int((own * upto).sum()), int((own * upto[::-1]).sum()))
    for block in share.blocks[1:]:
        mine, others = (block.rows, block.columns) if block.own_rows else (block.columns, block.rows)
        total += len(mine) * int(each[others].sum())
    return total


def cut_of(H: Pattern, groups: Groups, rows: Groups) -> CutSizes:
    """The sizes of a cut, with which subsystems its rows of H (m, n) read."""
    live = H != ZERO

    reads = [sum(len(g) for g in groups if np.any(live[np.ix_(list(own), list(g))])) for own in rows]
    return CutSizes(tuple(len(g) for g in groups), tuple(len(r) for r in rows), tuple(reads))
