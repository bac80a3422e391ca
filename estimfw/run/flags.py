"""What became of measurements that were not fused whole, as counted events: one for each measurement and kind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.kernels.fuse import FUSED, GATED, INVALID, LATE, MISSING
from estimfw.run.prepare import Prepared

__all__ = ["disposition_events", "lost_members", "measurement_flags", "with_late"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def disposition_events(prepared: Prepared, disposition: IntArray, used: IntArray, nis: FloatArray) -> tuple[Event, ...]:
    """Events for gated, invalid and incomplete measurements.

    Parameters
    ----------
    prepared : Prepared
    disposition, used, nis : (steps, measurements) array
        Disposition (-1: none was due), components fused, NIS.
    """
    told = {e.source for e in prepared.events if e.kind == "missing"}
    events: list[Event] = []
    for j, m in enumerate(prepared.plan.measurements):
        gate = prepared.plan.thresholds(m)
        threshold = None if gate is None else float(gate[-1])
        flags = measurement_flags(
            m.name, m.rows, threshold, prepared.steps.time, disposition[:, j], used[:, j], nis[:, j]
        )
        events += [flag for flag in flags if not (flag.kind == "missing" and m.stream in told)]
    return tuple(events)


def with_late(prepared: Prepared, disposition: IntArray) -> IntArray:
    """Dispositions (steps, measurements) that also say where a row came too late; the recursion knows nothing of it."""
    for j, m in enumerate(prepared.plan.measurements):
        late = prepared.steps.due[m.name].late
        if late is not None:
            disposition[late & (disposition[:, j] < 0), j] = LATE
    return disposition


def lost_members(prepared: Prepared, score: FloatArray) -> Iterator[Event]:
    """Members of a bank whose numbers were lost, and from when; J is (steps, members)."""
    for one, own in zip(prepared.members, np.isinf(score).T, strict=True):
        if own.any():
            at = float(prepared.steps.time[int(np.argmax(own))])
            yield Event(at, "bank", "lost member", f"{one.label}: its numbers left what a filter can have; it is out")


def measurement_flags(
    name: str,
    rows: int,
    threshold: float | None,
    time: FloatArray,
    disposition: IntArray,
    used: IntArray,
    nis: FloatArray,
) -> Iterator[Event]:
    """The events of one measurement: arrays over its epochs (K,); ``threshold`` is the largest NIS that is fused."""
    for kind, which, text in _kinds(rows, threshold, disposition, used, nis):
        if which.any():
            yield Event(float(time[int(np.argmax(which))]), name, kind, text, int(which.sum()))


def _kinds(
    rows: int, threshold: float | None, disposition: IntArray, used: IntArray, nis: FloatArray
) -> Iterator[tuple[str, NDArray[np.bool_], str]]:
    gated = disposition == GATED
    if threshold is not None:
        largest = float(np.max(nis[gated], initial=0.0))
        yield "gated", gated, f"NIS up to {largest:.4g} beyond the gate of {threshold:.4g}; not fused"
    yield "invalid", disposition == INVALID, "the innovation covariance S is singular or not positive; not fused"
    incomplete = (disposition == MISSING) | ((disposition == FUSED) & (used < rows))
    yield "missing", incomplete, "components that are not finite are skipped, the rest is fused"
