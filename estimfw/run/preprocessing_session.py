"""A session whose rows are preprocessed as they come: the estimates of a batch run, ``latency`` s later.

Rows of all streams are handed over as the sensors make them. Those of the driving stream are held back until every measurement
that belongs to their instant is through its own filters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimfw.config.compose import Problem
from estimfw.data.preprocessing.online import Layout, Layouts, Online, Row
from estimfw.data.record import SAME, Event, FloatArray, Record, Stream
from estimfw.errors import DataError, EstimfwError, UsageError
from estimfw.model.nominal import InitialNominal
from estimfw.run.session import Estimate, Session

__all__ = ["PreprocessingSession"]


class PreprocessingSession:
    """A filter that is fed with raw rows.

    Parameters
    ----------
    problem : Problem
        Composed config; its source is not used.
    streams : mapping of str to Stream
        What the raw rows are: columns, kind and period of each stream (a record of the same source will do; its rows are not
        read).
    start : InitialNominal, optional
        See `estimfw.run.session.Session`.
    time : float, s, optional
        The instant of the start; left out: where the first row that is through begins.
    start_from : float, s, optional
        So much of the driving stream, preprocessed, is waited for; from it the config's start is found, as in a batch run.

    Attributes
    ----------
    latency : float, s
        By which an estimate comes later than the instant that it is for, if no reading is missing.

    Raises
    ------
    UsageError
        A component that needs the whole record, or a stream without a period.
    """

    def __init__(
        self,
        problem: Problem,
        streams: Mapping[str, Stream],
        start: InitialNominal | None = None,
        time: float | None = None,
        start_from: float | None = None,
    ) -> None:
        layouts: Layouts = {name: _layout(stream) for name, stream in streams.items()}
        self._raw, self._chain = layouts, list[Online]()
        for name, component in problem.preprocess.items():
            if not hasattr(component, "online"):
                raise UsageError(
                    f"preprocess {name!r} needs the whole record: a session cannot have it",
                    hint="run the record as a whole, or leave it out",
                )
            try:
                self._chain.append(component.online(layouts))
            except EstimfwError as error:
                problem.document.placed(error, ("preprocess", name))
                raise
            layouts = self._chain[-1].layouts
        self._layouts, self._start, self._time, self._start_from = layouts, start, time, start_from
        self._problem = replace(problem, preprocess={})
        self._driver = problem.provider.stream
        self._read = {m.stream: m.columns for m in problem.plan.whole.measurements if m.stream is not None}
        for known in problem.plan.inputs:
            if known.stream is not None:
                self._read[known.stream] = (*self._read.get(known.stream, ()), *known.columns)
        used = [s for s in (*self._read, self._driver) if s is not None]
        self._waits = {s: layouts[s].latency for s in used if s in layouts}
        self.latency = max(self._waits.values(), default=0.0)
        self._newest = dict.fromkeys(self._waits, -np.inf)
        self._held: list[Row] = []
        self._all: list[Row] = []
        self._inner: Session | None = None

    @property
    def session(self) -> Session | None:
        """The filter itself; None before the first row is through."""
        return self._inner

    @property
    def estimate(self) -> Estimate | None:
        """After the last step; None before the first."""
        return self._inner.estimate if self._inner is not None else None

    @property
    def events(self) -> list[Event]:
        """What was found in the rows, and by the filter."""
        found = [event for online in self._chain for event in online.events]
        return [*found, *(self._inner.events if self._inner is not None else [])]

    def feed(self, stream: str, time: float, values: ArrayLike | Mapping[str, float]) -> list[Estimate]:
        """Hand over a raw row.

        Rows of one instant: that of the driving stream last.

        Parameters
        ----------
        stream : str
        time : float, s
            Its stamp, on the clock of its sensor.
        values : (columns,) array, or mapping of column to value
            SI; NaN marks a missing component.

        Returns
        -------
        list of Estimate
            Of the steps that could be done now.

        Raises
        ------
        UsageError
            No such stream, or rows of one stream out of order.
        DataError
            Other values than the columns, or what `Session` refuses.
        """
        if stream not in self._raw:
            raise UsageError(f"no stream {stream!r}", hint=f"the session has: {', '.join(self._raw)}")
        row = Row(stream, time, _values(stream, values, self._raw[stream].columns))
        self._pass(0, [row])
        return self._released(last=False)

    def finish(self) -> list[Estimate]:
        """No more rows come: what waited for them is done."""
        for i, online in enumerate(self._chain):
            self._pass(i + 1, online.finish())
        return self._released(last=True)

    def _pass(self, first: int, rows: Sequence[Row]) -> None:
        """Rows through the components from ``first`` on; what comes out is held."""
        for online in self._chain[first:]:
            rows = [made for row in rows for made in online.push(row)]
        for row in rows:
            if row.stream in self._newest:
                self._held.append(row)
                self._newest[row.stream] = row.time

    def _released(self, *, last: bool) -> list[Estimate]:
        """Hand over what nothing earlier can come before, in the order of time, the driving stream last."""
        if self._inner is None and not last and not self._can_start():
            return []
        self._all = list(self._held) if self._inner is None else []
        ready = [row for row in self._held if last or self._is_due(row)]
        self._held = [row for row in self._held if not (last or self._is_due(row))]
        ready.sort(key=lambda row: (row.time, row.stream == self._driver))
        first = next((row for row in ready if self._driver in (None, row.stream)), None)
        if self._inner is None and first is None:
            self._held = [*ready, *self._held]
            return []
        if not ready:
            return []
        session, done = self._inner or self._begun(first or ready[0]), list[Estimate | None]()
        for row in ready:
            self._measure(session, row)
            if row.stream == self._driver and self._is_after_start(session, row):
                columns, own = self._problem.provider.columns, self._layouts[row.stream].columns
                done.append(session.push(row.time, [row.values[own.index(c)] for c in columns]))
        if self._driver is None:
            done.append(session.advance(ready[-1].time))
        return [estimate for estimate in done if estimate is not None]

    def _is_due(self, row: Row) -> bool:
        newest = max(self._newest.values())
        if self._driver is None and not row.time < newest - SAME:
            return False
        return all(
            known >= row.time - SAME or newest - row.time >= self._waits[name] - SAME
            for name, known in self._newest.items()
            if name != row.stream
        )

    def _measure(self, session: Session, row: Row) -> None:
        if row.stream in self._read and session.estimate is None and row.time < session.time - SAME:
            session.events.append(Event(row.time, row.stream, "before start", "rows before the start are not used"))
        elif row.stream in self._read:
            own = self._layouts[row.stream].columns
            session.measure(
                row.stream, row.time, [row.values[own.index(c)] for c in dict.fromkeys(self._read[row.stream])]
            )

    def _begun(self, first: Row) -> Session:
        """The filter, where the first row of the driving stream begins (without one: at the first row), or at the found start."""
        start, record = self._start, None
        if self._start_from is not None:
            record = self._first_rows()
            if start is None and self._problem.initial is not None:
                start = self._problem.initial.find(record)
        begin = first.time - (self._layouts[first.stream].period if first.stream == self._driver else 0.0)
        found = start.time if start is not None else None
        time = next(t for t in (self._time, found, begin) if t is not None)
        periods = {name: known.period for name, known in self._layouts.items()}
        self._inner = Session(self._problem, start, time, periods, record)
        return self._inner

    def _can_start(self) -> bool:
        """Whether enough of the driving stream waits for the start to be found from it."""
        if self._start_from is None:
            return True
        own = [row.time for row in self._held if row.stream == self._driver]
        return bool(own) and own[-1] - own[0] >= self._start_from - SAME

    def _first_rows(self) -> Record:
        """All rows that wait, as a record."""
        streams = {}
        for name in self._newest:
            layout, own = self._layouts[name], [row for row in self._all if row.stream == name]
            values = np.array([row.values for row in own]).reshape(len(own), len(layout.columns))
            time = np.array([row.time for row in own])
            streams[name] = Stream(name, time, values, layout.columns, layout.kind, layout.period)
        return Record(streams)

    def _is_after_start(self, session: Session, row: Row) -> bool:
        """Rows at or before a found start are not used, as in a batch run."""
        return session.estimate is not None or row.time > session.time + 0.5 * self._layouts[row.stream].period


def _layout(stream: Stream) -> Layout:
    if stream.period is None:
        raise UsageError(
            f"stream {stream.name!r} says no period", hint="a session cannot tell it from stamps that are not there yet"
        )
    return Layout(stream.columns, stream.kind, stream.period)


def _values(stream: str, values: ArrayLike | Mapping[str, float], columns: tuple[str, ...]) -> FloatArray:
    if isinstance(values, Mapping):
        if set(values) != set(columns):
            raise DataError(
                f"stream {stream!r}: got the columns {', '.join(values)}", hint=f"due are: {', '.join(columns)}"
            )
        values = [values[c] for c in columns]
    row = np.atleast_1d(np.asarray(values, dtype=float))
    if row.shape != (len(columns),):
        raise DataError(f"stream {stream!r}: {row.size} values where {len(columns)} are due", hint=", ".join(columns))
    return row
