"""The segments of a run whose nominal changes at a few instants: Phi and Q are made once in each, equal ones share them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimfw.config.compose import Problem
from estimfw.model.nominal import changing_at
from estimfw.run.load import nominal_over_time

__all__ = ["Segment", "segments_of", "segments_text"]


@dataclass(frozen=True, slots=True)
class Segment:
    """From ``begin`` (s; None: the start) to the next one, with Phi and Q of number ``matrices``, from 0."""

    begin: float | None
    matrices: int


def segments_of(problem: Problem) -> tuple[Segment, ...]:
    """What is known before there is a record: one segment of a time-invariant plan, none where a stream moves the nominal."""
    plan, instants = problem.plan, changing_at(problem.provider)
    if plan.pace == "varying":
        return ()
    over_time = nominal_over_time(problem, plan.layout)
    if plan.pace == "constant" or over_time is None:
        return (Segment(None, 0),)
    begin = np.array([instants[0] - 1.0, *instants])
    rows, _ = over_time.between(begin, np.append(begin[1:], begin[-1] + 1.0))
    known: dict[bytes, int] = {}
    found = [known.setdefault(row[list(plan.watched)].tobytes(), len(known)) for row in rows]
    begins = (None, *instants)
    return tuple(Segment(begins[k], number) for k, number in enumerate(found) if k == 0 or number != found[k - 1])


def segments_text(segments: Sequence[Segment]) -> str:
    """Such as ``3 segments, 2 sets of matrices: a from the start, b from 300 s, a from 600 s``."""
    sets = len({one.matrices for one in segments})
    letters = [_letter(one.matrices) for one in segments]
    when = ["from the start" if one.begin is None else f"from {one.begin:.10g} s" for one in segments]
    told = ", ".join(f"{letter} {begin}" for letter, begin in zip(letters, when, strict=True))
    return f"{len(segments)} segments, {sets} sets of matrices: {told}"


def _letter(number: int) -> str:
    return chr(ord("a") + number) if number < 26 else f"a{number}"
