"""What became of measurements that were not fused whole, as counted events: one for each measurement and kind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.kernels.fuse import FUSED, GATED, INVALID, MISSING
from estimfw.plan.plan import MeasurementPlan
from estimfw.run.prepare import Prepared

__all__ = ["disposition_events"]

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
        for kind, which, text in _kinds(prepared, m, disposition[:, j], used[:, j], nis[:, j]):
            if which.any() and not (kind == "missing" and m.stream in told):
                first = float(prepared.steps.time[int(np.argmax(which))])
                events.append(Event(first, m.name, kind, text, int(which.sum())))
    return tuple(events)


def _kinds(
    prepared: Prepared, m: MeasurementPlan, disposition: IntArray, used: IntArray, nis: FloatArray
) -> Iterator[tuple[str, NDArray[np.bool_], str]]:
    gated = disposition == GATED
    threshold = prepared.plan.thresholds(m)
    if threshold is not None:
        largest = float(np.max(nis[gated], initial=0.0))
        yield "gated", gated, f"NIS up to {largest:.4g} beyond the gate of {threshold[-1]:.4g}; not fused"
    yield "invalid", disposition == INVALID, "the innovation covariance S is singular or not positive; not fused"
    incomplete = (disposition == MISSING) | ((disposition == FUSED) & (used < m.rows))
    yield "missing", incomplete, "components that are not finite are skipped, the rest is fused"
