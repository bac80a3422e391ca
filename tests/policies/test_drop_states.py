"""drop_states leaves rows and columns of what was there, the marginal of the prior, and nothing idle."""

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
from estimfw.model.parts import BlockParts, Measurement, MeasurementTerm, StateBlock
from estimfw.policies.drop_states import DropStates

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
KEPT = [0, 1, 3, 4, 5, 6, 7, 9, 10, 11]


def scalars(reads: dict[str, float]) -> Model:
    """Two lone constants m and k, of sigmas 1 and 3; z of variance 4 reads them with these factors."""
    blocks = [
        BlockParts(StateBlock(name, ("",), ("",), "1"), ((sigma**2,),), (0.0,))
        for name, sigma in (("m", 1.0), ("k", 3.0))
    ]
    terms = tuple(MeasurementTerm(name, constant([[factor]])) for name, factor in reads.items())
    return build_model(blocks, measurements=[Measurement("z", ("",), ("",), "1", terms, ((4.0,),), "per_measurement")])


def drop(model: Model, reference: dict[str, FloatArray], *states: str) -> Model:
    return DropStates(states).apply(model, reference)[0]


def test_what_is_left_are_rows_and_columns_to_the_last_bit(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    model = inertial(gyro_psd=(1e-14, 2e-14, 3e-14))
    after = drop(model, reference, "v[U]", "a[U]")
    assert after.states == tuple(model.states[i] for i in KEPT)
    both = np.ix_(KEPT, KEPT)
    assert np.array_equal(after.F.coefficient.evaluate(reference), model.F.coefficient.evaluate(reference)[both])
    assert np.array_equal(after.diffusion.evaluate(reference), model.diffusion.evaluate(reference)[both])
    assert np.array_equal(after.prior.evaluate(reference)[1], model.prior.evaluate(reference)[1][both])
    assert np.array_equal(after.H("z").coefficient.evaluate(reference), np.eye(2, 10))
    assert np.array_equal(after.R("z"), np.diag([0.01, 0.02]))


def test_rows_and_noises_without_states_go_too(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    after, change = DropStates(("v[U]",)).apply(inertial(), reference)
    assert change.removed_states == ("v[U]",)
    assert change.removed_rows == ("z[U]",)
    assert change.removed_noises == ("wa[U]",)
    assert after.measurement("z").rows == ("E", "N")


def test_an_anisotropic_noise_still_reaches_every_axis_that_stays(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    """In b, on a tilted base, no axis of it is idle."""
    after, change = DropStates(("v[U]",)).apply(inertial(accel_psd=(1e-8, 2e-8, 3e-8)), reference)
    assert change.removed_noises == ()
    assert after.G.columns[:3] == ("wa[R]", "wa[F]", "wa[U]")


def test_a_whole_block_goes_by_its_name_with_its_terms(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    after, change = DropStates(("a",)).apply(inertial(), reference)
    assert change.removed_states == ("a[R]", "a[F]", "a[U]")
    assert change.removed_terms == ("accel_bias_coupling",)
    assert [b.name for b in after.blocks] == ["v", "phi", "e"]


def test_states_together_or_one_after_the_other_are_the_same(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    model = inertial()
    together = drop(model, reference, "v[U]", "a[U]")
    assert together == drop(drop(model, reference, "v[U]"), reference, "a[U]")
    assert together == drop(drop(model, reference, "a[U]"), reference, "v[U]")


def test_the_map_takes_the_states_that_stay(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    _, change = DropStates(("v[U]", "a[U]")).apply(inertial(), reference)
    assert np.array_equal(change.map.evaluate({}), np.eye(12)[KEPT])


def test_the_price_is_the_coupling_of_what_is_dropped(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    """A bias of 1e-3 m/s^2 drives v at 1e-3 per second, a hundredth of its sigma of 0.1."""
    level = {**reference, "C_bn": np.eye(3)}
    _, change = DropStates(("a",)).apply(inertial(), level)
    assert change.kind == "approximate"
    assert change.measures[0].value == pytest.approx(1e-3 / 0.1, rel=1e-14)


def test_a_coupling_that_is_zero_at_this_attitude_alone_is_not_called_exact(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    """At C = I the body's vertical bias does not reach the level channels; the Earth turns the body, so it will."""
    level = {**reference, "C_bn": np.eye(3), "earth_rate_n": np.zeros(3)}
    _, change = DropStates(("v[U]", "a[U]")).apply(inertial(), level)
    assert change.measures[0].value == 0.0
    assert change.kind == "approximate"


def test_states_that_act_on_nothing_are_dropped_exactly() -> None:
    model = scalars(reads={"m": 1.0})
    assert DropStates(("k",)).apply(model, {})[1].kind == "exact"


def test_a_dropped_state_that_a_row_reads_is_priced_in_sigmas_of_its_noise() -> None:
    after, change = DropStates(("k",)).apply(scalars(reads={"m": 1.0, "k": 2.0}), {})
    assert change.kind == "approximate"
    assert change.measures[1].value == pytest.approx(2.0 * 3.0 / 2.0, rel=1e-15)
    assert after.measurement("z").rows == ("",)


def test_a_correlated_noise_keeps_the_covariance_of_the_rows_that_stay(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    model = inertial()
    full = ((4.0, 1.0, 0.5), (1.0, 3.0, 0.2), (0.5, 0.2, 2.0))
    m = model.measurement("z")
    after = drop(model.with_parts(measurements=(replace(m, covariance=full),)), reference, "v[N]")
    assert np.array_equal(after.R("z"), [[4.0, 0.5], [0.5, 2.0]])


def test_the_correlations_of_the_prior_stay_with_the_states_that_stay() -> None:
    blocks = [BlockParts(StateBlock(n, ("",), ("",), "1"), ((4.0,),), (1.0,)) for n in "xyz"]
    read = [Measurement("m", ("",), ("",), "1", (MeasurementTerm("x", constant([[1.0]])),), ((1.0,),), "density")]
    model = build_model(blocks, measurements=read, correlations={("x", "z"): 0.5, ("x", "y"): 0.1})
    mean, covariance = drop(model, {}, "y").prior.evaluate({})
    assert covariance.tolist() == [[4.0, 2.0], [2.0, 4.0]]
    assert mean.tolist() == [1.0, 1.0]


def test_an_unknown_state_names_the_nearest(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    with pytest.raises(ConfigError, match=r"no state or block 'phi\[u\]'") as caught:
        DropStates(("phi[u]",)).apply(inertial(), reference)
    assert "phi[U]" in str(caught.value)


def test_the_last_state_and_the_last_measured_state_stay(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    with pytest.raises(ConfigError, match="no state would be left"):
        DropStates(("v", "phi", "a", "e")).apply(inertial(), reference)
    with pytest.raises(ConfigError, match="no measurement would be left"):
        DropStates(("v",)).apply(inertial(), reference)
