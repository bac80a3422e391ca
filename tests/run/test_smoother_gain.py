"""What a smoother gained, in a few numbers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.report.smoother import smoother_table
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem
from estimfw.run.smoother_gain import gains, smoother_json, smoother_text

Example = Callable[..., Problem]


def test_gains_are_root_mean_squares_over_the_run(example: Example) -> None:
    run = run_problem(example("tracker_smoothed", "source.duration=20 s"))
    assert run.smoothed is not None and run.truth is not None
    result = result_dataset(run)
    found = {one.label: one for one in gains(result)}
    assert list(found) == list(run.prepared.plan.states)
    one = found["position[y]"]
    assert one.smoothed_error == pytest.approx(
        float(np.sqrt(np.mean((run.smoothed.estimate[:, 1] - run.truth[:, 1]) ** 2)))
    )
    assert one.sigma == pytest.approx(float(np.sqrt(np.mean(run.sigma[:, 1] ** 2))))
    assert one.smoothed_sigma < one.sigma
    told = smoother_json(result)
    assert told is not None and told["kind"] == "fixed_interval" and len(told["over_the_run"]) == 4
    assert smoother_text(result).startswith("fixed interval")
    assert len(smoother_table(result).rows) == 4


def test_a_filter_alone_has_gained_nothing(example: Example) -> None:
    result = result_dataset(run_problem(example("tracker", "source.duration=5 s")))
    assert gains(result) == () and smoother_json(result) is None and smoother_text(result) == ""
    assert smoother_table(result).rows == ()


def test_outputs_come_first_and_a_lag_is_told(example: Example) -> None:
    result = result_dataset(
        run_problem(example("static_7", "source.duration=20 s", "estimator.smoother={kind: fixed_lag, lag: 5 s}"))
    )
    labels = [one.label for one in gains(result)]
    assert labels[0].startswith("attitude.") and labels[-1].startswith("gyro_bias")
    assert "data up to 5 s after" in smoother_text(result)
    assert "own model" in smoother_table(result).note


@pytest.mark.parametrize(("lag", "whole"), [("1e9 s", True), ("19.8 s", True), ("19 s", False)])
def test_a_lag_no_shorter_than_the_record_is_told_to_be_the_fixed_interval(
    example: Example, lag: str, whole: bool
) -> None:
    found = [
        result_dataset(run_problem(example("tracker", "source.duration=20 s", f"estimator.smoother={smoother}")))
        for smoother in (f"{{kind: fixed_lag, lag: {lag}}}", "{kind: fixed_interval}")
    ]
    time = found[0]["time"].to_numpy()
    assert time[-1] - time[0] == pytest.approx(19.8)
    difference = np.abs(found[0]["smoothed_sigma"].to_numpy() / found[1]["smoothed_sigma"].to_numpy() - 1.0)
    assert (float(difference.max()) < 1e-9) is whole
    assert ("so that it is the fixed interval" in smoother_text(found[0])) is whole
    assert ("fixed interval" in smoother_table(found[0]).note) is whole
