"""Observability along a record, whole problems."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.estimators.stretch import Stretch
from estimfw.run import run as runner
from estimfw.run.observe import default_protection, observe
from estimfw.run.run import run_problem

Example = Callable[..., Problem]


def test_the_redundant_bias_of_the_tracker(example: Example) -> None:
    found = observe(example("tracker_bias"))
    assert found.frozen.rank == 6
    assert {d.text for d in found.directions} == {f"position[{a}] - beacon_bias[{a}] - radar_bias[{a}]" for a in "xy"}
    sets = {frozenset(found.labels(s)) for s in found.removable.sets}
    biases = ("radar_bias", "beacon_bias")
    assert sets == {frozenset({f"{p}[x]", f"{q}[y]"}) for p in biases for q in biases}
    assert found.chosen == ("beacon_bias[x]", "beacon_bias[y]")
    assert found.record is not None
    assert [s.rank for s in found.record.segments] == [s.gramian.rank for s in found.record.segments] == [6] * 10
    end = dict(zip(found.names.states, found.record.degrees.observable_part[-1], strict=True))
    assert end["beacon_bias[x]"] < 0.05 < 0.97 < found.record.degrees.posterior[-1][6]


def test_the_floor_is_what_perfect_measurements_would_leave(example: Example) -> None:
    """position + radar and position + beacon known: beacon has 1 / (1/50^2 + 1/10^2 + 1/2^2) left of its variance 2^2."""
    found = observe(example("tracker_bias"), record=False)
    left = 1.0 / np.sqrt(1.0 / 50.0**2 + 1.0 / 10.0**2 + 1.0 / 2.0**2)
    for state, sigma in (("position[x]", 50.0), ("radar_bias[y]", 10.0), ("beacon_bias[x]", 2.0)):
        assert found.frozen.degree[found.names.states.index(state)] == pytest.approx(left / sigma, rel=1e-9)
    assert found.record is None


def test_the_thermal_model_is_observable_from_its_case(example: Example) -> None:
    found = observe(example("thermal"), segments=3)
    assert found.frozen.rank == 2 and found.directions == () and found.chosen is None
    assert found.record is not None and len(found.record.segments) == 3
    assert found.record.segments[-1].end == 3600.0


def test_protection_moves_the_choice_and_lists_what_it_hits(example: Example) -> None:
    problem = example("tracker_bias")
    found = observe(problem, protect=["beacon_bias"], record=False)
    assert found.chosen == ("radar_bias[x]", "radar_bias[y]")
    assert len(found.removable.sets) == 1 and len(found.hit) == 3
    assert observe(problem, protect=["beacon_bias", "radar_bias"], record=False).chosen is None


def test_what_corrects_the_nominal_is_protected(example: Example) -> None:
    blocks = {s.split("[")[0] for s in default_protection(example("static_12"))}
    assert blocks == {"velocity_error", "attitude_error"}
    assert default_protection(example("tracker_bias")) == ()


def test_chunks_and_segments_do_not_move_the_gramian(example: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = example("static_12", "source.duration=60 s")
    once = observe(problem, segments=1).record
    monkeypatch.setattr(runner, "LONGEST_CHUNK", 7)
    often = observe(problem, segments=9).record
    assert once is not None and often is not None
    assert np.allclose(once.segments[-1].gramian.singular[:9], often.segments[-1].gramian.singular[:9], rtol=1e-6)
    assert np.allclose(once.degrees.posterior, often.degrees.posterior, rtol=1e-9)


def test_a_restart_begins_anew(example: Example) -> None:
    found = observe(example("static_12", "source.duration=60 s", "estimator.restarts=[20 s]"), segments=3).record
    assert found is not None
    assert [s.begins_anew for s in found.segments] == [True, True, False]
    assert [(round(s.start), round(s.end)) for s in found.segments] == [(0, 20), (20, 40), (40, 60)]
    first, second = found.segments[0].gramian.singular, found.segments[1].gramian.singular
    assert np.allclose(first[:2], second[:2], rtol=1e-3)


def test_the_degree_is_that_of_the_run(example: Example) -> None:
    problem = example("tracker_bias", "source.duration=20 s")
    seen: list[Stretch] = []
    run_problem(problem, watch=lambda _: [seen.append])
    found = observe(problem).record
    assert found is not None
    P = np.concatenate([s.result.covariance for s in seen])
    wanted = np.sqrt(np.einsum("kii->ki", P)) / np.sqrt(np.diag(seen[0].prior))
    own = np.searchsorted(seen[0].time, found.degrees.time)
    assert np.allclose(found.degrees.posterior, wanted[own], rtol=1e-12)
