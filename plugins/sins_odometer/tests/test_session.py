"""In-motion alignment as it drives: raw IMU and pulses in, the estimates of a batch run out, two seconds later."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import estimfw
from estimfw.run.load import source_record
from estimfw.run.preprocess import preprocessed
from estimfw.run.run import run_problem

EXAMPLE = Path(__file__).parents[3] / "examples" / "odometer_aeba.yaml"


def test_a_session_on_raw_rows_finds_its_start_and_equals_the_batch_run() -> None:
    problem = estimfw.open_filter(EXAMPLE, ["source.duration=14 s"])
    record = source_record(problem)
    batch = run_problem(problem, record=preprocessed(problem, record))
    session = estimfw.PreprocessingSession(problem, record.streams, start_from=1.0)
    rows = [
        (float(t), s.name == "imu", s.name, s.values[k]) for s in record.streams.values() for k, t in enumerate(s.time)
    ]
    done, late = [], []
    for time, _, name, values in sorted(rows, key=lambda row: row[:2]):
        made = session.feed(name, time, values)
        done += made
        late += [time - e.time for e in made]
    done += session.finish()
    assert [e.time for e in done] == pytest.approx(batch.prepared.steps.time)
    states = np.array([[value for value, _ in e.states.values()] for e in done])
    sigmas = np.array([[sigma for _, sigma in e.states.values()] for e in done])
    assert states == pytest.approx(batch.estimate, rel=1e-9, abs=1e-14)
    assert sigmas == pytest.approx(batch.sigma, rel=1e-9)
    # Half of the 4 s of the filter, and the count that the counter waits for.
    assert max(late) <= session.latency == pytest.approx(2.0, abs=0.05)
