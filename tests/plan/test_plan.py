"""The plan: found time invariance with its reason, a hash without data, index maps that agree with the model."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from estimfw.errors import ConfigError
from estimfw.model.coefficient import identity, matrix, scalar, skew
from estimfw.model.model import Model
from estimfw.model.parts import ProcessTerm
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import Plan
from estimfw.policies.drop_frame_rotation import DropFrameRotation
from estimfw.policies.drop_states import DropStates
from estimfw.policies.express_in_frame import ExpressInFrame

FloatArray = NDArray[np.float64]
Make = Callable[..., Model]
Lower = Callable[..., Plan]
BIAS = ProcessTerm("bias", "v", "a", identity(3), "n")


def some_rows(layout: NominalLayout) -> FloatArray:
    return layout.complete(np.random.default_rng(4).normal(size=(6, layout.provided)))


# -- time invariance ---------------------------------------------------------------------------------------------------


def test_constant_coefficients_make_a_time_invariant_plan(model: Make, plan: Lower, decay: ProcessTerm) -> None:
    made = plan(model([decay]))
    assert made.time_invariant
    assert "no live coefficient needs a varying nominal variable" in made.reason


def test_a_varying_coefficient_is_named_with_its_variable(model: Make, plan: Lower) -> None:
    made = plan(model([BIAS]))
    assert not made.time_invariant
    assert made.reason == "bias needs C_bn, which is varying"


def test_a_stepped_variable_is_told_as_stepped(model: Make, plan: Lower) -> None:
    turn = ProcessTerm("turn", "phi", "phi", scalar("heading_step") * identity(3), "n")
    assert plan(model([turn])).reason == "turn needs heading_step, which is stepped"


def test_a_derived_variable_varies_as_what_it_is_made_of(model: Make, plan: Lower) -> None:
    drag = ProcessTerm("drag", "v", "v", scalar("speed") * identity(3), "n")
    assert plan(model([drag])).reason == "drag needs speed, which is varying"


def test_an_isotropic_noise_does_not_make_it_vary_but_an_anisotropic_one_does(model: Make, plan: Lower) -> None:
    assert plan(model(psd=(2.0, 2.0, 2.0))).time_invariant
    assert plan(model(psd=(1.0, 2.0, 3.0))).reason == "drive needs C_bn, which is varying"


def test_a_varying_measurement_makes_it_vary(model: Make, plan: Lower) -> None:
    assert plan(model(H="varying")).reason == "measurement z needs C_bn, which is varying"


def test_the_innovation_may_vary_without_touching_the_gains(model: Make, plan: Lower) -> None:
    made = plan(model())
    assert made.measurements[0].innovation.monomials
    assert made.time_invariant


def test_policies_make_it_time_invariant_by_themselves(model: Make, plan: Lower) -> None:
    reference = {"C_bn": np.eye(3), "gravity": np.array(9.8)}
    full = model([BIAS])
    in_n = DropFrameRotation("a").apply(ExpressInFrame("a", "n").apply(full, reference)[0], reference)[0]
    assert plan(in_n).time_invariant
    assert plan(DropStates(("a",)).apply(full, reference)[0]).time_invariant


# -- hash, equality, pickling ------------------------------------------------------------------------------------------


def test_equal_models_make_equal_plans_with_one_hash(model: Make, plan: Lower) -> None:
    first, second = plan(model([BIAS])), plan(model([BIAS]))
    assert first == second
    assert first.hash == second.hash
    assert hash(first) == hash(second)


@pytest.mark.parametrize(
    "change",
    [
        lambda p: replace(p, discretisation=Discretisation("series")),
        lambda p: replace(p, states=(*p.states[:-1], "other")),
        lambda p: replace(p, measurements=(replace(p.measurements[0], gate=0.99),)),
        lambda p: replace(p, measurements=(replace(p.measurements[0], density=True),)),
        lambda p: replace(p, correction=replace(p.correction, monomials=p.correction.monomials[1:])),
        lambda p: replace(p, prior=p.prior.select(range(8))),
    ],
)
def test_whatever_is_changed_changes_the_hash(model: Make, plan: Lower, change: Callable[[Plan], Plan]) -> None:
    made = plan(model([BIAS]))
    assert change(made) != made
    assert change(made).hash != made.hash


def test_a_noise_or_a_coefficient_changes_the_hash(model: Make, plan: Lower) -> None:
    made = plan(model([BIAS]))
    assert plan(model([BIAS], psd=(1.0, 1.0, 1.0 + 1e-15))).hash != made.hash
    assert plan(model([BIAS], sigma=0.2)).hash != made.hash
    assert plan(model([replace(BIAS, coefficient=2.0 * identity(3))])).hash != made.hash
    assert plan(model([replace(BIAS, label="renamed")])).hash != made.hash  # the reason it varies names it


def test_equal_numbers_hash_alike_whatever_their_type(model: Make, plan: Lower) -> None:
    made = plan(model())
    zeros = tuple(tuple(-0.0 if x == 0.0 else float(np.float64(x)) for x in row) for row in made.measurements[0].R)
    same = replace(made, measurements=(replace(made.measurements[0], R=zeros, gate=None),))
    assert same == made
    assert same.hash == made.hash
    numpy_like = replace(made, measurements=(replace(made.measurements[0], sign=np.float64(-1.0)),))
    assert numpy_like.hash == made.hash


def test_a_plan_survives_pickling(model: Make, plan: Lower) -> None:
    made = plan(model([BIAS]))
    back = pickle.loads(pickle.dumps(made))
    assert back == made
    assert back.hash == made.hash


def test_the_hash_is_the_same_in_another_process() -> None:
    """No address, no hash seed, no order of a set gets in."""
    code = "from estimfw.run.from_python import open_filter; import sys;print(open_filter(sys.argv[1]).plan.hash)"
    example = Path(__file__).parents[2] / "examples" / "tracker.yaml"
    hashes = set()
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", code, str(example)], capture_output=True, text=True, check=True,
            env={"PYTHONHASHSEED": seed},
        )  # fmt: skip
        hashes.add(done.stdout.strip())
    assert len(hashes) == 1
    assert len(hashes.pop()) == 64


# -- lowering ----------------------------------------------------------------------------------------------------------


def test_the_lowered_coefficients_are_worth_what_the_model_says(
    model: Make, plan: Lower, layout: NominalLayout
) -> None:
    turn = ProcessTerm("turn", "phi", "phi", scalar("speed") * skew("velocity_n"), "n")
    source = model([BIAS, turn], psd=(1.0, 2.0, 3.0), H="varying")
    made, rows = plan(source), some_rows(layout)
    nominal = layout.unpack(rows)
    assert np.allclose(made.F.evaluate(rows), source.F.coefficient.evaluate(nominal), rtol=1e-13)
    assert np.allclose(made.D.evaluate(rows), source.diffusion.evaluate(nominal), rtol=1e-12)
    z = made.measurements[0]
    assert np.allclose(z.H.evaluate(rows), source.H("z").coefficient.evaluate(nominal), rtol=1e-13)
    assert np.allclose(z.innovation.evaluate(rows), source.innovation("z").evaluate(nominal), rtol=1e-13)


def test_the_tables_of_a_kernel_say_the_same(model: Make, plan: Lower, layout: NominalLayout) -> None:
    made = plan(model([BIAS, ProcessTerm("square", "v", "phi", matrix("C_bn") @ skew("velocity_n"), "n")]))
    tables, row = made.F.tables(), some_rows(layout)[0]
    flat = np.zeros(81)
    padded = np.append(row, 1.0)
    for entry, number, factors in zip(*tables, strict=True):
        flat[entry] += number * np.prod(padded[factors])
    assert np.allclose(flat.reshape(9, 9), made.F.evaluate(row), rtol=1e-14)


def test_rows_are_packed_and_unpacked_by_name(layout: NominalLayout) -> None:
    nominal = {
        "C_bn": np.arange(9.0).reshape(3, 3), "velocity_n": np.array([3.0, 0.0, 4.0]), "gravity": np.array(9.8),
        "heading_step": np.array(0.1),
    }  # fmt: skip
    row = layout.complete(layout.pack(nominal))
    assert row.shape == (layout.size,) == (15,)
    back = layout.unpack(row)
    assert all(np.array_equal(back[n], v) for n, v in nominal.items())
    assert back["speed"] == 5.0
    assert row[layout.position("C_bn", (1, 2))] == 5.0
    assert row[layout.position("speed", ())] == 5.0


def test_a_variable_that_the_provider_does_not_make_is_named(model: Make, plan: Lower) -> None:
    wrong = ProcessTerm("wrong", "v", "phi", skew("velocity_m"), "n")
    with pytest.raises(ConfigError, match="needs the nominal variable 'velocity_m'") as caught:
        plan(model([wrong]))
    assert "velocity_n" in str(caught.value)
    assert "fix_nominal" in str(caught.value)


def test_states_with_a_slot_are_those_that_are_reset(model: Make, plan: Lower) -> None:
    assert plan(model()).corrected == (True,) * 6 + (False,) * 3
    flat = plan(DropStates(("v[N]", "phi[E]")).apply(model(), {"gravity": np.array(9.8)})[0])
    assert flat.corrected == (True,) * 4 + (False,) * 3
    assert flat.correction.shape == (6, 7)


def test_the_gate_is_a_quantile_of_chi_square_for_what_is_usable(model: Make, plan: Lower) -> None:
    made = plan(model(), gate=0.99)
    thresholds = made.thresholds(made.measurements[0])
    assert thresholds is not None
    assert np.allclose(thresholds[1:], chi2.ppf(0.99, [1, 2, 3]), rtol=1e-12)
    open_gate = plan(model())
    assert open_gate.thresholds(open_gate.measurements[0]) is None


def test_a_plan_discretises_rows_as_single_ones(model: Make, plan: Lower, layout: NominalLayout) -> None:
    """A chunk of a record, or a chunk of one: the same matrices."""
    made, rows = plan(model([BIAS], psd=(1.0, 2.0, 3.0))), some_rows(layout)
    u, dt = np.zeros((6, 0)), np.full(6, 0.1)
    stacked = made.discretised(rows, u, dt, 0)
    for k in range(6):
        for many, one in zip(stacked, made.discretised(rows[k], u[k], dt[k], 0), strict=True):
            assert np.allclose(many[k], one, rtol=1e-12, atol=1e-15)
