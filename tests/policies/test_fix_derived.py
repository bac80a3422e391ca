"""A held variable is held in what derived variables make of it too; outputs and innovations see the provider's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import PluginError
from estimfw.model.coefficient import identity, scalar, vector
from estimfw.model.model import Model
from estimfw.model.nominal import NominalVariable
from estimfw.model.parts import DerivedVariable, ProcessTerm
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import Plan, make_plan
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.prune_unobservable import model_observability
from estimfw.policies.sequence import apply_policies

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
Nominal = dict[str, FloatArray]


def tilt(f_n: FloatArray) -> FloatArray:
    return np.asarray(np.tan(f_n[..., 0] / f_n[..., 2]))


def twice_turned(tilt_of_f: FloatArray, earth_rate_n: FloatArray) -> FloatArray:
    return np.asarray(2.0 * tilt_of_f[..., None] * earth_rate_n)


TILT = DerivedVariable("tilt_of_f", (), ("f_n",), tilt)
TURNED = DerivedVariable("turned_rate", (3,), ("tilt_of_f", "earth_rate_n"), twice_turned)
VARIABLES = (
    NominalVariable("C_bn", (3, 3), "1", "varying"),
    NominalVariable("f_n", (3,), "m/s^2", "varying"),
    NominalVariable("gravity", (), "m/s^2", "constant"),
    NominalVariable("earth_rate_n", (3,), "rad/s", "constant"),
)


@pytest.fixture
def coupled(inertial: Inertial) -> Model:
    """v, phi alone, with terms that need a derived variable and one derived from that."""
    model = inertial()
    terms = (
        ProcessTerm("lean", "v", "phi", scalar("tilt_of_f") * identity(3), "n"),
        ProcessTerm("swing", "phi", "v", vector("turned_rate") @ vector("turned_rate").T, "n"),
    )
    bias = {"accel_bias_coupling", "gyro_bias_coupling"}
    kept = tuple(t for t in model.terms if t.label not in bias)
    return model.with_parts(terms=(*kept, *terms), derived=(TILT, TURNED))


def planned(model: Model) -> Plan:
    layout = NominalLayout(VARIABLES, (*model.derived, *model.held))
    return make_plan(model, layout, (), Discretisation(), {})


def moving_rows(plan: Plan) -> FloatArray:
    rng = np.random.default_rng(7)
    return plan.layout.complete(rng.normal(size=(5, plan.layout.provided)) + 3.0)


def lean_at(f_n: FloatArray) -> float:
    return float(np.tan(f_n[0] / f_n[2]))


def test_a_number_stands_for_a_derived_variable_of_fixed_numbers(coupled: Model, reference: Nominal) -> None:
    f = np.array([1.0, 2.0, 9.0])
    after, _ = FixNominal("f_n", (1.0, 2.0, 9.0)).apply(coupled, reference)
    plan = planned(after)
    assert plan.reason.endswith("Phi and Q are made once a segment"), plan.reason
    rate = 2.0 * lean_at(f) * reference["earth_rate_n"]
    rows = np.array([plan.layout.pack({**reference, "f_n": np.array([5.0, 5.0, 5.0])})])
    F = plan.F.evaluate(plan.layout.complete(rows))[0]
    skew = np.array([[0.0, -9.0, 2.0], [9.0, 0.0, -1.0], [-2.0, 1.0, 0.0]])
    np.testing.assert_allclose(F[0:3, 3:6], skew + lean_at(f) * np.eye(3), rtol=1e-15)
    np.testing.assert_allclose(F[3:6, 0:3], np.outer(rate, rate), rtol=1e-14)
    assert [d.name for d in after.held] == ["fixed.turned_rate"], "the tilt is a number, the Earth's rate is not"


def test_without_the_policy_the_same_terms_vary(coupled: Model) -> None:
    plan = planned(coupled)
    assert "lean needs tilt_of_f, which is varying" in plan.reason
    assert np.ptp(plan.F.evaluate(moving_rows(plan))[:, 0, 3]) > 0.0


def test_one_fixed_to_other_scalars_varies_as_these(coupled: Model, reference: Nominal) -> None:
    after, _ = FixNominal("f_n", ("gravity", 0.0, 9.0)).apply(coupled, reference)
    plan = planned(after)
    assert plan.time_invariant
    rows = moving_rows(plan)
    gravity = plan.layout.unpack(rows)["gravity"]
    np.testing.assert_allclose(plan.F.evaluate(rows)[:, 0, 3], np.tan(gravity / 9.0), rtol=1e-15)
    stepped = tuple(replace(v, changes="stepped") if v.name == "gravity" else v for v in VARIABLES)
    layout = NominalLayout(stepped, (*after.derived, *after.held))
    reason = make_plan(after, layout, (), Discretisation(), {}).reason
    assert "lean needs fixed.tilt_of_f, which is stepped" in reason


def test_the_derived_variable_itself_stays_the_providers(coupled: Model, reference: Nominal) -> None:
    after, _ = FixNominal("f_n", (0.0, 0.0, "gravity")).apply(coupled, reference)
    plan = planned(after)
    rows = moving_rows(plan)
    nominal = plan.layout.unpack(rows)
    np.testing.assert_allclose(nominal["tilt_of_f"], tilt(nominal["f_n"]), rtol=1e-15)
    np.testing.assert_allclose(nominal["fixed.tilt_of_f"], 0.0)


def test_the_last_word_holds_in_derived_variables(coupled: Model, reference: Nominal) -> None:
    once, _ = FixNominal("f_n", (1.0, 2.0, 9.0)).apply(coupled, reference)
    policies = [FixNominal("f_n", (4.0, 4.0, 4.0)), FixNominal("f_n", (1.0, 2.0, 9.0))]
    twice, _ = apply_policies(coupled, policies, reference)
    assert once == twice
    assert once.F.coefficient == twice.F.coefficient


def test_a_derived_variable_can_be_fixed_itself(coupled: Model, reference: Nominal) -> None:
    complete = {**reference, "tilt_of_f": tilt(reference["f_n"])}
    policies = [FixNominal("f_n", (1.0, 2.0, 9.0)), FixNominal("tilt_of_f", (0.25,))]
    after, _ = apply_policies(coupled, policies, complete)
    assert after.F.coefficient.evaluate(after.nominal(complete))[1, 4] == 0.25


def test_policies_after_it_see_the_fixed_value(coupled: Model, reference: Nominal) -> None:
    complete = {**reference, "tilt_of_f": np.array(0.0), "turned_rate": np.zeros(3)}
    after, _ = FixNominal("f_n", ("gravity", 0.0, "gravity")).apply(coupled, complete)
    _, change = DropTerm(("lean",)).apply(after, complete)
    assert change.measures[0].value == pytest.approx(np.tan(1.0), rel=1e-12)
    assert model_observability(after, complete).rank == 6


def test_a_function_that_fails_at_the_fixed_value_is_named(inertial: Inertial, reference: Nominal) -> None:
    def broken(f_n: FloatArray) -> FloatArray:
        return np.asarray(np.where(f_n[..., 0] == 1.0, np.nan, 0.0))

    term = ProcessTerm("lean", "v", "phi", scalar("broken") * identity(3), "n")
    model = inertial()
    model = model.with_parts(terms=(*model.terms, term), derived=(DerivedVariable("broken", (), ("f_n",), broken),))
    after, _ = FixNominal("f_n", (1.0, 0.0, 9.8)).apply(model, reference)
    with pytest.raises(PluginError, match=r"derived variable 'fixed\.broken' .* is nan"):
        _ = after.F
