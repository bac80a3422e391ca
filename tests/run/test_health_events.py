"""What a run tells of a measurement whose NIS leaves its bounds, where it has no row at every step."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem
from estimfw.run.summary import events_of

TEXT = """estimfw: 1
blocks: {bias: {kind: random_constant, unit: m, sigma: 1 m}}
measurements:
  often: {kind: direct, of: [{block: bias}], noise: 0.1 m}
  seldom: {kind: direct, of: [{block: bias}], noise: 0.1 m}
health: {divergence: {epochs: 20}}
"""


@pytest.mark.parametrize(("factor", "kind", "extreme"), [(3.0, "divergence", np.max), (0.2, "too cautious", np.min)])
def test_the_mean_nis_is_told_of_a_measurement_that_is_not_due_at_every_step(
    composed: Callable[[str], Problem], factor: float, kind: str, extreme: Callable[[np.ndarray], float]
) -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.1, 500)
    time = np.arange(1.0, 501.0)
    streams = {
        "often": Stream("often", time, noise[:, None], ("often",), "sample", 1.0),
        "seldom": Stream("seldom", time[4::5], factor * noise[4::5, None], ("seldom",), "sample", 5.0),
    }
    result = result_dataset(run_problem(composed(TEXT), record=Record(streams, initial={"time": np.array(0.0)})))
    (event,) = [e for e in events_of(result) if e.source == "seldom" and e.kind == kind]
    found = re.search(r"is (\S+) times what is expected, out of its bounds from (\S+) s to the end", event.text)
    assert found is not None, event.text
    nis = result["seldom_nis"].to_numpy()
    windowed = np.convolve(nis[np.isfinite(nis)], np.ones(20) / 20.0, "valid")
    assert float(found[1]) == pytest.approx(float(extreme(windowed)), rel=0.01)
    assert event.count == windowed.size, "epochs of the measurement, not steps of the run"
