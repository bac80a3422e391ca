"""A result cut after an instant: as if the run had ended there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from estimfw.data.record import SAME, Event
from estimfw.errors import UsageError
from estimfw.run.event_columns import event_columns
from estimfw.run.flags import measurement_flags
from estimfw.run.plausibility import IMPLAUSIBLE, implausible_events
from estimfw.run.result_names import measurement_attribute, measurement_names
from estimfw.run.summary import events_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["until"]


def until(dataset: xr.Dataset, at: float) -> xr.Dataset:
    """The result up to an instant (s): epochs, measurements, and events with the counts that they had then.

    Raises
    ------
    UsageError
        The instant lies before the first epoch or after the last.
    """
    time = dataset["time"].to_numpy()
    if not (time.size and time[0] - SAME <= at <= time[-1] + SAME):
        span = f"the run goes from {time[0]:.10g} to {time[-1]:.10g} s" if time.size else "the run has no epochs"
        raise UsageError(f"--at {at:.10g} s lies outside the run", hint=span)
    names = ["time", "covariance_time", *(f"{name}_time" for name in measurement_names(dataset))]
    kept = {name: np.flatnonzero(dataset[name].to_numpy() <= at + SAME) for name in names if name in dataset.coords}
    cut = dataset.isel(kept)
    if at < time[-1] - SAME:  # a smoother knew what came after
        cut = cut.drop_vars([name for name in cut.variables if str(name).startswith("smoothed")])
    events = (*_events_until(dataset, cut, at), *implausible_events(cut))
    cut = cut.drop_vars([name for name in cut.variables if str(name).startswith("event_")])
    return cut.assign(event_columns(events))


def _events_until(dataset: xr.Dataset, cut: xr.Dataset, at: float) -> list[Event]:
    """Those that began by then; what counts measurements is counted anew."""
    found: list[Event] = []
    counted = {(e.source, e.kind): e for name in measurement_names(cut) for e in _flags(cut, name)}
    of_measurements = set(measurement_names(cut))
    for event in events_of(dataset):
        if event.kind == IMPLAUSIBLE or event.time > at + SAME:
            continue
        found.append(counted.get((event.source, event.kind), event) if event.source in of_measurements else event)
    return found


def _flags(dataset: xr.Dataset, name: str) -> list[Event]:
    threshold = measurement_attribute(dataset, name, "threshold")
    limit = float(threshold) if isinstance(threshold, (int, float)) and np.isfinite(threshold) else None
    columns = (dataset[f"{name}_{part}"].to_numpy() for part in ("time", "disposition", "used", "nis"))
    return list(measurement_flags(name, int(dataset.sizes[f"{name}_row"]), limit, *columns))
