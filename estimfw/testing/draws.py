"""A source that takes part in a Monte Carlo: runs are made by their seeds alone, and differ."""

from __future__ import annotations

import numpy as np

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.montecarlo.draw import draw_runs, refuse_without_draws

__all__ = ["check_draws"]


def check_draws(problem: Problem, runs: int = 3) -> None:
    """Draw some runs twice, and the last one alone.

    Parameters
    ----------
    problem : Problem
        With a source that has ``drawn_many`` or ``drawn_many_for``; see `estimfw.montecarlo.draw`.
    runs : int, > 1

    Raises
    ------
    AssertionError
        A run is not the same again, or not the same alone, or two runs are alike, or an instant of the truth is missing.
    ConfigError
        The source draws nothing.
    """
    refuse_without_draws(problem)
    once, again, alone = (draw_runs(problem, 1, which) for which in (range(runs), range(runs), [runs - 1]))
    last = once.run(runs - 1)
    assert not _differing(last, again.run(runs - 1)), (
        "the same seeds draw another run: it depends on more than its seed"
    )
    other = _differing(last, alone.run(0))
    assert not other, f"a run draws another {other} when it is drawn alone: it depends on the runs beside it"
    assert _differing(once.run(0), once.run(1)), "two runs of different seeds are alike: the seeds are not used"
    for name, value in (once.truth or {}).items():
        instants = (1, once.time.size)
        assert value.shape[0] in (1, runs), f"truth {name!r} has {value.shape[0]} runs, {runs} are due (or 1)"
        assert value.shape[1] in instants, (
            f"truth {name!r} has {value.shape[1]} instants, {once.time.size} are due (or 1)"
        )


def _differing(one: Record, other: Record) -> str:
    """The stream or start value in which two records differ; empty if none."""
    for name, stream in one.streams.items():
        if not np.array_equal(stream.values, other.streams[name].values, equal_nan=True):
            return f"stream {name!r}"
    for name, value in one.initial.items():
        if not np.array_equal(value, other.initial[name]):
            return f"start {name!r}"
    return ""
