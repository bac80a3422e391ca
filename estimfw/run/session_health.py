"""The health of a session, told as it changes; see `estimfw.run.health` for that of a whole run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from estimfw.analysis.health import CAUTIOUS, DEGRADED, DIVERGED, NisJudge, NisJudged
from estimfw.config.compose import Problem
from estimfw.data.record import Event, FloatArray
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import FUSED, GATED
from estimfw.run.health import Judges, degrees, judges_of, unless_rejected

__all__ = ["Watched"]

Sick = frozenset[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Watched:
    """Judges after the steps so far, and which measurement is in which unhealthy state."""

    judges: tuple[Judges, ...]
    sick: Sick = frozenset()

    @classmethod
    def of(cls, problem: Problem) -> Watched:
        """Before the first step."""
        return cls(judges_of(problem))

    def after(self, problem: Problem, time: float, result: ChunkResult) -> tuple[Watched, list[Event]]:
        """After one more step, with the events of what began in it."""
        if all(one.rejection is None and one.nis is None for one in self.judges):
            return self, []
        freedom, now = degrees(problem.plan, result.innovation), np.array([time])
        made, sick, events = list[Judges](), set(self.sick), list[Event]()
        for j, (m, one) in enumerate(zip(problem.plan.measurements, self.judges, strict=True)):
            rejection, nis, seen = one.rejection, one.nis, result.nis[:, j]
            disposition = result.disposition[0, j]
            if rejection is not None and (disposition == GATED or (disposition == FUSED and rejection.count)):
                rejection, bad, since = rejection.advance(now, result.disposition[:, j])
                seen = unless_rejected(seen, bad)
                if _began(sick, (m.name, DEGRADED), bool(bad[0])):
                    text = f"rejected each of the {rejection.count} times it was due since {float(since[0]):.10g} s"
                    events.append(Event(float(since[0]), m.name, DEGRADED, text, rejection.count))
            if nis is not None:
                nis, judged = nis.advance(now, seen, freedom[:, j])
                events += list(_out_of_bounds(sick, m.name, nis, judged))
            made.append(Judges(rejection, nis))
        return Watched(tuple(made), frozenset(sick)), events


def _began(sick: set[tuple[str, str]], state: tuple[str, str], now: bool) -> bool:
    """Whether a state is new; ``sick`` is kept up."""
    before = state in sick
    (sick.add if now else sick.discard)(state)
    return now and not before


def _out_of_bounds(sick: set[tuple[str, str]], name: str, judge: NisJudge, found: NisJudged) -> Iterator[Event]:
    if not np.isfinite(found.ratio[0]):
        return
    kinds: tuple[tuple[str, bool, FloatArray], ...] = (
        (DIVERGED, bool(found.high[0]), found.high_since),
        (CAUTIOUS, bool(found.low[0]), found.low_since),
    )
    for kind, now, since in kinds:
        if _began(sick, (name, kind), now):
            text = (
                f"the mean NIS of {judge.limit.epochs} epochs is {float(found.ratio[0]):.3g} times what is expected, out of its "
                f"bounds since {float(since[0]):.10g} s"
            )
            yield Event(float(since[0]), name, kind, text)
