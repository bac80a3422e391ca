"""Clipped readings: those at the end of the range, known or seen, and no others."""

from __future__ import annotations

import numpy as np
import pytest

from estimfw.data.preprocessing.clipping import Range, clipped_readings, without_clipped
from estimfw.data.record import Stream

TIME = np.asarray(0.1 * np.arange(400), dtype=float)
SWING = np.asarray(30.0 * np.sin(0.5 * TIME), dtype=float)


def test_what_a_sensor_of_that_range_cannot_show_is_what_is_found() -> None:
    """Made by clipping, so the truth is known: exactly the readings that clipping changed, or met at the very end."""
    shown = np.clip(SWING, -20.0, 25.0)
    truly = (SWING <= -20.0) | (SWING >= 25.0)
    assert truly.any()
    assert np.array_equal(clipped_readings(shown, Range(lowest=-20.0, highest=25.0)), truly)
    assert np.array_equal(clipped_readings(shown, Range(highest=25.0)), SWING >= 25.0)


def test_an_unknown_range_shows_in_its_end_being_repeated() -> None:
    shown = np.clip(SWING, -20.0, 25.0)
    assert np.array_equal(clipped_readings(shown, Range(repeated=3)), (SWING <= -20.0) | (SWING >= 25.0))
    assert not clipped_readings(SWING, Range(repeated=3)).any()
    assert not clipped_readings(np.maximum(SWING, 0.0), Range(repeated=3)).any()  # a vehicle that stands
    assert clipped_readings(np.maximum(SWING, 0.0), Range(repeated=3, rest=None)).any()


def test_one_event_a_column_says_what_was_shown_from_when_to_when_and_what_was_done() -> None:
    values = np.stack([np.minimum(SWING, 25.0), SWING], axis=1)
    values[3] = np.nan
    raw = Stream("log", TIME, values, ("v", "w"), "sample", 0.1)
    made, (event,) = without_clipped(raw, ("v",), Range(highest=25.0), leave_out=True)
    rows = np.flatnonzero(values[:, 0] == 25.0)
    assert np.flatnonzero(np.isnan(made.values[:, 0])).tolist() == sorted([3, *rows.tolist()])
    assert np.array_equal(made.values[:, 1], values[:, 1], equal_nan=True)
    assert (event.kind, event.source, event.count) == ("clipped", "log", rows.size)
    assert event.time == pytest.approx(TIME[rows[0]])
    assert f"at the end of its range, 25, from {TIME[rows[0]]:.10g} s (last at {TIME[rows[-1]]:.10g} s)" in event.text
    kept, (told,) = without_clipped(raw, ("v",), Range(highest=25.0), leave_out=False)
    assert np.array_equal(kept.values, values, equal_nan=True)
    assert told.text.endswith("readings used as they are")
