"""A named policy made of others: its map is the product of theirs, its kind the worst."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.policies.change import Policy
from estimfw.policies.drop_states import DropStates
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.express_in_frame import ExpressInFrame
from estimfw.policies.sequence import Sequential, apply_policies

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
Nominal = dict[str, FloatArray]
FLAT_IN_N = Sequential("flat_in_n", (ExpressInFrame("a", "n"), DropStates(("v[U]", "a[U]"))), "whenever")


def test_the_map_takes_the_states_before_to_the_states_after(inertial: Inertial, reference: Nominal) -> None:
    after, change = FLAT_IN_N.apply(inertial(), reference)
    C = np.eye(12)
    C[6:9, 6:9] = reference["C_bn"]
    kept = [0, 1, 3, 4, 5, 6, 7, 9, 10, 11]
    assert np.allclose(change.map.evaluate(reference), C[kept], atol=0.0)
    assert change.after == after.states


def test_a_body_state_that_lives_on_in_others_is_not_removed(inertial: Inertial, reference: Nominal) -> None:
    """On a tilted base each of a[R], a[F], a[U] has its part in a[E] and a[N]."""
    assert FLAT_IN_N.apply(inertial(), reference)[1].removed_states == ("v[U]",)


def test_the_kind_is_the_worst_of_the_steps_unless_it_is_said(inertial: Inertial, reference: Nominal) -> None:
    exact = ExpressInFrame("a", "n")
    mirrored = DropTerm(("coriolis",), mirrored=True)
    approximate = DropTerm(("gravity_tilt",))
    kinds = {
        steps: Sequential("p", steps, "").apply(inertial(), reference)[1].kind
        for steps in ((), (exact,), (exact, mirrored), (mirrored, exact), (mirrored, approximate))
    }
    assert list(kinds.values()) == ["exact", "exact", "mirrored", "mirrored", "approximate"]
    assert Sequential("p", (approximate,), "", "mirrored").apply(inertial(), reference)[1].kind == "mirrored"


def test_the_steps_are_kept_with_their_numbers(inertial: Inertial, reference: Nominal) -> None:
    _, change = FLAT_IN_N.apply(inertial(), reference)
    assert [c.policy for c in change.steps] == ["express_in_frame a in n", "drop_states v[U], a[U]"]
    assert [m.value for m in change.measures] == [m.value for c in change.steps for m in c.measures]


def test_as_json_tells_all(inertial: Inertial, reference: Nominal) -> None:
    told = DropStates(("v[U]",)).apply(inertial(), reference)[1].as_json()
    assert told["label"] == "drop_states v[U]"
    assert told["removed_states"] == ["v[U]"]
    assert told["removed_rows"] == ["z[U]"]
    assert told["removed_noises"] == ["wa[U]"]
    assert told["before"] == list(inertial().states)
    number = told["number"]
    assert isinstance(number, dict)
    assert number["unit"] == "1/s"


def test_the_first_policy_that_does_not_apply_is_named(inertial: Inertial, reference: Nominal) -> None:
    policies: list[Policy] = [DropTerm(("coriolis",)), Sequential("again", (DropTerm(("coriolis",)),), "")]
    with pytest.raises(ConfigError, match="policy 'drop_term coriolis': the model has no process term 'coriolis'"):
        apply_policies(inertial(), policies, reference)


def test_a_policy_is_a_value_and_leaves_the_model_alone(inertial: Inertial, reference: Nominal) -> None:
    model = inertial()
    first, second = (FLAT_IN_N.apply(model, reference)[0] for _ in range(2))
    assert first == second
    assert model == inertial()
    assert hash(FLAT_IN_N) == hash(Sequential("flat_in_n", FLAT_IN_N.steps, "whenever"))
