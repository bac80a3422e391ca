"""What a run collects along its record: a piece for each chunk after the filter, and all of them as arrays over the steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event
from estimfw.estimators.bank import Judged
from estimfw.estimators.scan import ChunkResult
from estimfw.run.exchanged import answered, silence_events
from estimfw.run.flags import disposition_events, lost_members, with_late
from estimfw.run.health import health_events
from estimfw.run.honest import Honest
from estimfw.run.outages import outage_events
from estimfw.run.outputs import output_truth, output_values, state_truth, truth_at, truth_events, wrapped
from estimfw.run.prepare import Prepared
from estimfw.run.recorded import AsRecorded, as_recorded
from estimfw.run.smoothing import Smoothed

__all__ = ["Collected", "Piece", "Timing", "collected", "piece"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Timing:
    """Wall times in s: reading (or simulating) the record, preparing, provider and filter together, and the smoother."""

    load: float
    prepare: float
    filter: float
    smooth: float = 0.0


@dataclass(frozen=True)
class Collected:
    """Everything along the run, as arrays over the steps; `estimfw.run.dataset` labels it."""

    prepared: Prepared
    estimate: FloatArray
    sigma: FloatArray
    covariance_index: NDArray[np.int64]
    covariance: FloatArray
    innovation: FloatArray
    innovation_sigma: FloatArray
    nis: FloatArray
    disposition: NDArray[np.int64]
    used: NDArray[np.int64]
    output: FloatArray
    output_sigma: FloatArray
    truth: FloatArray | None
    output_truth: FloatArray | None
    output_error: FloatArray | None
    events: tuple[Event, ...]
    timing: Timing
    honest: Honest | None = None
    bank: Judged | None = None
    smoothed: Smoothed | None = None
    recorded: AsRecorded | None = None

    @property
    def smoothed_output_error(self) -> FloatArray | None:
        """Smoothed outputs minus truth; None where one of them is not known."""
        if self.smoothed is None or self.output_truth is None:
            return None
        return _output_error(self.prepared, self.smoothed.output, self.output_truth)

    @property
    def final(self) -> Prepared:
        """The filter that is reported at the end."""
        return self.prepared.members[int(self.bank.best[-1]) if self.bank is not None else 0]


@dataclass(frozen=True, slots=True)
class Piece:
    """One chunk after the filter: what is kept of it. ``result`` is without its covariances and rows, which fill the memory.

    ``score`` (K, members) and ``best`` (K,) are those of a bank; of a plain filter zero.
    """

    result: ChunkResult
    score: FloatArray
    best: NDArray[np.int64]
    sigma: FloatArray
    output: FloatArray
    output_sigma: FloatArray
    truth: FloatArray | None
    output_truth: FloatArray | None
    covariance: FloatArray


def piece(
    prepared: Prepared, result: ChunkResult, judged: Judged, first: int, last: int, wanted: NDArray[np.int64]
) -> Piece:
    """What is kept of steps ``first`` up to (not including) ``last``; the whole covariance at steps ``wanted``."""
    problem = prepared.problem
    rows = problem.plan.layout.complete(result.rows)
    values = [output_values(problem, o, j, result, rows) for o, j in problem.plan.outputs]
    empty = np.zeros((last - first, 0))
    truth = truth_at(prepared.record.truth, prepared.steps.time[first:last])
    true_outputs = None
    if truth is not None:
        parts = [output_truth(o, truth, last - first) for o, _ in problem.plan.outputs]
        true_outputs = np.concatenate(parts, axis=1) if parts else empty
    inside = wanted[(wanted >= first) & (wanted < last)] - first
    return Piece(
        result=replace(
            result, covariance=np.zeros((0, 0, 0)), rows=np.zeros((0, 0)), provider=np.zeros((0, 0)), moves=None
        ),
        score=judged.score,
        best=judged.best,
        sigma=np.sqrt(np.maximum(np.einsum("kii->ki", result.covariance), 0.0)),
        output=np.concatenate([v for v, _ in values], axis=1) if values else empty,
        output_sigma=np.concatenate([s for _, s in values], axis=1) if values else empty,
        truth=state_truth(problem, rows, truth) if truth is not None else None,
        output_truth=true_outputs,
        covariance=result.covariance[inside],
    )


def collected(
    prepared: Prepared, pieces: Sequence[Piece], wanted: NDArray[np.int64], timing: Timing, recovered: tuple[Event, ...]
) -> Collected:
    """All pieces of a run, in order; ``recovered`` is what was done about its health."""

    def joined(name: str) -> FloatArray:
        return np.concatenate([getattr(p.result, name) for p in pieces])

    def kept(name: str) -> FloatArray:
        return np.concatenate([getattr(p, name) for p in pieces])

    known = pieces[0].truth is not None
    output, output_truth = kept("output"), kept("output_truth") if known else None
    error = _output_error(prepared, output, output_truth) if output_truth is not None else None
    disposition, used = with_late(prepared, joined("disposition").astype(np.int64)), joined("used").astype(np.int64)
    bank = Judged(kept("score"), kept("best").astype(np.int64)) if prepared.problem.kind == "bank" else None
    return Collected(
        prepared=prepared,
        estimate=joined("estimate"),
        sigma=kept("sigma"),
        covariance_index=wanted,
        covariance=kept("covariance"),
        innovation=joined("innovation"),
        innovation_sigma=joined("sigma"),
        nis=joined("nis"),
        disposition=disposition,
        used=used,
        output=output,
        output_sigma=kept("output_sigma"),
        truth=kept("truth") if known else None,
        output_truth=output_truth,
        output_error=error,
        events=(
            *prepared.events,
            *truth_events(prepared.record.truth, prepared.steps.time),
            *silence_events(prepared),
            *disposition_events(prepared, answered(prepared, disposition), used, joined("nis")),
            *outage_events(prepared, disposition),
            *health_events(prepared.problem, prepared.steps.time, disposition, joined("nis"), joined("innovation")),
            *recovered,
            *(lost_members(prepared, bank.score) if bank is not None else ()),
        ),
        timing=timing,
        bank=bank,
        recorded=as_recorded(prepared),
    )


def _output_error(prepared: Prepared, output: FloatArray, truth: FloatArray) -> FloatArray:
    periods = [o.period for o, _ in prepared.plan.outputs for _ in o.components]
    columns = [wrapped(output[:, i] - truth[:, i], p) for i, p in enumerate(periods)]
    return np.stack(columns, axis=1) if columns else np.zeros_like(output)
