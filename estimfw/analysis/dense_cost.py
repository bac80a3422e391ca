"""What a step costs with dense matrices, by closed form: global filters, and the filter cut into subsystems.

n states and m rows; subsystem l has n_l states and m_l rows, which read r_l states: its own alone where the measurement is
local (r_l = n_l). A division counts as a multiplication, the inverse of an m x m matrix as m^3 of them; R is diagonal in what
takes a component at a time, and between subsystems. Additions are not counted. What zeros of Phi and H save is told by
`estimfw.analysis.cost`; `estimfw.analysis.filter_forms` has the forms as algorithms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Self

__all__ = [
    "CutSizes",
    "balanced_sizes",
    "busiest_processor_cost",
    "decentralised_cost",
    "joseph_at_once_cost",
    "symmetric_cost",
    "textbook_cost",
    "words_sent",
]


@dataclass(frozen=True, slots=True)
class CutSizes:
    """How a filter is cut.

    Attributes
    ----------
    sizes : tuple of int
        States of each subsystem.
    rows : tuple of int
        Rows of the measurement that each owns; 0 where it measures nothing.
    reads : tuple of int
        States of all subsystems that these rows read; the own ones alone where the measurement is local.
    """

    sizes: tuple[int, ...]
    rows: tuple[int, ...]
    reads: tuple[int, ...]

    @classmethod
    def local(cls, sizes: Sequence[int], rows: Sequence[int]) -> Self:
        """Each measurement reads states of its own subsystem alone."""
        return cls(tuple(sizes), tuple(rows), tuple(sizes))

    @property
    def states(self) -> int:
        return sum(self.sizes)

    @property
    def measured(self) -> int:
        """Rows of all measurements."""
        return sum(self.rows)

    @property
    def stages(self) -> int:
        """CutSizes that measure: they follow each other, and each has to wait for the one before."""
        return sum(m > 0 for m in self.rows)


def balanced_sizes(total: int, parts: int) -> tuple[int, ...]:
    """Sizes that differ by one at most, the larger ones first."""
    least, more = divmod(total, parts)
    return (least + 1,) * more + (least,) * (parts - more)


def textbook_cost(n: int, m: int) -> int:
    """Phi P Phi' whole, all rows at once, (I - K H) P."""
    return 3 * n**3 + n**2 * (1 + 2 * m) + 2 * n * m**2 + 2 * n * m + m**3


def joseph_at_once_cost(n: int, m: int) -> int:
    """Phi P Phi' whole, all rows at once, (I - K H) P (I - K H)' + K R K'."""
    return 4 * n**3 + n**2 * (1 + 3 * m) + 3 * n * m**2 + 2 * n * m + m**3


def symmetric_cost(n: int, m: int, *, selecting: bool = False) -> int:
    """Half of a symmetric P, a component at a time; ``selecting``: each row reads one state as it is."""
    half = n * (n + 1) // 2
    return n**2 + n**3 + n * half + m * (half + (2 * n if selecting else n**2 + 4 * n))


def decentralised_cost(cut: CutSizes, *, triangular: bool = False) -> int:
    """Successive orthogonalisation, all subsystems together; blocks P_ij are kept for i <= j.

    ``triangular``: of the blocks P_ii one half only.
    """
    n = cut.states
    stored = n * (n + 1) // 2 if triangular else (n * n + sum(k * k for k in cut.sizes)) // 2
    return (
        n**2
        + n**3
        + n * stored
        + sum(
            n * reads * m + reads * m**2 + m**3 + n * m**2 + reads * m + n * m + m * stored
            for m, reads in zip(cut.rows, cut.reads, strict=True)
        )
    )


def busiest_processor_cost(cut: CutSizes) -> int:
    """One processor a subsystem: the products that nobody can do at the same time as another.

    Of each P_ij, i != j, the two processors have half each. Halves are added up exactly, and the sum is rounded up.
    """
    n = cut.states
    own = [k * k + Fraction(k * (n - k), 2) for k in cut.sizes]
    longest = max(k * n + k * n**2 + n * c for k, c in zip(cut.sizes, own, strict=True))
    for m, reads in zip(cut.rows, cut.reads, strict=True):
        shared = reads * m**2 + m**3 + reads * m
        longest += max(k * reads * m + shared + k * m**2 + k * m + m * c for k, c in zip(cut.sizes, own, strict=True))
    return ceil(longest)


def words_sent(cut: CutSizes) -> int:
    """Numbers that go between processors in a step: x and P gathered, and of each measurement the innovation, S and P H'."""
    n = cut.states
    return n + n * (n + 1) // 2 + sum(m + m * (m + 1) // 2 + n * m for m in cut.rows)
