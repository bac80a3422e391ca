"""The kit passes the framework's own preprocessing and finds each fault that a plugin's may have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.preprocessing.online import Layouts, OnlineShift
from estimfw.data.preprocessing.shift import Clock
from estimfw.data.record import Record, Stream
from estimfw.testing import check_preprocess

CONFIG = """\
estimfw: 1
blocks: {speed: {kind: random_walk, unit: m/s, sigma: 20 m/s, noise: 0.1 m/s/sqrt(s)}}
measurements: {seen: {kind: direct, of: [{block: speed}], noise: 1 m/s, stream: base, columns: [v]}}
preprocess:
  clock: {kind: shift, stream: wheel, latency: 50 ms}
  pulses: {kind: counter, stream: wheel, columns: {n: v}, scale: 0.04 m, modulus: 1000, fastest: 30 m/s}
  smooth: {kind: fir_lowpass, stream: wheel, cutoff: 2 Hz, length: 1 s, longest_gap: 0.2 s}
  onto: {kind: join, stream: wheel, onto: base, columns: {v: v}}
"""


@pytest.fixture
def record() -> Record:
    time = np.asarray(0.1 * np.arange(100), dtype=float)
    counts = np.asarray(np.floor(900.0 + 60.0 * time + 20.0 * np.sin(time)) % 1000.0, dtype=float)
    counts[50] = np.nan
    base = Stream("base", np.asarray(0.05 * np.arange(1, 190), dtype=float), np.ones((189, 1)), ("b",), "sample", 0.05)
    return Record({"wheel": Stream("wheel", time, counts[:, None], ("n",), "sample", 0.1), "base": base})


def test_the_frameworks_own_components_pass(composed: Callable[[str], Problem], record: Record) -> None:
    check_preprocess(composed(CONFIG), record)


@dataclass(frozen=True)
class Faulty:
    """What it does to the values of the wheel; in a session it does nothing at all."""

    change: Callable[[Any], Any]

    def apply(self, record: Record) -> Record:
        wheel = record.streams["wheel"]
        return replace(record, streams={**record.streams, "wheel": replace(wheel, values=self.change(wheel.values))})

    def online(self, layouts: Layouts) -> OnlineShift:
        return OnlineShift(layouts, "wheel", Clock())


def doubled_in_place(values: Any) -> Any:
    values *= 2.0
    return values


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (doubled_in_place, "changes the stream 'wheel' of the record that it is given"),
        (lambda x: x - np.nanmean(x) * x.ndim, "of two runs side by side than of one alone"),
        (lambda x: 2.0 * x, "makes other values of 'wheel' in a session than of the whole record"),
    ],
    ids=["in place", "over all runs", "session"],
)
def test_each_fault_is_found(
    composed: Callable[[str], Problem], record: Record, change: Callable[[Any], Any], says: str
) -> None:
    problem = replace(composed(CONFIG), preprocess={"bad": Faulty(change)})
    with pytest.raises(AssertionError, match=says):
        check_preprocess(problem, record)
