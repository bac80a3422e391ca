"""The record of a config: what its source makes, joined by the streams of its aiding sensors, and preprocessed."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, PluginError
from estimfw.model.nominal import ScheduledProvider, changing_at
from estimfw.plan.layout import NominalLayout
from estimfw.plan.over_time import RowsOverTime
from estimfw.plan.plan import Plan
from estimfw.registry.contract import plugin_code
from estimfw.run.guard import check_record
from estimfw.run.preprocess import preprocessed

__all__ = ["along_schedule", "load_record", "nominal_over_time", "simulated", "source_record"]

FloatArray = NDArray[np.float64]


def load_record(problem: Problem) -> Record:
    """The record to run on: that of the sources, preprocessed.

    Raises
    ------
    EstimfwError
        See `source_record` and `estimfw.run.preprocess`.
    """
    return preprocessed(problem, source_record(problem))


def source_record(problem: Problem) -> Record:
    """The record as the sources make it.

    Truth and start are those of ``source``; ``aiding`` adds streams and events.

    Raises
    ------
    ConfigError
        There is no source, or two of them bring one stream.
    DataError
        A source cannot be read.
    """
    if problem.source is None:
        raise ConfigError(
            "there is nothing to run on: the config has no source",
            location=problem.document.locate(()),
            hint="add a source: {kind: log, streams: {fix: {file: fix.csv}}} reads a file for each measurement, "
            "{kind: simulate_model, duration: 60 s, rate: 1 Hz} makes what the model says, "
            "{kind: inertial.imu_log, file: my.imu} reads an IMU log",
        )
    record = _loaded(problem.source, problem, ("source",))
    for name, source in problem.aiding.items():
        record = _joined(record, name, _loaded(source, problem, ("aiding", name)), problem)
    return record


def _loaded(source: Any, problem: Problem, path: tuple[str, ...]) -> Record:
    """The record of one source, which stands at ``path``; one that has to know the plan gets to see it."""
    source = along_schedule(source, problem)
    owner, what = problem.owners.get(".".join(path)), "source" if len(path) == 1 else f"source {'.'.join(path)!r}"
    try:
        with plugin_code(owner, f"load() of {what}"), threadpool_limits(1, user_api="blas"):  # its matrices are small
            if hasattr(source, "load_wanted"):
                made = source.load_wanted(problem.wanted)
            elif hasattr(source, "load_for"):
                made = source.load_for(*_seen_by(source, problem))
            else:
                made = source.load()
        return check_record(made, owner, what)
    except (ConfigError, PluginError) as error:
        problem.document.placed(error, path)
        raise


def _seen_by(source: Any, problem: Problem) -> tuple[Plan, FloatArray]:
    """The filter's plan and its complete nominal row; of one that simulates the plan, see `simulated`."""
    if hasattr(source, "drawn_many_for"):
        return simulated(problem)
    return problem.plan, problem.plan.layout.complete(problem.plan.layout.pack(problem.reference))


def simulated(problem: Problem) -> tuple[Plan, FloatArray]:
    """What a source simulates that knows the model: the plan, and its complete nominal row.

    It is the model before policies: a reduced filter meets what it leaves out, and all filters on it the same record.
    """
    plan = problem.plan.whole if problem.truth is None else problem.truth.plan.plan
    return plan, plan.layout.complete(plan.layout.pack(problem.reference))


def along_schedule(source: Any, problem: Problem) -> Any:
    """A source that simulates the model (it has ``along``), told what the nominal is over time; others as they are."""
    schedule = nominal_over_time(problem, simulated(problem)[0].layout) if hasattr(source, "along") else None
    return source if schedule is None else source.along(schedule)


def nominal_over_time(problem: Problem, layout: NominalLayout) -> RowsOverTime | None:
    """Rows of a plan's layout over time; None where nothing moves the nominal, or a stream does."""
    bound = problem.provider.bind(problem.settings) if problem.provider.stream is None else None
    if bound is None or bound.n_state:
        return None
    return RowsOverTime(changing_at(problem.provider), cast(ScheduledProvider, bound), layout)


def _joined(record: Record, name: str, added: Record, problem: Problem) -> Record:
    streams: dict[str, Stream] = dict(record.streams)
    for key, stream in added.streams.items():
        if key in streams:
            raise ConfigError(
                f"aiding.{name} brings the stream {key!r}, which another source brings already",
                location=problem.document.locate(("aiding", name)),
                hint=f"streams so far: {', '.join(streams)}",
            )
        streams[key] = stream
    attributes = {**record.attributes, f"aiding.{name}": dict(added.attributes)}
    return Record(streams, record.truth, (*record.events, *added.events), record.initial, attributes)
