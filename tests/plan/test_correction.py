"""The correction of a provider from the estimate: quantities find their slots, frames their rotation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.errors import ConfigError
from estimfw.model.frame import Frame
from estimfw.model.model import Model
from estimfw.model.nominal import CorrectionSlot
from estimfw.plan.correction import correction
from estimfw.policies.drop_states import DropStates
from estimfw.policies.express_in_frame import ExpressInFrame

Make = Callable[..., Model]
SLOTS = (CorrectionSlot("velocity", "n"), CorrectionSlot("attitude", "n"))
C_BN = Rotation.from_euler("ZXY", [30.0, 10.0, -5.0], degrees=True).as_matrix()
NOMINAL = {"C_bn": C_BN, "gravity": np.array(9.8), "omega_nb_n": np.zeros(3)}
STATES = np.arange(1.0, 10.0)


def delta(model: Model, slots: tuple[CorrectionSlot, ...] = SLOTS) -> NDArray[np.float64]:
    return correction(model, slots).evaluate(NOMINAL) @ STATES[: len(model.states)]


def test_blocks_go_into_the_slots_of_their_quantities(model: Make) -> None:
    assert np.array_equal(delta(model()), STATES[:6])
    assert np.array_equal(delta(model(), SLOTS[::-1]), [4, 5, 6, 1, 2, 3])


def test_an_axis_that_is_gone_is_not_corrected(model: Make) -> None:
    flat, _ = DropStates(("v[N]", "phi[E]")).apply(model(), NOMINAL)
    assert np.array_equal(delta(flat), [1, 0, 2, 0, 3, 4])


def test_the_width_is_that_of_the_provider_whatever_lives(model: Make) -> None:
    without, _ = DropStates(("phi",)).apply(model(), NOMINAL)
    assert np.array_equal(delta(without), [1, 2, 3, 0, 0, 0])


def test_a_block_in_another_frame_is_rotated_into_that_of_its_slot(model: Make) -> None:
    turned, _ = ExpressInFrame("phi", "b").apply(model(), NOMINAL)
    np.testing.assert_allclose(delta(turned), [1, 2, 3, *(C_BN @ [4, 5, 6])], rtol=1e-15)


def test_what_is_left_of_a_turned_block_is_rotated_as_a_triad_without_the_rest(model: Make) -> None:
    turned, _ = ExpressInFrame("phi", "b").apply(model(), NOMINAL)
    part, _ = DropStates(("phi[F]",)).apply(turned, NOMINAL)
    np.testing.assert_allclose(delta(part), [1, 2, 3, *(C_BN @ [4, 0, 5])], rtol=1e-15)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"frame": None, "home_frame": None}, "is no triad in a frame"),
        ({"frame": "p", "home_frame": "p"}, "knows no rotation to it from 'p'"),
        ({"frame": "w", "home_frame": "w"}, "no rotation connects frame 'w' with frame 'n'"),
    ],
)
def test_a_block_without_a_way_to_its_slot_is_refused(model: Make, change: dict[str, Any], says: str) -> None:
    made = model()
    lost = replace(made.block("phi"), **change)
    made = made.with_parts(
        blocks=(made.blocks[0], lost, made.blocks[2]), frames=(*made.frames, Frame("w", ("x", "y", "z")))
    )
    with pytest.raises(ConfigError, match=says) as caught:
        correction(made, SLOTS)
    assert "block 'phi' corrects the attitude of the nominal in frame 'n'" in str(caught.value)
