"""A linear-phase FIR low-pass filter whose output stands at the instant that it belongs to.

Spec 02 eq. (17)-(18): a windowed sinc, -6 dB at the cutoff, symmetric, so that it delays all frequencies alike, by half its
length. The delay is taken out of the stamps, not of the readings: the output of a window stands at the window's middle, of means
over intervals half an interval before the middle of the stamps. So an even number of taps puts means exactly on epochs, an odd
number instants.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.data.preprocessing.rows import columns_of, count_of, ordered, period_of, refuse_arrival
from estimfw.data.record import Event, FloatArray, Stream
from estimfw.errors import ConfigError, DataError

__all__ = ["FirWindow", "LowPass", "gain", "low_passed", "steps_between", "taps_for"]

FirWindow = Literal["hamming", "hann", "blackman"]

#: Stamps may miss their place among equal steps by this part of a step.
_IRREGULAR = 0.25
#: Gain at the cutoff of a filter that is long enough for it.
_HALF = (0.45, 0.55)


@dataclass(frozen=True, slots=True)
class LowPass:
    """A filter.

    Attributes
    ----------
    cutoff : float, Hz
        Where it passes half, -6 dB.
    length : float or None, s
        Rounded to the number of taps that puts the output on the stamps.
    taps : int or None
        Instead of ``length``.
    window : str
    longest_gap : float, s
        Missing readings up to this long are put in, on a straight line.
    rate : float or None, Hz
        That the stamps must show.
    """

    cutoff: float
    length: float | None = None
    taps: int | None = None
    window: FirWindow = "hamming"
    longest_gap: float = 0.0
    rate: float | None = None


def gain(taps: FloatArray, frequency: float, period: float) -> float:
    """|H| of taps (n,) at a frequency in Hz."""
    return float(np.abs(np.sum(taps * np.exp(-2j * np.pi * frequency * period * np.arange(taps.size)))))


def taps_for(low_pass: LowPass, period: float, *, means: bool) -> FloatArray:
    """The taps (n,), of sum 1.

    Parameters
    ----------
    low_pass : LowPass
    period : float, s
        Sampling interval.
    means : bool
        Whether readings are means over intervals: an even number of taps; else an odd one. Given ``taps`` stay.

    Raises
    ------
    ConfigError
        The cutoff is beyond half the rate, or too low for the length.
    """
    from scipy.signal import firwin

    if low_pass.cutoff >= 0.5 / period:
        raise ConfigError(
            f"the cutoff of {low_pass.cutoff:g} Hz is not below half the rate of {1.0 / period:.6g} Hz",
            within=("cutoff",),
        )
    count = low_pass.taps or _count(float(low_pass.length or 0.0) / period, means=means)
    made = np.asarray(firwin(count, low_pass.cutoff, fs=1.0 / period, window=low_pass.window), dtype=float)
    passed = gain(made, low_pass.cutoff, period)
    if not _HALF[0] < passed < _HALF[1]:
        raise ConfigError(
            f"a filter of {count * period:.4g} s is too short for a cutoff of {low_pass.cutoff:g} Hz: it passes "
            f"{100.0 * passed:.3g} % there, not half",
            hint=f"a length of {2.0 / low_pass.cutoff:.3g} s or more will do",
            within=("length",) if low_pass.taps is None else ("taps",),
        )
    return made


def _count(length: float, *, means: bool) -> int:
    """The nearest even (or odd) number, at least 2."""
    return max(2, 2 * round(0.5 * length)) if means else max(3, 2 * round(0.5 * (length - 1.0)) + 1)


def low_passed(
    stream: Stream, columns: tuple[str, ...], low_pass: LowPass, into: str
) -> tuple[Stream, tuple[Event, ...]]:
    """A stream of filtered columns, at the instants at which the whole window holds readings or holes.

    Parameters
    ----------
    stream : Stream
        At a constant rate; lost rows are holes.
    columns : tuple of str
        The result has no others. Empty: all.
    low_pass : LowPass
    into : str
        Name of the result.

    Raises
    ------
    DataError
        Fewer rows than taps; stamps that are not regular, or show another rate.
    ConfigError
        See `taps_for`.

    Notes
    -----
    Where a hole longer than ``longest_gap`` touches the window the output is NaN, and an event says how often.
    """
    refuse_arrival(stream, "filtered")
    raw, events = ordered(stream)
    period, means = period_of(raw, low_pass.rate), raw.kind != "sample"
    taps = taps_for(low_pass, period, means=means)
    place = _places(raw, period)
    if place[-1] + 1 < taps.size:
        raise DataError(
            f"stream {raw.name!r} has {place[-1] + 1} rows ({(place[-1] + 1) * period:.6g} s), the filter needs {taps.size} "
            f"({taps.size * period:.6g} s)",
            hint="a longer record, or a shorter filter with a higher cutoff",
        )
    names = columns or raw.columns
    values = np.moveaxis(raw.values[..., columns_of(raw, names)], -2, -1)
    filled, found = _on_grid(raw, values, place, round(low_pass.longest_gap / period + 1e-6))
    made = np.array([np.convolve(line, taps, "valid") for line in filled.reshape(-1, filled.shape[-1])])
    made = made.reshape(*filled.shape[:-1], -1)
    middle = np.arange(made.shape[-1]) + 0.5 * (taps.size - 1) - (0.5 if means else 0.0)
    time = np.interp(middle, place, raw.time)
    events += (*found, *_told(raw, made, time, taps.size * period))
    result = replace(
        raw, name=into, time=time, values=np.moveaxis(made, -1, -2), columns=names, kind="sample", period=period
    )
    return result, events


def _places(stream: Stream, period: float) -> NDArray[np.int64]:
    """Where each row stands among equal steps, from 0; a clock that drifts is followed."""
    return np.concatenate([[0], np.cumsum(steps_between(stream.name, stream.time, period))]).astype(np.int64)


def steps_between(name: str, time: FloatArray, period: float) -> FloatArray:
    """Whole sampling intervals (N - 1,) between stamps (N,) s; DataError where they are none."""
    steps = np.diff(time) / period
    whole = np.round(steps)
    bad = (np.abs(steps - whole) > _IRREGULAR) | (whole < 1.0)
    if bad.any():
        at = int(np.argmax(bad))
        raise DataError(
            f"stream {name!r}: {time[at]:.10g} s and {time[at + 1]:.10g} s are no whole number of "
            f"sampling intervals ({period:.6g} s) apart",
            hint="a FIR filter needs readings at a constant rate: join the column onto a regular stream first",
        )
    return np.asarray(whole)


def _on_grid(
    stream: Stream, values: FloatArray, place: NDArray[np.int64], longest: int
) -> tuple[FloatArray, tuple[Event, ...]]:
    """Readings (..., k, G) on equal steps, holes of up to ``longest`` rows bridged, NaN in the others."""
    grid = np.full((*values.shape[:-1], int(place[-1]) + 1), np.nan)
    grid[..., place] = np.where(np.isfinite(values), values, np.nan)
    holes = np.isnan(grid)
    for line in grid.reshape(-1, grid.shape[-1]) if longest and holes.any() else ():
        _bridge(line, longest)
    put = holes & ~np.isnan(grid)
    first, count = count_of(put)
    if not count:
        return grid, ()
    at = float(np.interp(first, place, stream.time))
    text = "missing readings put in on a straight line, before the low-pass filter"
    return grid, (Event(at, stream.name, "bridged", text, count),)


def _bridge(line: FloatArray, longest: int) -> None:
    there = np.flatnonzero(~np.isnan(line))
    for k in np.flatnonzero((np.diff(there) > 1) & (np.diff(there) <= longest + 1)):
        a, b = there[k], there[k + 1]
        line[a:b] = line[a] + (line[b] - line[a]) * np.arange(b - a) / (b - a)


def _told(stream: Stream, made: FloatArray, time: FloatArray, length: float) -> tuple[Event, ...]:
    events = []
    outside = (stream.time < time[0]) | (stream.time > time[-1])
    text = (
        f"no whole window of the low-pass filter ({length:.6g} s): rows before {time[0]:.10g} s and after {time[-1]:.10g} s "
        f"are left out; a reading is known {0.5 * length:.6g} s after its instant"
    )
    events.append(Event(float(stream.time[0]), stream.name, "cut", text, int(outside.sum())))
    first, count = count_of(np.isnan(made))
    if count:
        text = "readings are missing within the window of the low-pass filter: its output is missing"
        events.append(Event(float(time[first]), stream.name, "missing", text, count))
    return tuple(events)
