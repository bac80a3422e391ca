"""The low-pass filter against scipy and spec 02 eq. (17)-(18): its response, its delay, and what holes do to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import firwin, freqz

from estimfw.data.preprocessing.fir import LowPass, low_passed, taps_for
from estimfw.data.record import Event, Stream
from estimfw.errors import ConfigError, DataError

FloatArray = NDArray[np.floating[Any]]
PERIOD = 0.01
SPEC = LowPass(cutoff=0.5, taps=400)


def stream(values: FloatArray, *, means: bool = True, time: FloatArray | None = None) -> Stream:
    stamps = PERIOD * np.arange(1, values.shape[-1] + 1) if time is None else np.asarray(time, dtype=float)
    rows = np.asarray(values[..., None], dtype=float)
    return Stream("odometer", stamps, rows, ("speed",), "mean" if means else "sample", PERIOD)


def filtered(raw: Stream, low_pass: LowPass) -> tuple[Stream, FloatArray, dict[str, Event]]:
    made, events = low_passed(raw, ("speed",), low_pass, "smooth")
    return made, np.asarray(made.values[..., 0]), {e.kind: e for e in events}


def printed(taps: int) -> FloatArray:
    """Eq. (17) of the specification, term by term."""
    m = np.arange(taps) - (taps - 1) / 2
    h = np.sinc(2 * 0.5 / 100.0 * m) * (0.54 + 0.46 * np.cos(2 * np.pi * m / (taps - 1)))
    return np.asarray(h / h.sum())


def test_taps_are_those_of_the_specification_and_of_scipy() -> None:
    taps = taps_for(SPEC, PERIOD, means=True)
    assert taps == pytest.approx(printed(400), abs=1e-16)
    assert taps == pytest.approx(firwin(400, 0.5, fs=100.0), abs=1e-16)


def test_half_passes_at_the_cutoff_and_next_to_nothing_above_twice_of_it() -> None:
    taps = taps_for(SPEC, PERIOD, means=True)
    frequency, response = freqz(taps, worN=1 << 15, fs=100.0)
    at = np.interp([0.4, 0.5], frequency, 20 * np.log10(np.abs(response) + 1e-300))
    assert at == pytest.approx([-3.0, -6.0], abs=0.1)
    assert np.max(np.abs(response[frequency > 1.0])) < 0.0031


@pytest.mark.parametrize("frequency", [0.2, 0.5, 0.9, 8.0])
def test_a_sine_comes_out_with_the_gain_of_scipy_and_without_any_delay(frequency: float) -> None:
    time = PERIOD * np.arange(1, 2001)
    middle = time - 0.5 * PERIOD
    made, values, _ = filtered(stream(np.sin(2 * np.pi * frequency * middle)), SPEC)
    _, response = freqz(firwin(400, 0.5, fs=100.0), worN=[frequency], fs=100.0)
    # The response of a symmetric filter about its middle is real: its sign is part of it.
    real = float((response[0] * np.exp(2j * np.pi * frequency * PERIOD * 399 / 2)).real)
    assert values == pytest.approx(real * np.sin(2 * np.pi * frequency * made.time), abs=1e-12)


@pytest.mark.parametrize(("means", "taps"), [(True, 400), (False, 401), (True, 401), (False, 400), (True, 30)])
def test_a_ramp_is_unchanged(means: bool, taps: int) -> None:
    time = PERIOD * np.arange(1, 1001)
    instants = time - (0.5 * PERIOD if means else 0.0)
    low_pass = LowPass(cutoff=0.5 if taps > 100 else 8.0, taps=taps)
    made, values, _ = filtered(stream(3.0 + 2.0 * instants, means=means), low_pass)
    assert values == pytest.approx(3.0 + 2.0 * made.time, abs=1e-11)
    assert len(made) == 1000 - taps + 1


def test_an_even_number_of_taps_puts_means_exactly_on_the_stamps() -> None:
    raw = stream(np.ones(1000))
    made, _, _ = filtered(raw, SPEC)
    assert np.isin(made.time, raw.time).all()
    # Eq. (18): v_fir(t_k) takes 200 readings to either side, the first one at t_200 = 2 s.
    assert made.time[0] == pytest.approx(2.0)
    impulse = np.zeros(1000)
    impulse[500] = 1.0  # over (5.00, 5.01]
    made, values, _ = filtered(stream(impulse), SPEC)
    assert values[np.flatnonzero(np.abs(made.time - 5.0) < 1e-9)] == pytest.approx(printed(400)[200])
    assert values[np.flatnonzero(np.abs(made.time - 5.01) < 1e-9)] == pytest.approx(printed(400)[199])


@pytest.mark.parametrize(("means", "count"), [(True, 400), (False, 401)])
def test_a_length_becomes_the_number_of_taps_that_puts_the_output_on_the_stamps(means: bool, count: int) -> None:
    assert taps_for(LowPass(0.5, length=4.0), PERIOD, means=means).size == count
    raw = stream(np.ones(1000), means=means)
    assert np.isin(filtered(raw, LowPass(0.5, length=4.0))[0].time, raw.time).all()


def test_latency_and_rows_left_out_are_told() -> None:
    _, _, events = filtered(stream(np.ones(1000)), SPEC)
    assert events["cut"].count == 399
    assert "known 2 s after its instant" in events["cut"].text


def test_a_missing_reading_is_a_hole_as_long_as_the_filter_and_told() -> None:
    values = np.ones(2000)
    values[1000] = np.nan
    made, out, events = filtered(stream(values), SPEC)
    assert np.isnan(out).sum() == 400
    assert events["missing"].count == 400
    assert made.time[np.isnan(out)] == pytest.approx(PERIOD * np.arange(801, 1201))
    assert out[~np.isnan(out)] == pytest.approx(np.ones(len(made) - 400))


def test_rows_that_are_not_there_are_holes_too() -> None:
    time = PERIOD * np.arange(1, 2001)
    kept = np.delete(np.arange(2000), np.arange(1000, 1010))
    made, out, events = filtered(stream(np.ones(1990), time=time[kept]), SPEC)
    assert np.isnan(out).sum() == events["missing"].count == 409
    assert made.time == pytest.approx(PERIOD * np.arange(200, 1801))


def test_short_holes_are_bridged_on_a_line_and_told_and_longer_ones_stay() -> None:
    middle = PERIOD * np.arange(1, 2001) - 0.5 * PERIOD
    values = 3.0 + 2.0 * middle
    values[1000:1010] = np.nan
    made, out, events = filtered(stream(values), LowPass(0.5, taps=400, longest_gap=0.1))
    assert out == pytest.approx(3.0 + 2.0 * made.time, abs=1e-11)
    assert (events["bridged"].count, events["bridged"].time) == pytest.approx((10, 10.01))
    _, out, events = filtered(stream(values), LowPass(0.5, taps=400, longest_gap=0.09))
    assert np.isnan(out).any()
    assert "bridged" not in events


def test_a_record_shorter_than_the_filter_is_refused() -> None:
    with pytest.raises(DataError, match=r"has 399 rows \(3.99 s\), the filter needs 400 \(4 s\)"):
        filtered(stream(np.ones(399)), SPEC)
    assert len(filtered(stream(np.ones(400)), SPEC)[0]) == 1


def test_stamps_of_another_rate_or_of_none_are_refused() -> None:
    with pytest.raises(DataError, match=r"the sampling interval is 0.02 s"):
        filtered(stream(np.ones(1000)), LowPass(0.5, taps=400, rate=50.0))
    shaken = PERIOD * np.arange(1, 1001)
    shaken[500] += 0.004
    with pytest.raises(DataError, match="no whole number of sampling intervals"):
        filtered(stream(np.ones(1000), time=shaken), SPEC)


def test_a_clock_that_drifts_is_followed() -> None:
    true = 1.0005 * PERIOD * np.arange(1, 20001)
    made, out, events = filtered(stream(true, means=False, time=true), LowPass(0.5, taps=401))
    assert out == pytest.approx(made.time, abs=1e-9)
    assert "missing" not in events


def test_a_cutoff_beyond_half_the_rate_or_too_low_for_the_length_is_refused() -> None:
    with pytest.raises(ConfigError, match="cutoff of 60 Hz is not below half the rate of 100 Hz"):
        filtered(stream(np.ones(1000)), LowPass(60.0, taps=400))
    with pytest.raises(ConfigError, match="too short for a cutoff of") as told:
        filtered(stream(np.ones(1000)), LowPass(0.1, taps=400))
    assert "20 s or more" in str(told.value.hint)


def test_runs_side_by_side_are_as_each_alone() -> None:
    runs = np.random.default_rng(3).standard_normal((3, 600))
    together = filtered(stream(runs), SPEC)[1]
    assert np.array_equal(together, [filtered(stream(run), SPEC)[1] for run in runs])
