"""fix_nominal puts constants for a variable in the error model; the provider goes on as it was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.coefficient import identity, vector
from estimfw.model.model import Model
from estimfw.model.parts import Measurement, MeasurementTerm
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.sequence import apply_policies

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
Nominal = dict[str, FloatArray]


def test_F_is_that_of_the_fixed_value_whatever_the_nominal(inertial: Inertial, reference: Nominal) -> None:
    model = inertial()
    after, _ = FixNominal("f_n", (0.0, 0.0, "gravity")).apply(model, reference)
    moving = {**reference, "f_n": np.array([1.0, 2.0, 3.0])}
    assert np.array_equal(after.F.coefficient.evaluate(moving), model.F.coefficient.evaluate(reference))
    assert "f_n" not in after.needs
    assert "gravity" in after.needs


def test_the_change_says_how_far_the_reference_is_from_it(inertial: Inertial, reference: Nominal) -> None:
    _, change = FixNominal("f_n", (0.1, 0.0, 9.5)).apply(inertial(), reference)
    assert change.kind == "approximate"
    assert change.measures[0].value == pytest.approx(0.3, rel=1e-12)


def test_the_last_word_holds(inertial: Inertial, reference: Nominal) -> None:
    model = inertial()
    once, _ = FixNominal("f_n", (0.0, 0.0, 9.7)).apply(model, reference)
    twice, _ = apply_policies(
        model, [FixNominal("f_n", (1.0, 2.0, 3.0)), FixNominal("f_n", (0.0, 0.0, 9.7))], reference
    )
    assert once == twice


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_variable_fixed_to_one_that_is_fixed_itself_gets_the_number(
    inertial: Inertial, reference: Nominal, order: tuple[int, int]
) -> None:
    policies = [FixNominal("f_n", (0.0, 0.0, "gravity")), FixNominal("gravity", (9.7,))]
    after, _ = apply_policies(inertial(), [policies[i] for i in order], reference)
    assert after.needs == {"C_bn", "earth_rate_n"}
    assert after.F.coefficient.evaluate(reference)[1, 3] == 9.7


def test_a_fixed_attitude_is_fixed_in_every_coefficient(inertial: Inertial, reference: Nominal) -> None:
    after, _ = FixNominal("C_bn", tuple(np.eye(3).ravel().tolist())).apply(inertial(), reference)
    assert np.array_equal(after.F.coefficient.evaluate(reference)[0:3, 6:9], np.eye(3))


def test_the_innovation_stays_the_providers(inertial: Inertial, reference: Nominal) -> None:
    """The reading is compared with what was really computed, not with what the error model assumes."""
    rows = ("E", "N", "U")
    m = Measurement(
        "force", rows, rows, "1", (MeasurementTerm("v", identity(3)),), tuple(map(tuple, np.eye(3).tolist())),
        "density", frame="n", innovation=vector("f_n"),
    )  # fmt: skip
    after, _ = FixNominal("f_n", (0.0, 0.0, "gravity")).apply(inertial(extra=[m]), reference)
    assert after.innovation("force").needs == {"f_n"}


def test_what_cannot_be_fixed_is_refused(inertial: Inertial, reference: Nominal) -> None:
    with pytest.raises(ConfigError, match="no nominal variable 'f_m'") as caught:
        FixNominal("f_m", (0.0,)).apply(inertial(), reference)
    assert "f_n" in str(caught.value)
    with pytest.raises(ConfigError, match=r"f_n has shape \(3,\), 2 values were given"):
        FixNominal("f_n", (0.0, 1.0)).apply(inertial(), reference)
    with pytest.raises(ConfigError, match="'C_bn' is no scalar variable"):
        FixNominal("f_n", (0.0, 0.0, "C_bn")).apply(inertial(), reference)
    with pytest.raises(ConfigError, match="'gravitation' is no scalar variable"):
        FixNominal("f_n", (0.0, 0.0, "gravitation")).apply(inertial(), reference)
