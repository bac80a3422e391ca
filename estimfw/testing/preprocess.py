"""Preprocessing is a pure function of the record, the same for runs side by side, and in a session row by row."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from estimfw.config.compose import Problem
from estimfw.data.preprocessing.online import Layout, Online, Row
from estimfw.data.record import Record, Stream
from estimfw.run.load import source_record

__all__ = ["check_preprocess"]


def check_preprocess(problem: Problem, record: Record | None = None) -> None:
    """Apply each component of ``preprocess`` to what the ones before it made.

    Parameters
    ----------
    problem : Problem
        With a section ``preprocess``.
    record : Record, optional
        Instead of the one that the config's source makes.

    Raises
    ------
    AssertionError
        A component changes the record that it is given, makes rows out of order, treats runs side by side otherwise than one
        alone, or (where it has ``online``) makes other rows in a session.
    """
    assert problem.preprocess, "the config has no section `preprocess`"
    record = record if record is not None else source_record(problem)
    for name, component in problem.preprocess.items():
        before = {n: (s.time.copy(), s.values.copy()) for n, s in record.streams.items()}
        made = component.apply(record)
        for stream, (time, values) in before.items():
            same = np.array_equal(record.streams[stream].time, time)
            same &= np.array_equal(record.streams[stream].values, values, equal_nan=True)
            assert same, f"{name} changes the stream {stream!r} of the record that it is given"
        for stream in made.streams.values():
            assert np.all(np.diff(stream.time) > 0.0), f"{name} makes rows of {stream.name!r} out of order"
        _check_runs(name, component, record, made)
        if hasattr(component, "online"):
            _check_online(name, component, record, made)
        record = made


def _check_runs(name: str, component: Any, record: Record, alone: Record) -> None:
    streams = {n: replace(s, values=np.stack([s.values, s.values])) for n, s in record.streams.items()}
    for stream in component.apply(replace(record, streams=streams)).streams.values():
        due = alone.streams[stream.name]
        same = stream.values.shape == (2, *due.values.shape) and all(
            np.array_equal(run, due.values, equal_nan=True) for run in stream.values
        )
        assert same, f"{name} makes another stream {stream.name!r} of two runs side by side than of one alone"


def _check_online(name: str, component: Any, record: Record, due: Record) -> None:
    known = {n: Layout(s.columns, s.kind, s.period) for n, s in record.streams.items() if s.period is not None}
    online: Online = component.online(known)
    rows = sorted(
        (Row(n, float(t), s.values[k]) for n, s in record.streams.items() if n in known for k, t in enumerate(s.time)),
        key=lambda row: row.time,
    )
    made = [*(out for row in rows for out in online.push(row)), *online.finish()]
    for stream in due.streams.values():
        own = [row for row in made if row.stream == stream.name]
        if stream.name in online.layouts:
            _compare(name, stream, own)


def _compare(name: str, due: Stream, rows: list[Row]) -> None:
    time = np.array([row.time for row in rows])
    at = np.searchsorted(time, due.time - 1e-6)
    there = at < time.size
    assert there.all() and np.all(np.abs(time[at] - due.time) < 1e-6), (
        f"{name} makes no row of {due.name!r} at {due.time[int(np.argmin(there))]:g} s in a session, or not in order"
    )
    values = np.array([rows[k].values for k in at])
    assert np.allclose(values, due.values, rtol=1e-9, atol=1e-9, equal_nan=True), (
        f"{name} makes other values of {due.name!r} in a session than of the whole record"
    )
