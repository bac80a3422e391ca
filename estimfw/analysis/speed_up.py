"""What a processor for each subsystem gains over one that runs the symmetric global filter, and from where on it gains.

With c the products of the busiest processor and s those of the symmetric global filter (a component at a time, dense rows on
both sides), a step takes s t_mul on one processor, and c t_mul + words t_word + (stages + 1) latency on N. The gain without any
communication goes to N / (1 + 1 / (3 N)) for many states and few rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from estimfw.analysis.dense_cost import CutSizes, balanced_sizes, busiest_processor_cost, symmetric_cost, words_sent

__all__ = ["Link", "SpeedUp", "break_even_latency", "break_even_states", "equal_cut", "largest_speed_up", "speed_up"]

#: Beyond so many states nobody looks for a gain.
MOST_STATES = 1_000_000


@dataclass(frozen=True, slots=True)
class Link:
    """Times in s: of a synchronisation, of a word on its way, of a multiplication with what goes with it."""

    latency: float
    word: float
    multiplication: float


@dataclass(frozen=True, slots=True)
class SpeedUp:
    """Times of one step, s.

    Attributes
    ----------
    one : float
        On one processor, the symmetric global filter.
    busiest : float
        Of the processor that has most to do, without waiting for words.
    words, waiting : float
        For words on their way, and for synchronisations.
    """

    one: float
    busiest: float
    words: float
    waiting: float

    @property
    def several(self) -> float:
        """On a processor for each subsystem."""
        return self.busiest + self.words + self.waiting

    @property
    def ratio(self) -> float:
        """How many times quicker; below 1: slower."""
        return self.one / self.several

    @property
    def without_communication(self) -> float:
        return self.one / self.busiest


def speed_up(cut: CutSizes, link: Link) -> SpeedUp:
    """Predicted times."""
    return SpeedUp(
        symmetric_cost(cut.states, cut.measured) * link.multiplication,
        busiest_processor_cost(cut) * link.multiplication,
        words_sent(cut) * link.word,
        (cut.stages + 1) * link.latency,
    )


def break_even_latency(cut: CutSizes, link: Link) -> float:
    """The latency (s) below which several processors gain; negative where words alone take longer than what is saved."""
    times = speed_up(cut, link)
    return (times.one - times.busiest - times.words) / (cut.stages + 1)


def equal_cut(states: int, parts: int, rows_per_state: Fraction) -> CutSizes:
    """Equal subsystems with local measurements, and at least one row in all."""
    rows = max(1, round(states * rows_per_state))
    return CutSizes.local(balanced_sizes(states, parts), balanced_sizes(rows, parts))


def break_even_states(parts: int, rows_per_state: Fraction, link: Link) -> int | None:
    """The number of states from which on equal subsystems gain; None where it is beyond all reason."""

    def gains(states: int) -> bool:
        return speed_up(equal_cut(states, parts, rows_per_state), link).ratio > 1.0

    high = parts
    while not _from_here_on(gains, high):
        high *= 2
        if high > MOST_STATES:
            return None
    low = max(parts - 1, high // 2)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if gains(middle) else (middle, high)
    return high


def _from_here_on(gains: Callable[[int], bool], states: int) -> bool:
    """Also with a few states more: sizes and rows are whole numbers, so that the gain is not smooth."""
    return all(gains(states + more) for more in range(3))


def largest_speed_up(parts: int, rows_per_state: float = 0.0) -> float:
    """What N processors gain where there are very many states in equal nodes, and communication takes no time.

    The ratio of the terms with n^3; with hardly any rows it is N / (1 + 1 / (3 N)).
    """
    N, r = parts, rows_per_state
    rows = r * (1.0 / (2 * N) + 3.0 / (2 * N**2)) + (2.0 * r**2 + r**3) / N**2
    return 1.5 * (1.0 + r) / (1.5 / N * (1.0 + 1.0 / (3 * N)) + rows)
