"""Who forms and sends what of M = P H': each node the products of the entries of P that it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.shares import Share

__all__ = ["Piece", "Route", "route"]

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Piece:
    """M[into] += block @ H[:, of]', or with the block transposed."""

    block: int
    transposed: bool
    into: IntArray
    of: IntArray


@dataclass(frozen=True, slots=True)
class Route:
    """What one node does for one measurement.

    Attributes
    ----------
    pieces : tuple of Piece
    sends : pair of arrays of int
        Rows and columns of the entries of M that it forms and sends. Where the entries of P that such an entry sums over are held
        by two nodes, both send their part of the sum.
    reads : bool
        Whether the measurement reads states of this node.
    """

    pieces: tuple[Piece, ...]
    sends: tuple[IntArray, IntArray]
    reads: bool


def route(shares: Sequence[Share], reads: BoolArray) -> tuple[Route, ...]:
    """The routes of all nodes for a measurement that reads the states ``reads`` (m, n) by row."""
    read = [bool(np.any(reads[:, share.states])) for share in shares]
    return tuple(_of_node(i, share, reads, read) for i, share in enumerate(shares))


def _of_node(i: int, share: Share, reads: BoolArray, read: list[bool]) -> Route:
    pieces: list[Piece] = []
    sends = np.zeros(reads.T.shape, dtype=bool)
    for b, block in enumerate(share.blocks):
        of_rows, of_columns = block.groups
        if read[of_columns]:
            pieces.append(Piece(b, False, block.rows, block.columns))
        if b > 0 and read[of_rows]:
            pieces.append(Piece(b, True, block.columns, block.rows))
    for piece in pieces:
        sends[piece.into] |= np.any(reads[:, piece.of], axis=1)
    rows, columns = np.nonzero(sends)
    return Route(tuple(pieces), (rows, columns), read[i])
