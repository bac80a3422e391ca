"""A session fed by hand gives what the run over the record gives, closed loop and a heading included."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from estimfw.config.compose import Problem
from estimfw.model.nominal import InitialNominal
from estimfw.run.session import Session

Open = Callable[..., Problem]
Run = Callable[..., Any]


def test_a_session_does_as_the_run(opened: Open, done: Run) -> None:
    settings = ("source.duration=200 s", "estimator.kernel=numpy", "source.course=2 deg")
    whole = done("ins_const11_heading", *settings).run
    streams = whole.prepared.record.streams
    ins = streams["ins"]
    first = ins.values[0]
    start = {"latitude": first[0], "longitude": first[1], "velocity_t": first[2:4], "heading": first[4]}
    session = Session(opened("ins_const11_heading", *settings), start=InitialNominal(start), periods={"ins": 10.0})
    for k in range(1, len(ins)):
        for name in ("velocity", "heading"):
            session.measure(name, float(streams[name].time[k - 1]), streams[name].values[k - 1])
        estimate = session.push(float(ins.time[k]), ins.values[k])
        assert estimate is not None
        values = np.array([estimate.states[label][0] for label in whole.prepared.plan.states])
        np.testing.assert_allclose(values, whole.estimate[k - 1], rtol=0, atol=1e-12)
        outputs = np.array([value for value, _ in estimate.outputs.values()])
        np.testing.assert_allclose(outputs, whole.output[k - 1], rtol=0, atol=1e-12)
