"""A bank judges starts by the likelihood of the measurements, and is the filter itself where it has one member."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import multivariate_normal

from estimfw.config.compose import Problem
from estimfw.config.generic.components import core_components
from estimfw.data.record import Record
from estimfw.errors import ConfigError, DataError
from estimfw.estimators.bank import charged, judge, weights
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import FUSED, GATED
from estimfw.model.nominal import InitialNominal
from estimfw.montecarlo.campaign import run_campaign
from estimfw.registry.load import load_plugins
from estimfw.report.price_tables import price_notes
from estimfw.report.terminal import print_result
from estimfw.report.write import write_report
from estimfw.run.answer import answer
from estimfw.run.bank_end import bank_end
from estimfw.run.budget import error_budget
from estimfw.run.compare import compare
from estimfw.run.contenders import from_configs, grid
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.observe import observe
from estimfw.run.prepare import make_chunk, prepare
from estimfw.run.result_file import read_result, write_result
from estimfw.run.run import Collected, run_problem
from estimfw.run.session import Session

FloatArray = NDArray[np.float64]
Composed = Callable[[str], Problem]
Example = Callable[..., Problem]
SPRING = """\
estimfw: 1
name: a mass on a spring of unknown stiffness
nominal: {kind: constant, values: {stiffness: STIFFNESS, offset: [0.0, 0.0]}}
blocks:
  position: {kind: random_constant, unit: m, sigma: 1 m, mean: 1 m}
  velocity: {kind: random_walk, unit: m/s, sigma: 0.5 m/s, noise: 0.05 m/s/sqrt(s)}
process:
  kinematics: {kind: couple, target: position, source: velocity, coefficient: 1}
  spring: {kind: couple, target: velocity, source: position, coefficient: {scalar: stiffness, times: -1}}
measurements:
  length: {kind: direct, of: [{block: position}], noise: 0.2 m}
estimator: ESTIMATOR
source: {kind: simulate_model, duration: 20 s, rate: 2 Hz, seed: 3}
"""
ONE = "{kind: kalman}"
FIVE = "{kind: bank, starts: {quantity: stiffness, count: 5, spacing: 1}, filter: {kind: kalman, kernel: KERNEL}}"


@pytest.fixture(scope="module")
def spring(composed: Composed) -> Callable[..., Problem]:
    def make(stiffness: float = 3.0, estimator: str = FIVE, kernel: str = "numpy") -> Problem:
        own = estimator.replace("KERNEL", kernel)
        return composed(SPRING.replace("STIFFNESS", str(stiffness)).replace("ESTIMATOR", own))

    return make


@pytest.fixture(scope="module")
def record(spring: Callable[..., Problem]) -> Record:
    """Of a spring that is stiffer than where the bank begins: 4 where it is said to be 3."""
    return load_record(spring(4.0, ONE))


def batch_likelihood(problem: Problem, stiffness: float, record: Record) -> FloatArray:
    """-2 ln p of the first k readings, for each k: all of them as one normal vector, without any filter."""
    stream = record.streams["length"]
    n, z = stream.time.size, stream.values[:, 0]
    step = np.diff(stream.time, prepend=0.0)
    P, x, joint, mean = np.diag([1.0, 0.25]), np.array([1.0, 0.0]), np.zeros((n, n)), np.zeros(n)
    row = problem.plan.layout.pack({"stiffness": np.array(stiffness), "offset": np.zeros(2)})
    cross = np.zeros((0, 2))
    for k in range(n):
        if step[k] > 0:
            Phi, Q, _ = problem.plan.discretised(row, np.zeros(0), np.array(step[k]), 0)
            x, P, cross = Phi @ x, Phi @ P @ Phi.T + Q, cross @ Phi.T
        mean[k], joint[k, k] = x[0], P[0, 0] + 0.04
        joint[k, :k] = joint[:k, k] = cross[:, 0]
        cross = np.vstack([cross, P[0]])
    return np.array(
        [-2.0 * multivariate_normal.logpdf(z[: k + 1], mean[: k + 1], joint[: k + 1, : k + 1]) for k in range(n)]
    )


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_the_score_is_the_likelihood_of_all_readings_together(
    spring: Callable[..., Problem], record: Record, kernel: str
) -> None:
    done = run_problem(spring(kernel=kernel), record=record)
    assert done.bank is not None and done.prepared.scan.name == kernel
    count = np.cumsum(done.disposition[:, 0] == FUSED)
    for member, stiffness in enumerate((3.0, 4.0, 2.0, 5.0, 1.0)):
        own = done.bank.score[:, member] + count * np.log(2.0 * np.pi)
        np.testing.assert_allclose(own, batch_likelihood(done.prepared.problem, stiffness, record), rtol=1e-9)


def test_members_may_be_unscented_and_of_a_linear_model_are_the_same(
    spring: Callable[..., Problem], record: Record
) -> None:
    kalman = run_problem(spring(), record=record)
    unscented = run_problem(
        spring(estimator=FIVE.replace("kind: kalman, kernel: KERNEL", "kind: unscented")), record=record
    )
    assert kalman.bank is not None and unscented.bank is not None
    assert type(unscented.prepared.scan) is not type(kalman.prepared.scan)
    np.testing.assert_allclose(unscented.bank.score, kalman.bank.score, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(unscented.bank.best, kalman.bank.best)


def test_the_member_that_starts_right_wins_and_weights_sum_to_one(
    spring: Callable[..., Problem], record: Record
) -> None:
    dataset = result_dataset(run_problem(spring(), record=record))
    np.testing.assert_allclose(dataset["bank_weight"].sum("member"), 1.0, rtol=1e-14)
    assert str(dataset["member"].to_numpy()[int(dataset["bank_member"][-1])]) == "stiffness +1"
    assert float(dataset["bank_weight"][-1, 1]) > 0.9
    np.testing.assert_array_equal(np.argmax(dataset["bank_weight"].to_numpy(), axis=1), dataset["bank_member"])


@pytest.mark.parametrize("more", ["", ", restarts: [6 s, 12 s]", ", gate: 0.99"])
@pytest.mark.parametrize("kernel", ["numpy", "numba"])
def test_what_is_reported_is_the_filter_from_that_start_bit_for_bit(
    spring: Callable[..., Problem], record: Record, kernel: str, more: str
) -> None:
    done = run_problem(spring(kernel=f"{kernel}{more}"), record=record)
    assert done.bank is not None and len(set(done.bank.best.tolist())) > 1
    for member, stiffness in enumerate((3.0, 4.0, 2.0, 5.0, 1.0)):
        alone = run_problem(spring(stiffness, f"{{kind: kalman, kernel: {kernel}{more}}}"), record=record)
        at = done.bank.best == member
        for name in ("estimate", "sigma", "innovation", "nis", "truth"):
            np.testing.assert_array_equal(getattr(done, name)[at], getattr(alone, name)[at], err_msg=name)


SINGLES = {
    "closed loop": (
        "static_12", "policies=[]", "source.duration=10 s", "source.rate=10 Hz",
        "{kind: kalman, loop: closed, restarts: [5 s], kernel: KERNEL}", "attitude", "axis: U,", "45 deg",
    ),
    "reduced": ("static_7", "source.duration=50 s", "{kind: kalman, kernel: KERNEL}", "attitude", "axis: U,", "1 deg"),
}  # fmt: skip


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("case", SINGLES)
def test_a_bank_of_one_is_the_plain_filter_bit_for_bit(example: Example, case: str, kernel: str) -> None:
    name, *overrides, own, quantity, axis, spacing = SINGLES[case]
    own = own.replace("KERNEL", kernel)
    starts = f"{{quantity: {quantity}, {axis} count: 1, spacing: {spacing}}}"
    plain = run_problem(example(name, *overrides, f"estimator={own}"))
    bank = run_problem(example(name, *overrides, f"estimator={{kind: bank, starts: {starts}, filter: {own}}}"))
    for field in fields(Collected):
        value = getattr(plain, field.name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(bank, field.name), value, err_msg=field.name)
    if plain.honest is not None:
        assert bank.honest is not None
        np.testing.assert_array_equal(bank.honest.sigma, plain.honest.sigma)
    assert (plain.honest is not None) == (case == "reduced")
    np.testing.assert_array_equal(result_dataset(bank)["bank_weight"], 1.0)


def test_a_session_reports_the_member_that_the_batch_reports(spring: Callable[..., Problem], record: Record) -> None:
    problem, stream = spring(), record.streams["length"]
    batch = result_dataset(run_problem(problem, record=record))
    session = Session(problem)
    for k, (time, row) in enumerate(zip(stream.time, stream.values, strict=True)):
        session.measure("length", float(time), row)
        found = session.advance(float(time))
        assert found.member == str(batch["member"].to_numpy()[int(batch["bank_member"][k])])
        np.testing.assert_allclose(list(found.weights.values()), batch["bank_weight"][k], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose([v for v, _ in found.states.values()], batch["estimate"][k], rtol=1e-12)


def test_a_member_that_gates_everything_gains_nothing_by_it(spring: Callable[..., Problem], record: Record) -> None:
    gated = FIVE.replace("kernel: KERNEL", "gate: 0.999")
    done = run_problem(spring(estimator=gated), record=record)
    assert done.bank is not None and done.prepared.members[int(done.bank.best[-1])].label == "stiffness +1"
    plan, results = done.prepared.plan, []
    for one in done.prepared.members:
        results.append(one.scan.run(one.state, make_chunk(one, 0, len(one.steps)))[1])
    refusing = results[4]
    refused = refusing.disposition[:, 0] == GATED
    assert np.count_nonzero(refused) > 5
    each = np.diff(charged(plan, refusing, 0.0), prepend=0.0)
    threshold = plan.thresholds(plan.measurements[0])
    assert threshold is not None
    np.testing.assert_allclose(each[refused], threshold[1] + refusing.log_det[refused, 0], rtol=1e-9)


def test_a_lost_member_is_out_and_the_others_go_on(spring: Callable[..., Problem], record: Record) -> None:
    prepared = prepare(spring(), record)
    results = [one.scan.run(one.state, make_chunk(one, 0, len(one.steps)))[1] for one in prepared.members]
    winner = results[1]
    broken = replace(winner, estimate=np.where(np.arange(len(winner.estimate))[:, None] >= 15, np.nan, winner.estimate))
    judged = judge(prepared.plan, [results[0], broken, *results[2:]], np.zeros(5), scored=True)
    assert np.all(np.isinf(judged.score[15:, 1])) and np.all(np.isfinite(judged.score[:15, 1]))
    assert not np.any(judged.best[15:] == 1)
    shares = weights(judged.score)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-14)
    assert np.all(shares[15:, 1] == 0.0)


def test_chunks_do_not_change_the_score(spring: Callable[..., Problem], record: Record) -> None:
    prepared = prepare(spring(), record)
    state, cut, parts = prepared.state, 17, list[FloatArray]()
    before = 0.0
    for first, last in ((0, cut), (cut, len(prepared.steps))):
        state, result = prepared.scan.run(state, make_chunk(prepared, first, last))
        parts.append(charged(prepared.plan, result, before))
        before = float(parts[-1][-1])
    whole: ChunkResult = prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))[1]
    np.testing.assert_array_equal(np.concatenate(parts), charged(prepared.plan, whole, 0.0))


def test_result_answer_terminal_and_page_name_the_member(
    spring: Callable[..., Problem], record: Record, tmp_path: Path
) -> None:
    dataset = result_dataset(run_problem(spring(), record=record))
    back = read_result(write_result(dataset, tmp_path / "result.nc"))
    end = bank_end(back)
    assert end is not None and end.member == "stiffness +1" and sum(w for _, w in end.weights) == pytest.approx(1.0)
    told = answer(back)["bank"]
    assert told["member"] == "stiffness +1" and told["weight"] == end.weight
    json.dumps(told, allow_nan=False)
    with (tmp_path / "told.txt").open("w") as file:
        print_result(back, Console(file=file, width=140))
    shown = (tmp_path / "told.txt").read_text()
    assert (
        "bank of 5: stiffness +1, weight " in shown and "its sigmas know nothing of the doubt between members" in shown
    )
    written = [path.name for path in write_report(back, tmp_path / "report")]
    assert "bank.png" in written


@pytest.mark.parametrize(
    ("analysis", "says"),
    [
        (error_budget, "an error budget follows one filter"),
        (observe, "observability along the record follows one filter"),
        (lambda problem: run_campaign(problem, 1, 2), "a Monte Carlo of consistency follows one filter"),
    ],
)
def test_analyses_of_one_filter_refuse_a_bank(
    spring: Callable[..., Problem], analysis: Callable[[Problem], object], says: str
) -> None:
    with pytest.raises(ConfigError, match=says):
        analysis(spring())
    assert observe(spring(), record=False).frozen.rank == 2


def test_a_comparison_times_all_members_and_says_so(
    tmp_path: Path,
) -> None:
    for name, estimator in (("one", ONE), ("five", FIVE.replace("KERNEL", "numpy"))):
        text = SPRING.replace("STIFFNESS", "3.0").replace("ESTIMATOR", estimator)
        (tmp_path / f"{name}.yaml").write_text(text)
    registry = load_plugins(core_components())
    found = compare(from_configs([tmp_path / "one.yaml", tmp_path / "five.yaml"], ()), grid(()), registry, repeats=9)
    assert [one.members for one in found.filters] == [1, 5]
    assert found.filters[1].time.ratio > 2.0
    assert any(note.startswith("five: a bank of 5") for note in price_notes(found))


BAD = {
    "stiffnes, count: 5, spacing: 1": ("no 'stiffnes' to be spread", "stiffness"),
    "stiffness, axis: U, count: 5, spacing: 1": ("is one number, without axes", "leave out"),
    "offset, axis: U, count: 5, spacing: 1": ("has no axis 'U'", "a place from 0 to 1"),
    "stiffness, count: 5, spacing: 1 furlong": ("no unit 'furlong'", "such as m/s^2"),
}


@pytest.mark.parametrize("starts", BAD)
def test_a_spread_that_names_nothing_is_refused(spring: Callable[..., Problem], starts: str) -> None:
    says, hint = BAD[starts]
    with pytest.raises(ConfigError) as told:
        problem = spring(estimator=f"{{kind: bank, starts: {{quantity: {starts}}}}}")
        prepare(problem, load_record(problem))
    assert says in told.value.message and hint in str(told.value.hint)
    assert told.value.location is not None and told.value.location.line == 12


def test_a_bank_says_how_its_starts_differ(spring: Callable[..., Problem]) -> None:
    problem = spring(estimator="{kind: bank}")
    with pytest.raises(ConfigError, match="the members of a bank differ in their start, and nothing says how"):
        prepare(problem, load_record(problem))


class Candidates:
    """A start that could not decide: three stiffnesses."""

    def find(self, record: Record) -> InitialNominal:
        stiffness = np.array([1.0, 3.0, 4.0])
        return InitialNominal({"stiffness": stiffness, "offset": np.zeros(2)}, candidates=("soft", "usual", "hard"))

    def reference(self) -> InitialNominal:
        return InitialNominal({"stiffness": np.array(3.0), "offset": np.zeros(2)})


class Believing:
    """A constant nominal that starts where it is told to."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def __getattr__(self, name: str) -> object:
        return getattr(self.problem.provider, name)

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        assert given is not None
        return given


def test_a_found_start_may_be_several_candidates(spring: Callable[..., Problem], record: Record) -> None:
    def undecided(estimator: str) -> Problem:
        problem = spring(estimator=estimator)
        return replace(problem, initial=Candidates(), provider=Believing(problem))  # type: ignore[arg-type]

    dataset = result_dataset(run_problem(undecided("{kind: bank}"), record=record))
    assert [str(label) for label in dataset["member"].to_numpy()] == ["soft", "usual", "hard"]
    assert int(dataset["bank_member"][-1]) == 2
    with pytest.raises(DataError, match="the start is 3 candidates, and one filter starts from one"):
        prepare(undecided(ONE), record)
    with pytest.raises(ConfigError, match="the start is 3 candidates already"):
        prepare(undecided(FIVE.replace("KERNEL", "auto")), record)
