"""Outages: stretches of a run without a usable reading of a measurement, however that came about.

Rows that are not there, that are not finite, that preprocessing left out (stuck, clipped, jumped) or that came too late are alike
to a filter: it coasts, and its sigmas grow until there is a reading again.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.kernels.fuse import FUSED, GATED, INVALID
from estimfw.plan.stages import measured_steps
from estimfw.run.prepare import Prepared

__all__ = ["OUTAGE", "outage_events"]

OUTAGE = "outage"
"""Kind of the event."""

LONGEST = 10.0
"""So many of the stream's intervals are a gap; more are an outage."""

MOST = 50
"""Of one measurement, that are told one by one: the longest ones."""


def outage_events(prepared: Prepared, disposition: NDArray[np.int64]) -> Iterator[Event]:
    """One event for each outage; ``disposition`` is (K, measurements), -1 where none was due.

    At the begin of the run and at its end too. Pseudo-measurements have none; nor has what a stage does not measure.
    """
    steps, stages = prepared.steps, prepared.plan.stages
    unmeasured = ~measured_steps(stages, steps.begin) if stages else np.zeros(disposition.shape, dtype=bool)
    for j, m in enumerate(prepared.plan.measurements):
        if m.stream is None or not len(steps):
            continue
        usable = np.isin(disposition[:, j], (FUSED, GATED, INVALID)) | unmeasured[:, j]
        known = np.concatenate([[steps.start], steps.time[usable], [steps.time[-1]]])
        length = np.diff(known)
        long = np.flatnonzero(length > LONGEST * float(np.median(steps.due[m.name].interval)))
        told = np.sort(long[np.argsort(-length[long], kind="stable")[:MOST]])
        for k in told.tolist():
            end = "to the end" if k == length.size - 1 else f"to {known[k + 1]:.10g} s"
            text = f"no usable reading from {known[k]:.10g} s {end}, for {length[k]:.6g} s: the filter coasts"
            yield Event(float(known[k]), m.name, OUTAGE, text)
        if long.size > told.size:
            text = f"{long.size - told.size} more, none longer than {np.min(length[told]):.6g} s"
            yield Event(float(known[long[0]]), m.name, OUTAGE, text, int(long.size - told.size))
