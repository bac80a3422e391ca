"""prune_unobservable deletes as many states as the rank is short of, the least determined first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.build import build_model
from estimfw.model.coefficient import constant
from estimfw.model.model import Model
from estimfw.model.parts import BlockParts, Measurement, MeasurementTerm, ProcessParts, ProcessTerm, StateBlock
from estimfw.policies.change import Policy
from estimfw.policies.drop_frame_rotation import DropFrameRotation
from estimfw.policies.express_in_frame import ExpressInFrame
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.prune_unobservable import PruneUnobservable, model_observability
from estimfw.policies.sequence import apply_policies

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
Nominal = dict[str, FloatArray]


def in_n(model: Model, reference: Nominal) -> Model:
    steps: list[Policy] = [FixNominal("f_n", (0.0, 0.0, "gravity"))]
    for block in ("a", "e"):
        steps += [ExpressInFrame(block, "n"), DropFrameRotation(block)]
    return apply_policies(model, steps, reference)[0]


def test_level_accelerometer_and_east_gyro_biases_go_and_the_rest_is_observable(
    inertial: Inertial, reference: Nominal
) -> None:
    after, change = PruneUnobservable(("phi",)).apply(in_n(inertial(), reference), reference)
    assert change.removed_states == ("a[E]", "a[N]", "e[E]")
    assert change.kind == "approximate"
    assert model_observability(after, reference).rank == len(after.states) == 9


def test_the_change_says_how_undetermined_each_was(inertial: Inertial, reference: Nominal) -> None:
    _, change = PruneUnobservable(("phi",)).apply(in_n(inertial(), reference), reference)
    assert [m.name.split()[0] for m in change.measures] == ["a[E]", "a[N]", "e[E]"]
    assert all(0.9 < m.value <= 1.0 for m in change.measures)


def test_what_is_protected_stays(inertial: Inertial, reference: Nominal) -> None:
    _, change = PruneUnobservable(("phi", "a[N]")).apply(in_n(inertial(), reference), reference)
    assert change.removed_states in (("a[E]", "e[E]", "e[N]"), ("a[E]", "e[E]", "e[U]"))
    with pytest.raises(ConfigError, match="unless a protected one goes"):
        PruneUnobservable(("phi", "a[E]")).apply(in_n(inertial(), reference), reference)


def test_too_much_protection_is_refused(inertial: Inertial, reference: Nominal) -> None:
    with pytest.raises(ConfigError, match=r"3 states must go \(rank 9 of 12\)") as caught:
        PruneUnobservable(("v", "phi", "a")).apply(in_n(inertial(), reference), reference)
    assert "protect fewer blocks" in str(caught.value)


def test_an_unknown_protection_names_the_nearest(inertial: Inertial, reference: Nominal) -> None:
    with pytest.raises(ConfigError, match="no state or block 'ph'") as caught:
        PruneUnobservable(("ph",)).apply(inertial(), reference)
    assert "'phi'" in str(caught.value)


def test_an_observable_model_is_left_as_it_is(inertial: Inertial, reference: Nominal) -> None:
    once, _ = PruneUnobservable(("phi",)).apply(in_n(inertial(), reference), reference)
    twice, change = PruneUnobservable(("phi",)).apply(once, reference)
    assert twice == once
    assert change.kind == "exact"


def test_the_noise_of_the_measurement_plays_no_part(inertial: Inertial, reference: Nominal) -> None:
    model = in_n(inertial(), reference)
    sharp = tuple(
        replace(m, covariance=((1e-12, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1e12))) for m in model.measurements
    )
    wanted = PruneUnobservable(("phi",)).apply(model, reference)[1].after
    assert PruneUnobservable(("phi",)).apply(model.with_parts(measurements=sharp), reference)[1].after == wanted


def driven(sigma_k: float, sigma_s: float) -> Model:
    """z = k + s with k constant and s' = q: the difference of k and s is not seen, q is."""

    def lone(name: str, sigma: float) -> BlockParts:
        return BlockParts(StateBlock(name, ("",), ("",), "1"), ((sigma**2,),), (0.0,))

    reads = (MeasurementTerm("k", constant([[1.0]])), MeasurementTerm("s", constant([[1.0]])))
    return build_model(
        [lone("k", sigma_k), lone("q", 1.0), lone("s", sigma_s)],
        [ProcessParts((ProcessTerm("drive", "s", "q", constant([[1.0]])),))],
        [Measurement("z", ("",), ("",), "1", reads, ((1.0,),), "density")],
    )


def test_a_constant_is_deleted_for_the_driven_state_that_stays() -> None:
    after, change = PruneUnobservable().apply(driven(1.0, 10.0), {})
    assert change.removed_states == ("k",)
    assert model_observability(after, {}).rank == 2


def test_a_driven_state_whose_loss_hides_what_drives_it_stays_however_undetermined() -> None:
    """With s gone, nothing tells of q: k goes, although s is less determined."""
    after, change = PruneUnobservable().apply(driven(10.0, 1.0), {})
    assert change.removed_states == ("k",)
    assert model_observability(after, {}).rank == 2
    with pytest.raises(ConfigError, match="unless a protected one goes: k"):
        PruneUnobservable(("k",)).apply(driven(10.0, 1.0), {})
