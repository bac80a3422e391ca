"""A measurement that is refused all the time (46) and a filter that diverges (52): told, and what the config wants is done."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw import Session, open_filter

Run = Callable[..., Any]
FloatArray = NDArray[np.float64]
TIME: FloatArray = np.asarray(0.5 * np.arange(1, 401), dtype=float)


def fixes(jump: float = 0.0, begin: float = 50.0, end: float = 1e9, noise: float = 3.0) -> FloatArray:
    """t, x, y of a boat that swings at its anchor, as a receiver shows it that is off in x between two instants."""
    path = np.stack([20.0 * np.sin(0.05 * TIME), 15.0 * np.cos(0.04 * TIME)], axis=1)
    made = path + noise * np.random.default_rng(8).standard_normal(path.shape)
    made[(begin <= TIME) & (end > TIME), 0] += jump
    return np.column_stack([TIME, made])


@pytest.fixture
def boat(check: Run, logged: str, folder: Path) -> Run:
    """Runs the tracker on such fixes with this section ``health`` (empty: none)."""

    def run(log: FloatArray, health: str = "", *settings: str) -> Any:
        (folder / "fix.csv").write_text("time,x,y\n" + "".join(f"{t!r},{x!r},{y!r}\n" for t, x, y in log.tolist()))
        words = [w for s in settings for w in ("--set", s)]
        return check(logged + (f"health: {health}\n" if health else ""), "--json", *words, command="run")

    return run


def answered(told: Any) -> dict[str, Any]:
    assert told.code == 0, told.err + told.out
    made: dict[str, Any] = json.loads(told.out)
    return made


def events(answer: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [e for e in answer["events"] if e["kind"] == kind]


def test_a_good_run_is_healthy(boat: Run) -> None:
    answer = answered(boat(fixes()))
    assert {e["kind"] for e in answer["events"]} <= {"gated"}
    assert answer["cautions"] == []


def test_46_a_reference_that_is_refused_from_then_on_is_told_without_any_config(boat: Run) -> None:
    answer = answered(boat(fixes(jump=1e5)))
    (event,) = events(answer, "health degraded")
    assert (event["source"], event["time"], event["count"]) == ("fix", 50.0, 301)
    assert "rejected each of the 301 times it was due from 50 s to 200 s; so it was to the end" in event["text"]
    assert any("fix was rejected" in caution for caution in answer["cautions"])


def test_46_one_that_comes_back_is_told_from_when_until_when(boat: Run) -> None:
    answer = answered(boat(fixes(jump=1000.0, begin=50.0, end=80.0)))
    (event,) = events(answer, "health degraded")
    assert (event["time"], event["count"]) == (50.0, 60)
    assert "from 50 s to 79.5 s; fused again at 80 s" in event["text"]
    assert events(answer, "divergence") == []  # that is the reference, not the filter
    assert answer["cautions"] == []


def test_46_fewer_or_shorter_rejections_than_the_config_says_are_single_outliers(boat: Run) -> None:
    log = fixes(jump=1000.0, begin=50.0, end=80.0)
    assert events(answered(boat(log, "{rejected: {times: 61}}")), "health degraded") == []
    assert events(answered(boat(log, "{rejected: {longer: 30 s}}")), "health degraded") == []
    assert len(events(answered(boat(log, "{rejected: {times: 60, longer: 29.5 s}}")), "health degraded")) == 1
    assert events(answered(boat(log, "{rejected: null}")), "health degraded") == []
    few = fixes(jump=1000.0, begin=50.0, end=54.5)  # nine
    assert events(answered(boat(few)), "health degraded") == []


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
@pytest.mark.parametrize("then", ["inflate", "restart"])
def test_46_recovery_accepts_where_the_reference_went(boat: Run, then: str, kernel: str, covariance: str) -> None:
    log, settings = fixes(jump=120.0), (f"estimator.kernel={kernel}", f"estimator.covariance={covariance}")
    stuck = answered(boat(log, "", *settings))
    assert events(stuck, "health degraded")[0]["count"] > 40  # until its own doubt reaches that far
    answer = answered(boat(log, f"{{rejected: {{then: {then}}}}}", *settings))
    (event,) = events(answer, "recovery")
    assert event["time"] == 54.5  # the tenth
    assert {"inflate": "the prior covariance of position[x], position[y] is added", "restart": "starts anew"}[
        then
    ] in event["text"]
    (degraded,) = events(answer, "health degraded")
    assert degraded["count"] == 10
    assert "fused again at 55 s" in degraded["text"]
    x = answer["states"]["position[x]"]
    assert x["value"] == pytest.approx(20.0 * np.sin(10.0) + 120.0, abs=4 * x["sigma"])


def test_46_a_restart_is_what_a_restart_at_that_instant_is(boat: Run) -> None:
    answer = answered(boat(fixes(jump=120.0), "{rejected: {then: restart}}"))
    like = answered(boat(fixes(jump=120.0), "", "estimator.restarts=[54.5 s]"))
    for label, state in like["states"].items():
        assert answer["states"][label]["value"] == pytest.approx(state["value"], rel=1e-12)
        assert answer["states"][label]["sigma"] == pytest.approx(state["sigma"], rel=1e-12)


def test_46_what_no_recovery_explains_is_refused_again_and_again_and_each_time_is_told(boat: Run) -> None:
    answer = answered(boat(fixes(jump=1e6), "{rejected: {then: restart, times: 50}}"))
    assert [e["time"] for e in events(answer, "recovery")] == [74.5, 99.5, 124.5, 149.5, 174.5, 199.5]


def test_46_stop_ends_the_run_with_the_step_the_state_and_the_last_good_time(boat: Run, folder: Path) -> None:
    told = boat(fixes(jump=1000.0), "{rejected: {then: stop}}")
    assert told.code == 6
    told.says(
        "fix was rejected 10 times in a row, up to step 109 (t = 54.5 s); position[x] = ",
        "last good before 50 s; health.rejected.then: inflate or restart goes on",
    )


def test_52_a_filter_whose_nis_is_out_of_bounds_is_told_and_strict_stops_it(boat: Run) -> None:
    """The receiver is six times as noisy as the config says; without a gate nothing is refused."""
    log, no_gate = fixes(noise=18.0), "estimator.gate=null"
    assert events(answered(boat(log, "", no_gate)), "divergence") == []
    answer = answered(boat(log, "{divergence: {}}", no_gate))
    (event,) = events(answer, "divergence")
    assert event["source"] == "fix"
    assert event["time"] == 24.5 + 0.5  # the first fix has the prior to explain it; the fiftieth is at 25 s
    assert "times what is expected, out of its bounds from 25 s to the end: the sigmas are too small" in event["text"]
    assert events(answered(boat(log, "{divergence: {longer: 175.5 s}}", no_gate)), "divergence") == []
    assert len(events(answered(boat(log, "{divergence: {longer: 175 s}}", no_gate)), "divergence")) == 1
    told = boat(log, "{divergence: {strict: true, longer: 100 s}}", no_gate)
    assert told.code == 6
    told.says(
        "the filter diverged at step 250 (t = 125 s): the mean NIS of fix is ",
        "times what is expected since 25 s; position[x] = ", "it never was within bounds",
    )  # fmt: skip


def test_52_divergence_in_the_middle_of_a_run_names_the_last_good_time(boat: Run) -> None:
    log = fixes()
    log[200:, 1:] += np.random.default_rng(2).standard_normal((200, 2)) * 15.0
    told = boat(log, "{divergence: {strict: true}}", "estimator.gate=null")
    assert told.code == 6
    told.says("the filter diverged at step 20", "within bounds last at 10")


def test_52_one_outlier_however_large_is_no_divergence(boat: Run) -> None:
    log = fixes()
    log[200, 1] = 1e9
    answer = answered(boat(log, "{divergence: {strict: true}}"))
    assert answer["measurements"]["fix"]["gated"] >= 1
    assert events(answer, "divergence") == []


def test_52_sigmas_that_are_too_large_are_a_hint(boat: Run) -> None:
    (event,) = events(answered(boat(fixes(noise=1.0), "{divergence: {strict: true}}")), "too cautious")
    assert "the sigmas are larger than they need be" in event["text"]


@pytest.mark.parametrize(
    ("health", "settings", "says"),
    [
        ("{rejected: {of: [fixx]}}", (), "health.rejected.of[0]: there is no measurement 'fixx'"),
        ("{rejected: {of: [fix]}}", ("estimator.gate=null",), "measurement 'fix' has no gate, so it is never rejected"),
        ("{rejected: {then: stop}}", ("estimator.gate=null",), "no measurement has a gate, so none is ever rejected"),
        ("{rejected: {then: stopp}}", (), "health.rejected.then"),
        ("{divergence: {of: [fixx]}}", (), "health.divergence.of[0]: there is no measurement 'fixx'"),
        ("{divergence: {probability: 0.3}}", (), "health.divergence.probability"),
    ],
)
def test_a_section_that_cannot_be_meant_is_refused(
    boat: Run, health: str, settings: tuple[str, ...], says: str
) -> None:
    told = boat(fixes(), health, *settings)
    assert told.code == 3
    told.says("filter.yaml:", says)


def test_in_a_monte_carlo_nothing_is_done_about_it(check: Run, tracker: Run) -> None:
    """Each run would have stopped at another instant: the gate refuses every tenth measurement, by chance two in a row."""
    config = tracker("gate: 0.999", "gate: 0.5")
    stopping = (
        config + "health: {rejected: {times: 2, then: stop}, divergence: {epochs: 2, probability: 0.6, strict: true}}\n"
    )
    assert check(stopping, "--json", command="run").code == 6
    assert check(stopping, "--runs", "10", "--json", command="montecarlo").code == 0


def test_a_decentralised_filter_tells_and_stops_and_does_not_recover(boat: Run) -> None:
    nodes = (
        "{kind: decentralised, gate: 0.999, nodes: [{name: one, blocks: [position, velocity], measurements: [fix]}]}"
    )
    told = boat(fixes(jump=1e5), "{rejected: {then: restart}}", f"estimator={nodes}")
    assert told.code == 3
    told.says("health.rejected.then: the nodes of a decentralised filter do not agree on a recovery")
    (event,) = events(
        answered(boat(fixes(jump=1e5), "{rejected: {then: flag}}", f"estimator={nodes}")), "health degraded"
    )
    assert event["count"] == 301
    assert boat(fixes(jump=1e5), "{rejected: {then: stop}}", f"estimator={nodes}").code == 6


def test_a_session_tells_its_health_as_it_changes(boat: Run, logged: str, folder: Path) -> None:
    """The same judges, step by step: the same instants as in a run of the whole."""
    log = fixes(jump=1000.0, begin=50.0, end=80.0)
    log[260:, 1:] += np.random.default_rng(2).standard_normal((140, 2)) * 12.0
    answer = answered(boat(log, "{}", "estimator.gate=0.99999"))
    session = Session(open_filter(folder / "filter.yaml", ["estimator.gate=0.99999"]), periods={"fix": 0.5})
    for t, x, y in log.tolist():
        session.measure("fix", t, [x, y])
        session.advance(t)
    for kind in ("health degraded", "divergence", "too cautious"):
        assert [e.time for e in session.events if e.kind == kind] == [e["time"] for e in events(answer, kind)]
    assert len([e for e in session.events if e.kind == "divergence"]) > 0


@pytest.mark.parametrize("then", ["inflate", "restart"])
@pytest.mark.parametrize("covariance", ["ud", "joseph"])
def test_a_session_recovers_where_a_run_of_the_whole_does(
    boat: Run, logged: str, folder: Path, then: str, covariance: str
) -> None:
    """A run finds out after a stretch and goes back, a session after each step: the same estimates, several recoveries on."""
    log = fixes(jump=700.0, begin=50.0, end=150.0)
    answer = answered(boat(log, f"{{rejected: {{then: {then}}}}}", f"estimator.covariance={covariance}"))
    assert len(events(answer, "recovery")) > 3
    problem = open_filter(folder / "filter.yaml", [f"estimator.covariance={covariance}"])
    session = Session(problem, periods={"fix": 0.5})
    for t, x, y in log.tolist():
        session.measure("fix", t, [x, y])
        session.advance(t)
    assert session.estimate is not None
    assert [e.time for e in session.events if e.kind == "recovery"] == [e["time"] for e in events(answer, "recovery")]
    for label, (value, sigma) in session.estimate.states.items():
        assert value == pytest.approx(answer["states"][label]["value"], rel=1e-11)
        assert sigma == pytest.approx(answer["states"][label]["sigma"], rel=1e-11)
