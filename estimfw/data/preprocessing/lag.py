"""Whether two columns of a stream tell one motion at one time: a clock that nobody has set shows as a lag.

A speed that was joined onto an IMU changes as the specific force forward says, at the same instant if both clocks agree. What
both gain over spans of 2 s, less the mean of that over 8 s, is compared, and the shift is sought at which they agree best. That
leaves braking and gathering speed, and takes out hills (gravity in the specific force), biases, springs and pulses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, ordered, period_of
from estimfw.data.record import Event, FloatArray, Stream

__all__ = ["Lag", "LagLimit", "lag_between", "lag_events"]

#: Over which gains are compared, and over which their mean is taken out, s.
_SPAN, _TREND = 2.0, 8.0


@dataclass(frozen=True, slots=True)
class LagLimit:
    """What is compared, and what is too much.

    Attributes
    ----------
    column, against : str
        ``against`` is the rate of change of ``column`` (increments of it in a stream of increments), or the same quantity.
    relation : 'rate_of_change' or 'same'
    largest : float, s
        A lag that is longer by more than three standard errors is flagged.
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
    """By how many s the first column is late, its standard error (s), and how well both agree there (a correlation)."""

    seconds: float
    sigma: float
    correlation: float


def lag_between(late: FloatArray, reference: FloatArray, period: float, within: float) -> Lag:
    """The lag of one series behind another, both (N,) of one quantity at equal steps of ``period`` s; NaN says nothing.

    Notes
    -----
    With y = a x + n at the lag of the largest correlation, the lag is wrong by -sum(n x') / (a sum(x'^2)). The variance of
    that sum is the overlap of the spectra of n and x', taken from the data: what else a sensor sees (hills) counts as n.
    """
    from scipy.signal import correlate

    half, trend = max(1, round(0.5 * _SPAN / period)), max(2, round(_TREND / period))
    x, y = (_gains(series, half, trend) for series in (late, reference))
    reach = min(max(2, round(within / period)), x.size - 1)
    if reach < 2:
        return Lag(0.0, np.inf, 0.0)
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
    return Lag(middle * period, _error(x, y, int(lags[at])) * period, float(near[at]))


def _error(x: FloatArray, y: FloatArray, lag: int) -> float:
    """Standard error of a lag, in rows."""
    x, y = x[max(lag, 0) : x.size + min(lag, 0)], y[max(-lag, 0) : y.size + min(-lag, 0)]
    slope, power = np.gradient(x), float(np.sum(x * x))
    share = float(np.sum(x * y)) / power if power > 0.0 else 0.0
    if share == 0.0:
        return np.inf
    noise, change = (np.abs(np.fft.fft(series)) ** 2 for series in (y - share * x, slope))
    spread = float(np.sqrt(np.sum(noise * change))) / x.size
    return spread / (abs(share) * float(np.sum(slope * slope)))


def _energy(x: FloatArray, lags: NDArray[np.int64]) -> FloatArray:
    """Sum of the squares of x[k + lag] over all k at which the other series, of the same length, has a value."""
    total = np.concatenate([[0.0], np.cumsum(x * x)])
    return np.asarray(total[x.size + np.minimum(lags, 0)] - total[np.maximum(lags, 0)])


def _gains(series: FloatArray, half: int, trend: int) -> FloatArray:
    """What is gained over twice ``half`` rows, without its mean over ``trend`` rows; zero where nothing is known."""
    if series.size <= 2 * half + trend:
        return np.zeros(0)
    gain = series[2 * half :] - series[: -2 * half]
    known = np.isfinite(gain)
    gain = np.where(known, gain - (np.mean(gain[known]) if known.any() else 0.0), 0.0)
    total = np.concatenate([[0.0], np.cumsum(gain)])
    mean = (total[trend:] - total[:-trend]) / trend
    begin = trend // 2
    inside = slice(begin, begin + mean.size)
    return np.asarray(np.where(known[inside], gain[inside] - mean, 0.0))


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
    if abs(worst.seconds) <= limit.largest + 3.0 * worst.sigma:
        return ()
    text = (
        f"{limit.column} {'lags' if worst.seconds > 0.0 else 'leads'} {limit.against} by {abs(worst.seconds):.3g} s "
        f"(± {worst.sigma:.2g} s, correlation {worst.correlation:.2f}): shift the stream it comes from, "
        f"`latency: {worst.seconds:.3g} s`"
    )
    return (Event(float(raw.time[0]), raw.name, "lag", text),)
