"""A late odometer shows against the accelerometers of a drive over hills, and one in time raises no alarm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from estimfw.config.compose import Problem
from estimfw.run.load import source_record
from estimfw.run.preprocess import preprocessed

WATCH = "preprocess.watch={kind: lag_check, stream: imu, column: speed, against: dvel_y}"


@pytest.mark.parametrize("late", [0.0, 0.6, -0.6])
def test_a_clock_that_nobody_set_is_told_with_its_cure(opened: Callable[..., Problem], late: float) -> None:
    problem = opened("odometer_aeba.yaml", WATCH)
    record = source_record(problem)
    wheel = record.streams["odometer"]
    shifted = replace(record, streams={**record.streams, "odometer": replace(wheel, time=wheel.time + late)})
    told = [event.text for event in preprocessed(problem, shifted).events if event.kind == "lag"]
    assert len(told) == (1 if late else 0)
    for text in told:
        assert float(text.rpartition("latency: ")[2].split()[0]) == pytest.approx(late, abs=0.15)
