"""Fewer points, the same picture: rows are chosen, never averaged, and no extreme is lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import FloatArray

__all__ = ["kept_rows"]


def kept_rows(columns: FloatArray, limit: int) -> NDArray[np.intp]:
    """Rows that carry the outline of every column: the least and the greatest value of each bucket of rows.

    Parameters
    ----------
    columns : (N, K) array
        Curves over one time axis; what is not finite is a gap.
    limit : int
        The most rows to keep, at least ``2 K + 3``.

    Returns
    -------
    (n,) array of int
        Ascending, with the first and the last row; all rows where ``N <= limit``. Each bucket with a gap keeps one row of
        it, so that a gap stays visible.
    """
    rows, curves = columns.shape
    if rows <= limit:
        return np.arange(rows)
    buckets = max(1, (limit - 2) // (2 * curves + 1))
    size = -(-rows // buckets)
    starts = np.arange(0, rows, size)
    kept = [np.array([0, rows - 1])]
    gap = np.zeros(rows, dtype=bool)
    for column in columns.T:
        known = np.isfinite(column)
        gap |= ~known
        kept.append(starts + _in_buckets(np.where(known, column, np.inf), size, np.inf).argmin(axis=1))
        kept.append(starts + _in_buckets(np.where(known, column, -np.inf), size, -np.inf).argmax(axis=1))
    marked = starts + _in_buckets(gap, size, False).argmax(axis=1)
    kept.append(marked[gap[marked]])
    return np.unique(np.concatenate(kept))


def _in_buckets(values: NDArray[np.generic], size: int, filler: float) -> NDArray[np.generic]:
    """The values as (buckets, size), the last bucket filled up with what no search finds."""
    missing = -values.shape[0] % size
    return np.concatenate([values, np.full(missing, filler, dtype=values.dtype)]).reshape(-1, size)
