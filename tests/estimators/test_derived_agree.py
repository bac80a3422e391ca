"""Derived variables inside the compiled scan: the same numbers as the plain functions give, step after step."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import FloatArray
from estimfw.errors import ConfigError
from estimfw.estimators.scan import ChunkResult
from estimfw.model.coefficient import constant, identity, scalar, vector
from estimfw.model.model import Model
from estimfw.model.parts import CompiledFunction, DerivedVariable, HeldArgument, ProcessTerm
from estimfw.plan.completion import completion, derived_in_loop
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import make_plan
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.fix_nominal import FixNominal
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare

Example = Callable[..., Problem]
TWINS = """
import math

from numba import njit

@njit(cache=True)
def lean(f_n, out):
    out[0] = math.tan(f_n[0] / f_n[2])

@njit(cache=True)
def pull(lean_of_f, C_bn, arm, out):
    for i in range(3):
        out[i] = 0.0
        for j in range(3):
            out[i] += C_bn[3 * i + j] * math.sin(arm[j] + lean_of_f[0])
"""
RUN = (
    "estimator={kind: kalman, loop: closed}", "policies=[]", "source.rate=50 Hz", "source.duration=4 s", "nominal.samples=2",
    "source.sway={amplitude: [1 deg, 2 deg, 3 deg], period: 4 s}",
)  # fmt: skip
ARM = (0.3, -0.2, 0.1)


def lean(f_n: FloatArray) -> FloatArray:
    return np.asarray(np.tan(f_n[..., 0] / f_n[..., 2]))


def pull(lean_of_f: FloatArray, C_bn: FloatArray, arm: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...ij,...j->...i", C_bn, np.sin(arm + np.asarray(lean_of_f)[..., None])))


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The name of a module of numba functions, as a plugin would bring it."""
    folder = tmp_path_factory.mktemp("twins")
    (folder / "leaning_twins.py").write_text(TWINS)
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    yield "leaning_twins"
    sys.path.remove(str(folder))
    sys.modules.pop("leaning_twins", None)


def leaning(problem: Problem, module: str | None, fixes: tuple[FixNominal, ...] = ()) -> Problem:
    """The example with nonlinear terms in dynamics, H and innovation; without a module its functions are plain Python."""
    twin = {name: CompiledFunction(module, name) if module else None for name in ("lean", "pull")}
    derived = (
        *problem.model.derived,
        DerivedVariable("lean_of_f", (), ("f_n",), lean, compiled=twin["lean"]),
        DerivedVariable(
            "pulled", (3,), ("lean_of_f", "C_bn", "arm"), pull, held=(HeldArgument.of("arm", ARM),), compiled=twin["pull"]
        ),
    )  # fmt: skip
    outer = vector("pulled") @ vector("pulled").T
    terms = (
        ProcessTerm("lean", "velocity_error", "attitude_error", scalar("lean_of_f") * identity(3), "n"),
        ProcessTerm("swing", "attitude_error", "velocity_error", outer * 1e-3, "n"),
    )
    seen = problem.model.measurement("zero_velocity")
    part = replace(seen.terms[0], coefficient=seen.terms[0].coefficient + outer * 0.1)
    seen = replace(seen, terms=(part, *seen.terms[1:]), innovation=vector("velocity_n") + vector("pulled") * 1e-4)
    model = problem.model.with_parts(
        derived=derived, terms=(*problem.model.terms, *terms), measurements=(seen,)
    )  # fmt: skip
    for fix in fixes:
        model, _ = fix.apply(model, problem.reference)
    return planned(problem, model)


def planned(problem: Problem, model: Model) -> Problem:
    layout = NominalLayout(problem.plan.layout.variables, (*model.derived, *model.held))
    plan = make_plan(model, layout, problem.provider.slots, problem.plan.discretisation, {})
    return replace(problem, model=model, plan=plan)


def outcome(problem: Problem, kernel: str) -> ChunkResult:
    estimator = problem.estimator.model_copy(update={"kernel": kernel})
    prepared = prepare(replace(problem, estimator=estimator), load_record(problem))
    assert prepared.scan.name == kernel
    return prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))[1]


def differing(one: ChunkResult, other: ChunkResult) -> float:
    """Largest difference of estimates in sigmas, and of covariances in products of sigmas."""
    sigma = np.sqrt(np.einsum("kii->ki", one.covariance))
    spread = sigma[:, :, None] * sigma[:, None, :]
    of_estimates = np.max(np.abs(one.estimate - other.estimate) / sigma)
    return float(max(of_estimates, np.max(np.abs(one.covariance - other.covariance) / spread)))


HELD = FixNominal("f_n", ("gravity", 0.0, 9.8))
#: Without and with twins ``fixed.`` whose argument is held: at another variable, and at a number.
FIXES: dict[str, tuple[FixNominal, ...]] = {"nothing held": (), "force held at another variable": (HELD,)}


@pytest.mark.parametrize("case", FIXES)
def test_both_kernels_agree_on_derived_variables(example: Example, twins: str, case: str) -> None:
    problem = leaning(example("static_12", *RUN), twins, FIXES[case])
    numpy, numba = outcome(problem, "numpy"), outcome(problem, "numba")
    assert differing(numpy, numba) < 1e-12
    np.testing.assert_allclose(numba.innovation, numpy.innovation, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(numba.disposition, numpy.disposition)
    assert differing(numpy, outcome(example("static_12", *RUN), "numpy")) > 1e-3, "the derived terms do nothing"


def test_chunks_of_any_length_give_the_same(example: Example, twins: str) -> None:
    problem = leaning(example("static_12", *RUN, "estimator.kernel=numba"), twins)
    prepared = prepare(problem, load_record(problem))
    whole = outcome(problem, "numba")
    state, estimates = prepared.state, []
    for first in range(0, len(prepared.steps), 7):
        last = min(first + 7, len(prepared.steps))
        state, result = prepared.scan.run(state, make_chunk(prepared, first, last))
        estimates.append(result.estimate)
    np.testing.assert_array_equal(np.concatenate(estimates), whole.estimate)


def test_one_that_a_held_variable_makes_constant_leaves_the_plan_time_invariant(example: Example, twins: str) -> None:
    problem = leaning(example("static_12", *RUN), twins, (FixNominal("f_n", (1.0, 0.0, 9.8)),))
    assert {name for _, name, _ in problem.plan.varying} >= {"fixed.pulled"}
    still, _ = DropTerm(("swing", "accel_bias_coupling", "gyro_bias_coupling", "coriolis")).apply(
        problem.model, problem.reference
    )
    seen = still.measurement("zero_velocity")
    seen = replace(seen, terms=(replace(seen.terms[0], coefficient=identity(3)),))
    problem = planned(problem, still.with_parts(measurements=(seen,)))
    assert np.tan(1.0 / 9.8) in {
        c for _, _, p in problem.model.term_matrix(problem.model.term("lean")).entries for c, _ in p
    }
    assert problem.plan.time_invariant, problem.plan.reason
    # `lean` is a number now, and the innovation alone still reads a derived variable: the provider's own.
    assert [d.name for d in derived_in_loop(problem.plan)] == ["lean_of_f", "pulled"]
    assert not completion(problem.plan).process
    assert differing(outcome(problem, "numpy"), outcome(problem, "numba")) < 1e-12


def test_a_variable_that_only_outputs_read_needs_no_twin(example: Example) -> None:
    problem = example("static_12", *RUN)
    plain = DerivedVariable("lean_of_f", (), ("f_n",), lean)
    problem = planned(problem, problem.model.with_parts(derived=(*problem.model.derived, plain)))
    assert not derived_in_loop(problem.plan)
    assert outcome(problem, "numba").estimate.shape[1] == 12


def test_plain_python_behind_a_twin_keeps_the_loop_in_numpy(example: Example, twins: str) -> None:
    problem = leaning(example("static_12", *RUN), twins)
    derived = tuple(replace(d, compiled=None) if d.name == "lean_of_f" else d for d in problem.model.derived)
    model = problem.model.with_parts(derived=derived)
    with pytest.raises(ConfigError, match="the derived variable lean_of_f is plain Python"):
        outcome(planned(problem, model), "numba")


def test_a_setting_is_an_argument_and_no_variable(example: Example) -> None:
    variable = DerivedVariable("shifted", (3,), ("f_n", "arm"), shifted, held=(HeldArgument.of("arm", ARM),))
    assert variable.reads == ("f_n",)
    problem = example("static_12")
    problem = planned(problem, problem.model.with_parts(derived=(*problem.model.derived, variable)))
    rows = np.tile(problem.plan.layout.pack(problem.reference), (4, 1))
    force = problem.plan.layout.unpack(rows)["f_n"]
    found: Any = problem.plan.layout.unpack(problem.plan.layout.complete(rows))
    np.testing.assert_array_equal(found["shifted"], force + np.array(ARM))
    assert HeldArgument.of("arm", ARM).value == constant(np.array(ARM).reshape(3, 1))


def shifted(f_n: FloatArray, arm: FloatArray) -> FloatArray:
    return np.asarray(f_n + arm)


def test_both_kernels_agree_on_ranges_to_beacons_in_a_loop_that_is_closed(boat: Example) -> None:
    problem = boat("source.duration=60 s", "estimator.gate=0.9")
    numpy, numba = outcome(problem, "numpy"), outcome(problem, "numba")
    assert differing(numpy, numba) < 1e-12
    np.testing.assert_allclose(numba.nis, numpy.nis, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(numba.disposition, numpy.disposition)
    assert set(np.unique(numpy.disposition)) == {-1, 0, 1}, "nothing was gated"


def test_what_is_measured_may_vary_while_phi_and_q_are_made_once(boat: Example, example: Example) -> None:
    plan = boat("source.duration=5 s").plan
    assert plan.steady and not plan.time_invariant
    moving = example("static_12", "policies=[]").plan
    assert not moving.steady
