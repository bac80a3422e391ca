"""The drive that is simulated: what its sensors measure, what its odometer counts, and how it is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from estimfw_sins_odometer.route import Change, drawn_route
from estimfw_sins_odometer.simulate import SimulateConfig, Simulation
from numpy.typing import NDArray

from estimfw.config.types import Site

FloatArray = NDArray[np.float64]


def test_raw_speed_errs_by_the_pulses_as_a_difference_of_counts_does(drive: Any) -> None:
    """Of a pulse over an interval the part f is there or not: a variance of f (1 - f), a sixth of a pulse squared on average."""
    rms = []
    for seed in range(6):
        record = drive(seed=seed, errors=True, speed="raw")
        assert record.truth is not None
        error = record.streams["imu"].values[:, 6] - record.truth.values["speed"]
        moving = record.truth.values["speed"] > 1.0
        rms.append(np.sqrt(np.mean(np.square(error[moving]))))
    assert np.mean(rms) == pytest.approx(0.04 * 100.0 / np.sqrt(6.0), rel=0.06)


def test_a_vehicle_at_rest_gives_no_pulses(drive: Any) -> None:
    stopped = 0
    for seed in range(6):
        record = drive(seed=seed, errors=True, speed="raw")
        assert record.truth is not None
        still = record.truth.values["speed"] == 0.0
        stopped += int(still.sum())
        assert np.all(record.streams["imu"].values[still, 6][1:] == 0.0)
    assert stopped > 1000


def test_pulses_never_go_back_and_add_up_to_the_way(drive: Any) -> None:
    record = drive(seed=1, errors=True)
    pulses, truth = record.streams["odometer"].values[:, 0], record.truth
    assert truth is not None
    assert np.all(np.diff(pulses) >= 0.0)
    way = np.trapezoid(truth.values["speed"], truth.time)
    assert 0.04 * (pulses[-1] - pulses[0]) == pytest.approx(way, rel=0.01)


def test_a_route_turns_at_no_more_than_two_metres_a_second_squared() -> None:
    time = np.arange(60_401) / 100.0
    for seed in range(20):
        route = drawn_route(np.random.default_rng(seed), 604.0)
        speed, heading = route.speed_at(time), route.heading_at(time)
        assert np.max(np.abs(speed * np.gradient(heading, 0.01))) < 2.001
        assert np.max(np.abs(np.gradient(speed, 0.01))) < 1.81
        assert np.max(speed) <= 20.0 and len(route.turns) == 10 and speed[0] >= 6.0
        assert np.count_nonzero((speed[:-1] > 0.0) & (speed[1:] == 0.0)) <= 3


def test_a_change_is_smooth() -> None:
    change, time = Change(1.0, 4.0, 3.0), np.linspace(0.0, 6.0, 6001)
    value = change.at(time)
    assert value[0] == 0.0 and value[-1] == pytest.approx(3.0)
    assert np.max(np.gradient(value, time)) == pytest.approx(1.875 * 3.0 / 4.0, rel=1e-3)


def test_runs_are_drawn_one_by_one_and_together_alike(site: Site) -> None:
    source = Simulation(SimulateConfig.model_validate({"kind": "sins_odometer.simulate", "duration": "30 s"}), site)
    seeds = np.random.SeedSequence(3).spawn(2)
    both = source.drawn_many(seeds, {})
    second = source.drawn_many(np.random.SeedSequence(3).spawn(2)[1:], {})
    for name in ("imu", "odometer"):
        assert np.array_equal(both.run(1).streams[name].values, second.run(0).streams[name].values)
    assert not np.array_equal(both.run(0).streams["imu"].values, both.run(1).streams["imu"].values)


def test_a_standing_start_stands(drive: Any) -> None:
    record = drive(seed=1, duration="100 s", start="rest")
    assert record.truth is not None
    assert np.all(record.truth.values["speed"][:400] == 0.0) and np.max(record.truth.values["speed"]) > 5.0
