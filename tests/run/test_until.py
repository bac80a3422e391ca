"""A result that is cut after an instant is the result of a run that ended there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import UsageError
from estimfw.run.answer import answer
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem
from estimfw.run.until import until
from estimfw.run.values_file import values_csv

FILTER = """estimfw: 1
blocks: {p: {kind: random_walk, unit: m, display_unit: km, axes: [x, y], sigma: 2 m, noise: 0.1 m/sqrt(s)}}
measurements: {fix: {kind: direct, of: [{block: p}], noise: 1 m}}
estimator: {kind: kalman, gate: 0.999}
"""
ROWS = 60


def result_of(problem: Problem, count: int) -> Any:
    """Every tenth row an outlier from row 5 on, every seventh incomplete."""
    rows = np.random.default_rng(4).normal(0.0, 1.0, (ROWS, 2))
    rows[4::10, 1] = 60.0 + np.arange(6)
    rows[2::7, 0] = np.nan
    stream = Stream("fix", np.arange(1.0, count + 1), rows[:count], ("x", "y"), "sample", 1.0)
    return result_dataset(run_problem(problem, record=Record({"fix": stream}, initial={"time": np.array(0.0)})))


@pytest.mark.parametrize("end", [1, 3, 24, 47, ROWS])
def test_the_answer_of_the_cut_is_that_of_the_shorter_run(composed: Callable[[str], Problem], end: int) -> None:
    whole, short = result_of(composed(FILTER), ROWS), result_of(composed(FILTER), end)
    cut = until(whole, min(end + 0.4, ROWS))
    assert answer(cut) == answer(short)
    assert values_csv(cut) == values_csv(short)


@pytest.mark.parametrize("at", [0.5, ROWS + 0.5, float("nan")])
def test_an_instant_before_the_first_epoch_or_after_the_last_is_refused(
    composed: Callable[[str], Problem], at: float
) -> None:
    with pytest.raises(UsageError, match="outside the run") as told:
        until(result_of(composed(FILTER), ROWS), at)
    assert told.value.hint == "the run goes from 1 to 60 s"


def test_without_outputs_the_states_are_the_table_in_their_display_units(composed: Callable[[str], Problem]) -> None:
    result = result_of(composed(FILTER), 10)
    head, first, *_ = values_csv(result).splitlines()
    assert head == "time [s],p[x] [km],p[x] sigma [km],p[y] [km],p[y] sigma [km]"
    np.testing.assert_allclose(float(first.split(",")[1]) * 1000.0, float(result["estimate"][0, 0]), rtol=1e-10)
    np.testing.assert_allclose(float(first.split(",")[2]) * 1000.0, float(result["sigma"][0, 0]), rtol=1e-10)
