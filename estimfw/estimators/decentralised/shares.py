"""Who holds what of x and P: a node its own x_i and P_ii, and half of each P_ij, the other half of which node j holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["Block", "Held", "Share", "Snapshot", "shares", "upper_triangle"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@cache
def upper_triangle(n: int) -> tuple[IntArray, IntArray]:
    """Rows and columns of the upper triangle of an (n, n) array, diagonal and all."""
    rows, columns = np.triu_indices(n)
    return rows, columns


@dataclass(frozen=True, slots=True)
class Snapshot:
    """x (n,) and P (n, n): all that the nodes know together."""

    x: FloatArray
    P: FloatArray


@dataclass(frozen=True, slots=True)
class Block:
    """A part of P that one node holds: rows and columns are states.

    ``own_rows``: the rows are states of that node, else the columns are; ``place`` (k,) are their places among its states.
    ``groups`` are the nodes of the rows and of the columns.
    """

    rows: IntArray
    columns: IntArray
    own_rows: bool
    place: IntArray
    groups: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Share:
    """What one node holds.

    Attributes
    ----------
    states : (n_i,) array of int
    blocks : tuple of Block
        The first is P_ii.
    upper : pair of arrays of int
        Rows and columns of the upper triangle of P_ii, in it.
    entries : pair of arrays of int
        The same entries of P as in `packed`: their rows and columns in P.
    """

    states: IntArray
    blocks: tuple[Block, ...]
    upper: tuple[IntArray, IntArray]
    entries: tuple[IntArray, IntArray]

    def packed(self, held: Held) -> FloatArray:
        """What is held of P as words: the upper triangle of P_ii, the rest whole."""
        return np.concatenate([held.blocks[0][self.upper], *(block.ravel() for block in held.blocks[1:])])

    def unpack_into(self, P: FloatArray, words: FloatArray) -> None:
        """Write these words to their entries of P (n, n), and to the mirrored ones."""
        rows, columns = self.entries
        P[rows, columns] = words
        P[columns, rows] = words


@dataclass(frozen=True, slots=True)
class Held:
    """The numbers of a share: x_i (n_i,), and an array for each of its blocks."""

    x: FloatArray
    blocks: tuple[FloatArray, ...]


def shares(groups: Sequence[Sequence[int]]) -> tuple[Share, ...]:
    """The shares of nodes that own these states.

    Of P_ij (i < j) node i holds the upper half of the rows, node j the lower one; where the rows are odd, the middle one goes to
    each of the two by turns over the pairs.
    """
    states = [np.array(sorted(group), dtype=np.int64) for group in groups]
    every = range(len(states))
    return tuple(_share(states, i, [_half(states, i, j) for j in every if j != i]) for i in every)


def _half(states: list[IntArray], i: int, j: int) -> Block:
    """What node i holds of the covariance between it and node j."""
    first, second = min(i, j), max(i, j)
    rows = states[first]
    half = (len(rows) + (first + second) % 2) // 2
    rows = rows[:half] if i == first else rows[half:]
    place = np.searchsorted(states[i], rows) if i == first else np.arange(len(states[i]))
    return Block(rows, states[second], i == first, place, (first, second))


def _share(states: list[IntArray], i: int, halves: list[Block]) -> Share:
    own = states[i]
    diagonal = Block(own, own, True, np.arange(len(own)), (i, i))
    others = tuple(block for block in halves if len(block.rows) and len(block.columns))
    upper = upper_triangle(len(own))
    rows = [own[upper[0]], *(np.repeat(b.rows, len(b.columns)) for b in others)]
    columns = [own[upper[1]], *(np.tile(b.columns, len(b.rows)) for b in others)]
    return Share(own, (diagonal, *others), upper, (np.concatenate(rows), np.concatenate(columns)))
