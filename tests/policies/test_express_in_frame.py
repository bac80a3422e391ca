"""express_in_frame is a change of coordinates: everything the model says stays true in the new ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm
from scipy.spatial.transform import Rotation

from estimfw.errors import ConfigError
from estimfw.model.coefficient import constant, identity
from estimfw.model.model import Model
from estimfw.model.parts import Measurement, MeasurementTerm, NoiseInput, ProcessTerm
from estimfw.policies.change import Policy
from estimfw.policies.drop_frame_rotation import DropFrameRotation
from estimfw.policies.drop_states import DropStates
from estimfw.policies.express_in_frame import ExpressInFrame
from estimfw.policies.sequence import Sequential, apply_policies

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]
Nominal = dict[str, FloatArray]


def turned(model: Model, reference: Nominal, *steps: tuple[str, str]) -> Model:
    for block, frame in steps:
        model, _ = ExpressInFrame(block, frame).apply(model, reference)
    return model


@pytest.fixture
def swaying(reference: Nominal) -> Nominal:
    return {**reference, "omega_nb_n": np.array([0.1, -0.2, 0.3]), "omega_bs_b": np.array([0.05, 0.4, -0.1])}


def test_F_is_the_derivative_of_the_states_in_the_new_frame(inertial: Inertial, swaying: Nominal) -> None:
    """x_new = T(t) x: F_new = T F T^-1 + T' T^-1, with T' by finite difference of a turning body."""
    model = inertial()
    after = turned(model, swaying, ("a", "n"), ("e", "n"))
    C, h = swaying["C_bn"], 1e-5

    def T(t: float) -> FloatArray:
        C_t = Rotation.from_rotvec(swaying["omega_nb_n"] * t).as_matrix() @ C
        return np.asarray(block_diag(np.eye(6), C_t, C_t))

    T_rate = (T(h) - T(-h)) / (2.0 * h)
    F = model.F.coefficient.evaluate(swaying)
    wanted = T(0.0) @ F @ T(0.0).T + T_rate @ T(0.0).T
    assert np.allclose(after.F.coefficient.evaluate(swaying), wanted, atol=1e-10)


def test_H_and_the_prior_turn_with_the_block(inertial: Inertial, reference: Nominal) -> None:
    rows = ("1", "2", "3")
    shape = constant([[1.0, 2.0, 0.0], [0.0, 1.0, -1.0], [3.0, 0.0, 1.0]])
    m = Measurement(
        "lab", rows, rows, "1", (MeasurementTerm("e", shape),), tuple(map(tuple, np.eye(3).tolist())), "density"
    )
    model = inertial(gyro_sigma=(1.0, 2.0, 3.0), extra=[m])
    after = turned(model, reference, ("e", "n"))
    C = reference["C_bn"]
    H = after.H("lab").coefficient.evaluate(reference)
    assert np.allclose(
        H[:, 9:], shape.evaluate({}) @ C.T, atol=1e-15
    )  # rows without a frame read the block as declared
    covariance = after.prior.evaluate(reference)[1][9:, 9:]
    assert np.allclose(covariance, C @ np.diag([1.0, 4.0, 9.0]) @ C.T, atol=1e-14)


def test_a_term_that_names_no_frame_acts_where_its_blocks_were_declared(inertial: Inertial, reference: Nominal) -> None:
    decay = constant(np.diag([-0.1, -0.2, -0.3]))
    model = inertial()
    drive = NoiseInput("we.own", ("R", "F", "U"), ("R", "F", "U"), (1.0, 2.0, 3.0), "1", frame="b")
    terms = (*model.terms, ProcessTerm("decay", "e", "e", decay), ProcessTerm("drive", "e", "we.own", identity(3)))
    after = turned(model.with_parts(terms=terms, noises=(*model.noises, drive)), reference, ("e", "n"))
    C = reference["C_bn"]
    assert np.allclose(after.F.coefficient.evaluate(reference)[9:, 9:], C @ decay.evaluate({}) @ C.T, atol=1e-15)
    noise = after.diffusion.evaluate(reference)[9:, 9:]
    assert np.allclose(noise, C @ np.diag([1.0, 2.0, 3.0]) @ C.T, atol=1e-15)


def test_the_dependence_on_the_attitude_disappears_by_itself(inertial: Inertial, reference: Nominal) -> None:
    after = turned(inertial(), reference, ("a", "n"), ("e", "n"))
    after = after.with_parts(terms=tuple(t for t in after.terms if not t.label.endswith("frame_rotation")))
    assert "C_bn" not in after.needs


def test_with_an_anisotropic_noise_it_stays_and_is_seen_on_the_diffusion(
    inertial: Inertial, reference: Nominal
) -> None:
    after = turned(inertial(gyro_psd=(1.0, 2.0, 3.0)), reference, ("a", "n"), ("e", "n"))
    assert after.diffusion.needs == {"C_bn"}
    C = reference["C_bn"]
    assert np.allclose(after.diffusion.evaluate(reference)[3:6, 3:6], C @ np.diag([1.0, 2.0, 3.0]) @ C.T, atol=1e-14)
    assert "C_bn" not in turned(inertial(), reference, ("a", "n"), ("e", "n")).diffusion.needs


def test_the_change_is_exact_and_carries_the_map(inertial: Inertial, reference: Nominal) -> None:
    _, change = ExpressInFrame("a", "n").apply(inertial(), reference)
    assert change.kind == "exact"
    assert change.removed_states == change.removed_terms == change.removed_noises == ()
    assert change.after[6:9] == ("a[E]", "a[N]", "a[U]")
    assert np.allclose(change.map.evaluate(reference), block_diag(np.eye(6), reference["C_bn"], np.eye(3)), atol=0.0)


def test_there_and_back_is_the_same_model(inertial: Inertial, swaying: Nominal) -> None:
    model = inertial()
    back = turned(model, swaying, ("a", "n"), ("a", "b"))
    assert back.F == model.F
    assert back.diffusion == model.diffusion
    assert back.terms == model.terms
    assert np.allclose(back.prior.evaluate(swaying)[1], model.prior.evaluate(swaying)[1], atol=1e-15)


def test_a_dropped_rotation_does_not_come_back_with_the_frame(inertial: Inertial, swaying: Nominal) -> None:
    """Held constant in n, the block seen from b turns against it."""
    policies: list[Policy] = [ExpressInFrame("a", "n"), DropFrameRotation("a"), ExpressInFrame("a", "b")]
    after, _ = apply_policies(inertial(), policies, swaying)
    own = after.F.coefficient.evaluate(swaying)[6:9, 6:9]
    C, w = swaying["C_bn"], swaying["omega_nb_n"]
    cross = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    assert np.allclose(own, -C.T @ cross @ C, atol=1e-15)


def test_two_frame_changes_add_their_rates(inertial: Inertial, swaying: Nominal) -> None:
    """a is constant in b; declared in b, taken to n it turns with b. From s by way of b it would turn with both."""
    model = inertial()
    there = turned(model, swaying, ("a", "s"))
    assert np.allclose(
        turned(there, swaying, ("a", "b"), ("a", "n")).F.coefficient.evaluate(swaying),
        turned(model, swaying, ("a", "n")).F.coefficient.evaluate(swaying),
        atol=1e-15,
    )
    housing = turned(model, swaying, ("a", "n"), ("a", "b"), ("a", "s")).F.coefficient.evaluate(swaying)
    assert np.allclose(housing, there.F.coefficient.evaluate(swaying), atol=1e-15)


def test_a_constant_in_b_stays_itself_over_a_turn(inertial: Inertial, swaying: Nominal) -> None:
    """Integrate a' = [omega x] a over a steady turn: the vector in n is the body's vector, turned."""
    after = turned(inertial(), swaying, ("a", "n"))
    own = after.F.coefficient.evaluate(swaying)[6:9, 6:9]
    a_b = np.array([1.0, -2.0, 0.5])
    C_later = Rotation.from_rotvec(swaying["omega_nb_n"] * 7.0).as_matrix() @ swaying["C_bn"]
    assert np.allclose(expm(own * 7.0) @ swaying["C_bn"] @ a_b, C_later @ a_b, atol=1e-13)


def test_dropping_the_rotation_costs_the_turn_times_sigma(inertial: Inertial, swaying: Nominal) -> None:
    known = {**swaying, "turn_angle_b": np.array(np.radians(4.0))}
    model = turned(inertial(gyro_sigma=(5e-8, 5e-8, 7e-8)), known, ("e", "n"))
    after, change = DropFrameRotation("e").apply(model, known)
    assert change.kind == "approximate"
    assert change.removed_terms == ("e.frame_rotation",)
    largest = np.sqrt(np.diag(model.prior.evaluate(known)[1])[9:].max())
    assert change.measures[0].value == pytest.approx(largest * np.radians(4.0), rel=1e-14)
    assert not np.any(after.F.coefficient.evaluate(known)[9:, 9:])


def test_without_a_known_turn_the_price_is_given_by_the_degree(inertial: Inertial, swaying: Nominal) -> None:
    _, change = DropFrameRotation("e").apply(turned(inertial(), swaying, ("e", "n")), swaying)
    assert change.measures[0].value == pytest.approx(5e-8 * np.pi / 180.0, rel=1e-14)
    assert "per degree" in change.measures[0].name


def test_on_a_base_that_does_not_turn_it_costs_nothing(inertial: Inertial, reference: Nominal) -> None:
    still = {**reference, "turn_angle_b": np.array(0.0)}
    _, change = DropFrameRotation("e").apply(turned(inertial(), still, ("e", "n")), still)
    assert change.kind == "exact"
    assert change.measures[0].value == 0.0


def test_the_noise_of_a_turned_block_is_not_reported_as_removed(inertial: Inertial, reference: Nominal) -> None:
    model = inertial()
    walk = NoiseInput("walk", ("R", "F", "U"), ("R", "F", "U"), (1.0,) * 3, "1", frame="b")
    terms = (*model.terms, ProcessTerm("walking", "e", "walk", identity(3), frame="b"))
    wide = model.with_parts(terms=terms, noises=(*model.noises, walk))
    after, change = ExpressInFrame("e", "n").apply(wide, reference)
    assert change.removed_noises == ()
    assert after.G.columns[-3:] == ("walk[E]", "walk[N]", "walk[U]")


def test_a_block_that_has_lost_an_axis_is_refused_with_the_right_order(inertial: Inertial, reference: Nominal) -> None:
    bias_in_n = Sequential("to_n", (ExpressInFrame("a", "n"), DropFrameRotation("a")), "")
    flat = Sequential("flat", (DropStates(("v[U]", "a[U]")),), "")
    with pytest.raises(ConfigError, match=r"policy 'to_n': block 'a' has already lost a\[U\]") as caught:
        apply_policies(inertial(), [flat, bias_in_n], reference)
    assert caught.value.hint == "put 'to_n' before 'flat'"


def test_other_impossible_frames_are_refused(inertial: Inertial, reference: Nominal) -> None:
    with pytest.raises(ConfigError, match="there is no frame 'm'"):
        ExpressInFrame("a", "m").apply(inertial(), reference)
    with pytest.raises(ConfigError, match="block 'aa' is not there") as caught:
        apply_policies(inertial(), [ExpressInFrame("aa", "n")], reference)
    assert "did you mean 'a'" in str(caught.value)


def test_a_block_that_was_dropped_whole_names_the_order_too(inertial: Inertial, reference: Nominal) -> None:
    with pytest.raises(ConfigError, match=r"block 'a' has already lost a\[R\], a\[F\], a\[U\]") as caught:
        apply_policies(inertial(), [DropStates(("a",)), ExpressInFrame("a", "n")], reference)
    assert caught.value.hint == "put 'express_in_frame a in n' before 'drop_states a'"


def test_the_frame_it_has_already_changes_nothing(inertial: Inertial, reference: Nominal) -> None:
    model = inertial()
    after, change = ExpressInFrame("a", "b").apply(model, reference)
    assert after == model
    assert change.kind == "exact"
