"""Whether two columns of a stream tell one motion at one time: a clock that nobody has set shows as a lag.

A speed that was joined onto an IMU changes as the specific force forward says, at the same instant if both clocks agree. Over
spans of half a second the gain of the one is compared with that of the other, and the shift is sought at which they agree best.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, ordered, period_of
from estimfw.data.record import Event, FloatArray, Stream

__all__ = ["Lag", "LagLimit", "lag_between", "lag_events"]

#: Over which gains are compared, s.
_SPAN = 0.5


@dataclass(frozen=True, slots=True)
class LagLimit:
    """What is compared, and what is too much.

    Attributes
    ----------
    column, against : str
        ``against`` is the rate of change of ``column`` (increments of it in a stream of increments), or the same quantity.
    relation : 'rate_of_change' or 'same'
    largest : float, s
        A longer lag is flagged.
    within : float, s
        Lags are sought up to this.
    least : float
        Correlation below which nothing can be said.
    """

    column: str
    against: str
    relation: Literal["rate_of_change", "same"]
    largest: float
    within: float
    least: float


@dataclass(frozen=True, slots=True)
class Lag:
    """By how many s the first column is late, and how well both agree at that lag (a correlation)."""

    seconds: float
    correlation: float


def lag_between(late: FloatArray, reference: FloatArray, period: float, within: float) -> Lag:
    """The lag of one series behind another, both (N,) of one quantity at equal steps of ``period`` s; NaN says nothing."""
    from scipy.signal import correlate

    half = max(1, round(0.5 * _SPAN / period))
    x, y = (_gains(series, half) for series in (late, reference))
    reach = min(max(2, round(within / period)), x.size - 1)
    if reach < 2:
        return Lag(0.0, 0.0)
    lags = np.arange(-reach, reach + 1)
    energy = np.sqrt(_energy(x, lags) * _energy(y, -lags))
    products = correlate(x, y, mode="full")[x.size - 1 + lags]
    near = np.divide(products, energy, out=np.zeros(lags.size), where=energy > 0.0)
    at = int(np.argmax(near))
    middle = float(at - reach)
    if 0 < at < near.size - 1:
        below, top, above = near[at - 1 : at + 2]
        bend = below - 2.0 * top + above
        middle += 0.5 * float((below - above) / bend) if bend < 0.0 else 0.0
    return Lag(middle * period, float(near[at]))


def _energy(x: FloatArray, lags: NDArray[np.int64]) -> FloatArray:
    """Sum of the squares of x[k + lag] over all k at which the other series, of the same length, has a value."""
    total = np.concatenate([[0.0], np.cumsum(x * x)])
    return np.asarray(total[x.size + np.minimum(lags, 0)] - total[np.maximum(lags, 0)])


def _gains(series: FloatArray, half: int) -> FloatArray:
    if series.size <= 2 * half:
        return np.zeros(0)
    gain = series[2 * half :] - series[: -2 * half]
    known = np.isfinite(gain)
    mean = float(np.mean(gain[known])) if known.any() else 0.0
    return np.where(known, gain - mean, 0.0)


def lag_events(stream: Stream, limit: LagLimit) -> tuple[Event, ...]:
    """An event where a column lags, or leads, by more than ``largest``, or agrees with the other at no lag.

    Of several runs the worst is told.

    Raises
    ------
    DataError
        No such columns, or rows out of order.
    """
    raw, _ = ordered(stream)
    period = period_of(raw)
    late, against = (np.moveaxis(raw.values[..., columns_of(raw, (c,))], -2, -1) for c in (limit.column, limit.against))
    if limit.relation == "rate_of_change":
        gained = np.where(np.isfinite(against), against, 0.0) * (1.0 if raw.kind == "increment" else period)
        against = np.cumsum(gained, axis=-1)
    pairs = zip(late.reshape(-1, len(raw)), against.reshape(-1, len(raw)), strict=True)
    found = [lag_between(x, y, period, limit.within) for x, y in pairs]
    clear = [lag for lag in found if lag.correlation >= limit.least]
    if not clear:
        text = (
            f"{limit.column} and {limit.against} agree at no lag up to {limit.within:g} s (correlation "
            f"{max(lag.correlation for lag in found):.2f}): clocks cannot be compared, or the columns are not of one motion"
        )
        return (Event(float(raw.time[0]), raw.name, "lag", text),)
    worst = max(clear, key=lambda lag: abs(lag.seconds))
    if abs(worst.seconds) <= limit.largest:
        return ()
    text = (
        f"{limit.column} {'lags' if worst.seconds > 0.0 else 'leads'} {limit.against} by {abs(worst.seconds):.3g} s (correlation "
        f"{worst.correlation:.2f}): shift the stream it comes from, `latency: {worst.seconds:.3g} s`"
    )
    return (Event(float(raw.time[0]), raw.name, "lag", text),)
