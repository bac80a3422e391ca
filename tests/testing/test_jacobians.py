"""The check of H against finite differences passes where H is right, on a manifold too, and says where it is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from estimfw.config.compose import Problem
from estimfw.errors import PluginError
from estimfw.model.coefficient import Coefficient, constant, matrix, skew
from estimfw.model.model import Model
from estimfw.model.parts import Measurement, MeasurementTerm
from estimfw.plan.layout import NominalLayout
from estimfw.plan.plan import make_plan
from estimfw.testing import check_jacobians, check_provider

Example = Callable[..., Problem]
ARM = (0.3, 1.2, -0.4)
SWAY = ("policies=[]", "source.sway={amplitude: [1 deg, 2 deg, 3 deg], period: 4 s}", "source.rate=10 Hz")


def planned(problem: Problem, model: Model) -> Problem:
    layout = NominalLayout(problem.plan.layout.variables, (*model.derived, *model.held))
    plan = make_plan(model, layout, problem.provider.slots, problem.plan.discretisation, {})
    return replace(problem, model=model, plan=plan)


def with_baseline(problem: Problem, H: Coefficient) -> Problem:
    """Two antennas: the baseline C_bn l, whose derivative on the rotations is [(C l) x]."""
    still = problem.model.measurement("zero_velocity")
    compass: Measurement = replace(
        still, name="compass", terms=(MeasurementTerm("attitude_error", H),), innovation=matrix("C_bn") @ constant(ARM)
    )
    return planned(problem, problem.model.with_parts(measurements=(still, compass)))


def test_a_right_h_passes_on_the_rotations(example: Example) -> None:
    C = matrix("C_bn")
    check_jacobians(with_baseline(example("static_12", *SWAY), C @ skew(ARM) @ C.T), tolerance=1e-9)


@pytest.mark.parametrize("factor", [-1.0, 1.0 + 1e-6])
def test_a_wrong_sign_or_digit_is_found(example: Example, factor: float) -> None:
    C = matrix("C_bn")
    problem = with_baseline(example("static_12", *SWAY), (C @ skew(ARM) @ C.T) * factor)
    with pytest.raises(AssertionError, match=r"compass\[.\]: H over attitude_error\[.\] is .* finite differences"):
        check_jacobians(problem)


def test_the_strapdown_tells_how_far_two_of_its_states_are_apart(example: Example) -> None:
    check_provider(example("static_12", *SWAY))


def test_ranges_and_directions_pass_to_the_last_digits(boat: Example) -> None:
    check_jacobians(boat("source.duration=5 s"), tolerance=1e-10)


def test_a_provider_without_difference_is_told_what_it_is(boat: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    import range_beacon.dead_reckoning as own  # type: ignore[import-not-found]

    problem = boat("source.duration=5 s")
    monkeypatch.delattr(own.BoundDeadReckoning, "difference")
    with pytest.raises(PluginError, match="no `difference"):
        check_jacobians(problem)
