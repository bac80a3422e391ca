"""F, G, Q, H and B against matrices put together by hand."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.model.build import build_model
from estimfw.model.coefficient import constant, identity, skew
from estimfw.model.model import Model
from estimfw.model.parts import (
    BlockParts,
    KnownInput,
    Measurement,
    MeasurementTerm,
    NoiseInput,
    ProcessParts,
    ProcessTerm,
)

FloatArray = NDArray[np.float64]
Block = Callable[..., BlockParts]
Noise = Callable[..., NoiseInput]
Reading = Callable[..., Measurement]
SHAPE = np.array([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]])


def cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@pytest.mark.parametrize("acting", ["n", "b"])
@pytest.mark.parametrize("target", ["n", "b"])
@pytest.mark.parametrize("source", ["n", "b"])
def test_a_term_is_rotated_into_the_frames_of_its_blocks(
    block: Block, nominal: dict[str, FloatArray], acting: str, target: str, source: str
) -> None:
    """Whatever the frames, the physics is one: taken to n, every arrangement has the coefficient of the acting frame."""
    term = ProcessTerm("t", "x", "y", constant(SHAPE), frame=acting)
    model = build_model([block("x", target), block("y", source)], [ProcessParts((term,))])
    to_n = {"n": np.eye(3), "b": nominal["C_bn"]}
    wanted = to_n[target].T @ to_n[acting] @ SHAPE @ to_n[acting].T @ to_n[source]
    assert np.allclose(model.F.coefficient.evaluate(nominal)[:3, 3:], wanted, atol=1e-14)


def test_an_isotropic_term_between_equal_frames_needs_no_rotation(block: Block) -> None:
    term = ProcessTerm("t", "x", "y", 2.0 * identity(3), frame="n")
    model = build_model([block("x", "b"), block("y", "b")], [ProcessParts((term,))])
    assert model.F.coefficient.is_constant


def test_terms_on_the_same_blocks_add(block: Block, nominal: dict[str, FloatArray]) -> None:
    terms = (
        ProcessTerm("one", "x", "x", skew("f_n"), frame="n"),
        ProcessTerm("two", "x", "x", -2.0 * skew("omega_nb_n"), frame="n"),
    )
    model = build_model([block("x", "n")], [ProcessParts(terms)])
    wanted = cross(nominal["f_n"]) - 2.0 * cross(nominal["omega_nb_n"])
    assert np.allclose(model.F.coefficient.evaluate(nominal), wanted, atol=1e-15)


def test_one_noise_drives_two_blocks_and_correlates_them(
    block: Block, noise: Noise, nominal: dict[str, FloatArray]
) -> None:
    terms = (
        ProcessTerm("first", "x", "w", identity(3), frame="n"),
        ProcessTerm("second", "y", "w", constant(SHAPE), frame="n"),
    )
    model = build_model([block("x", "n"), block("y", "n")], [ProcessParts(terms, (noise("w", "n", [1.0, 4.0, 9.0]),))])
    G = np.vstack([np.eye(3), SHAPE])
    assert np.allclose(model.diffusion.evaluate(nominal), G @ np.diag([1.0, 4.0, 9.0]) @ G.T, atol=1e-13)


def test_an_isotropic_noise_does_not_depend_on_the_attitude(block: Block, noise: Noise) -> None:
    term = ProcessTerm("t", "x", "w", -identity(3), frame="n")
    model = build_model([block("x", "n")], [ProcessParts((term,), (noise("w", "b", [4.0] * 3),))])
    assert model.diffusion.is_constant
    assert model.G.columns == ("w[E]", "w[N]", "w[U]")  # told in the axes in which it is met
    assert np.array_equal(model.diffusion.evaluate({}), 4.0 * np.eye(3))


def test_an_anisotropic_noise_does(block: Block, noise: Noise, nominal: dict[str, FloatArray]) -> None:
    term = ProcessTerm("t", "x", "w", -identity(3), frame="n")
    model = build_model([block("x", "n")], [ProcessParts((term,), (noise("w", "b", [1.0, 2.0, 3.0]),))])
    C = nominal["C_bn"]
    assert model.diffusion.needs == {"C_bn"}
    assert model.G.columns == ("w[R]", "w[F]", "w[U]")
    assert np.allclose(model.G.coefficient.evaluate(nominal), -C, atol=0.0)
    assert np.allclose(model.diffusion.evaluate(nominal), C @ np.diag([1.0, 2.0, 3.0]) @ C.T, atol=1e-15)


def test_an_isotropic_noise_on_blocks_in_two_frames_correlates_them_by_the_rotation(
    block: Block, noise: Noise, nominal: dict[str, FloatArray]
) -> None:
    terms = tuple(ProcessTerm(f"t{x}", x, "w", identity(3), frame="b") for x in ("x", "y"))
    model = build_model([block("x", "n"), block("y", "b")], [ProcessParts(terms, (noise("w", "b", [4.0] * 3),))])
    C = nominal["C_bn"]
    wanted = 4.0 * np.block([[np.eye(3), C], [C.T, np.eye(3)]])
    assert np.allclose(model.diffusion.evaluate(nominal), wanted, atol=1e-14)


def test_a_measurement_reads_two_blocks_each_in_its_own_frame(
    block: Block, reading: Reading, nominal: dict[str, FloatArray]
) -> None:
    rows = ("E", "N", "U")
    m = Measurement(
        "z", rows, rows, "1",
        (MeasurementTerm("v", identity(3)), MeasurementTerm("lever", -skew("omega_nb_n")), MeasurementTerm("bias", identity(3))),
        tuple(tuple(float(x) for x in row) for row in np.eye(3)), "per_measurement", frame="n",
    )  # fmt: skip
    model = build_model([block("v", "n"), block("bias", "n"), block("lever", "b")], measurements=[m])
    wanted = np.hstack([np.eye(3), np.eye(3), -cross(nominal["omega_nb_n"]) @ nominal["C_bn"]])
    assert np.allclose(model.H("z").coefficient.evaluate(nominal), wanted, atol=1e-15)
    assert model.H("z").rows == ("z[E]", "z[N]", "z[U]")


def test_a_scalar_state_couples_into_a_triad(block: Block, nominal: dict[str, FloatArray]) -> None:
    term = ProcessTerm("t", "x", "k", constant([1.0, 2.0, 3.0]), frame="b")
    model = build_model([block("x", "n"), block("k")], [ProcessParts((term,))])
    assert model.states == ("x[E]", "x[N]", "x[U]", "k")
    assert np.allclose(model.F.coefficient.evaluate(nominal)[:3, 3], nominal["C_bn"] @ [1.0, 2.0, 3.0], atol=1e-15)


def test_a_known_input_acts_in_the_frame_of_its_term(block: Block, nominal: dict[str, FloatArray]) -> None:
    torque = KnownInput("torque", ("R", "F", "U"), "1", (0.0,), ((1.0, 0.0, 0.0),))
    term = ProcessTerm("t", "x", "torque", constant(SHAPE), frame="b")
    model = build_model([block("x", "n")], [ProcessParts((term,))], inputs=[torque])
    assert model.B.columns == ("torque[R]", "torque[F]", "torque[U]")
    assert np.allclose(model.B.coefficient.evaluate(nominal), nominal["C_bn"] @ SHAPE, atol=1e-14)


def test_correlations_of_the_prior_are_given_by_label(block: Block) -> None:
    model = build_model(
        [block("x", "n", (1.0, 2.0, 3.0)), block("k", None, (5.0,))], correlations={("x[N]", "k"): -0.5}
    )
    covariance = model.prior.evaluate({})[1]
    assert covariance[1, 3] == covariance[3, 1] == -0.5 * 2.0 * 5.0


def test_leading_axes_of_the_nominal_are_leading_axes_of_the_matrices(
    block: Block, noise: Noise, nominal: dict[str, FloatArray]
) -> None:
    term = ProcessTerm("t", "x", "x", skew("f_n"), frame="n")
    drive = ProcessTerm("d", "x", "w", identity(3), frame="n")
    model = build_model([block("x", "b")], [ProcessParts((term, drive), (noise("w", "n", [1.0, 2.0, 3.0]),))])
    many = {n: np.stack([v, 2.0 * v, -v]) for n, v in nominal.items()}
    for matrix in (model.F.coefficient, model.diffusion):
        stacked = matrix.evaluate(many)
        for k in range(3):
            assert np.allclose(stacked[k], matrix.evaluate({n: v[k] for n, v in many.items()}), atol=1e-13)


def test_a_model_survives_pickling(block: Block, noise: Noise, reading: Reading) -> None:
    terms = (ProcessTerm("t", "x", "x", skew("f_n"), frame="n"), ProcessTerm("d", "x", "w", identity(3), frame="n"))
    parts = ProcessParts(terms, (noise("w", "b", [1.0] * 3),))
    model = build_model([block("x", "b")], [parts], [reading("z", "x")])
    _ = model.F, model.states  # cached values must not get in the way
    back: Model = pickle.loads(pickle.dumps(model))
    assert back == model
    assert hash(back) == hash(model)
