"""Rotations and rates between the frames of a tree, against SciPy and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from estimfw.errors import ConfigError
from estimfw.model.coefficient import identity
from estimfw.model.frame import Frame, relative_rate, rotation

TREE = {
    f.name: f
    for f in (
        Frame("n", ("E", "N", "U")),
        Frame("b", ("R", "F", "U"), parent="n", rotation="C_bn", rate="omega_nb_n"),
        Frame("s", ("x", "y", "z"), parent="b", rotation="C_sb"),
        Frame("p", ("1", "2", "3"), parent="n", rotation="C_pn", rate="omega_np_n"),
        Frame("q", ("1", "2", "3")),
    )
}
ROTATIONS = {
    n: Rotation.random(rng=np.random.default_rng(k)).as_matrix() for k, n in enumerate(["C_bn", "C_sb", "C_pn"])
}


def test_up_the_tree_is_a_product_of_rotations() -> None:
    made = rotation("s", "n", TREE).evaluate(ROTATIONS)
    assert np.allclose(made, ROTATIONS["C_bn"] @ ROTATIONS["C_sb"], atol=1e-15)


def test_across_the_tree_goes_up_and_down_again() -> None:
    made = rotation("s", "p", TREE).evaluate(ROTATIONS)
    assert np.allclose(made, ROTATIONS["C_pn"].T @ ROTATIONS["C_bn"] @ ROTATIONS["C_sb"], atol=1e-15)


def test_there_and_back_are_transposes() -> None:
    assert rotation("p", "s", TREE) == rotation("s", "p", TREE).T


def test_a_frame_needs_no_rotation_to_itself() -> None:
    assert rotation("s", "s", TREE) == identity(3)


def test_frames_that_nothing_connects_are_named() -> None:
    with pytest.raises(ConfigError, match=r"connects frame 'b' with frame 'q'"):
        rotation("b", "q", TREE)


@pytest.mark.parametrize(("source", "target"), [("b", "n"), ("n", "b")])
def test_the_relative_rate_is_the_derivative_of_the_rotation(source: str, target: str) -> None:
    """v constant in ``source``: d(C v)/dt = [omega x] C v, with C by finite difference."""
    rate = np.array([0.3, -0.5, 0.2])
    h, C = 1e-6, ROTATIONS["C_bn"]

    def turned(t: float) -> np.ndarray:
        C_bn = Rotation.from_rotvec(rate * t).as_matrix() @ C
        return C_bn if target == "n" else C_bn.T

    derivative = (turned(h) - turned(-h)) / (2 * h)
    made = relative_rate(source, target, TREE).evaluate({"C_bn": C, "omega_nb_n": rate})
    assert np.allclose(made @ turned(0.0), derivative, atol=1e-9)


def test_frames_that_do_not_turn_have_no_rate() -> None:
    assert relative_rate("s", "b", TREE).is_zero
    assert relative_rate("b", "s", TREE).is_zero


def test_a_rate_over_two_steps_is_refused_and_the_way_is_named() -> None:
    with pytest.raises(ConfigError, match="express the block in 'b' first"):
        relative_rate("s", "n", TREE)
