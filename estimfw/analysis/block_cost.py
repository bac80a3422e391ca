"""What a step of the filter cut into subsystems costs where zeros of Phi and H are left out, as straight-line code would."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimfw.analysis.dense_cost import CutSizes
from estimfw.analysis.zero_pattern import OTHER, ZERO, Pattern

__all__ = ["cut_of", "decentralised_pattern_cost"]

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
    total, stored, before = int(each.sum() * (1 + n)), 0, 0
    for group in groups:
        own, size = each[list(group)], len(group)
        upto = np.arange(size) + 1
        inside = min(int((own * upto).sum()), int((own * upto[::-1]).sum())) if triangular else size * int(own.sum())
        total += before * int(own.sum()) + inside
        stored += before * size + (size * (size + 1) // 2 if triangular else size * size)
        before += size
    for own_rows in rows:
        m, read = len(own_rows), int(np.count_nonzero(H[list(own_rows)] == OTHER))
        total += n * read + m * read + m**3 + n * m**2 + read + n * m + m * stored
    return total


def cut_of(H: Pattern, groups: Groups, rows: Groups) -> CutSizes:
    """The sizes of a cut, with which subsystems its rows of H (m, n) read."""
    live = H != ZERO

    reads = [sum(len(g) for g in groups if np.any(live[np.ix_(list(own), list(g))])) for own in rows]
    return CutSizes(tuple(len(g) for g in groups), tuple(len(r) for r in rows), tuple(reads))
