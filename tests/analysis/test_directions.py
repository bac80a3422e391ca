"""Directions that cannot be determined, as text with names and units."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.directions import undetectable_directions
from estimfw.model.build import build_model
from estimfw.model.coefficient import constant
from estimfw.model.model import Model
from estimfw.model.parts import BlockParts, Measurement, MeasurementTerm, ProcessParts, ProcessTerm, StateBlock

FloatArray = NDArray[np.float64]
Reads = dict[str, float]


def lone(name: str, unit: str, sigma: float = 1.0) -> BlockParts:
    return BlockParts(StateBlock(name, ("",), ("",), unit), ((sigma**2,),), (0.0,))


def reading(reads: Reads) -> Measurement:
    terms = tuple(MeasurementTerm(name, constant([[factor]])) for name, factor in reads.items())
    return Measurement("z", ("",), ("",), "1", terms, ((1.0,),), "density")


def with_decay(make: Callable[[], Model], block: str, rate: float) -> Model:
    model = make()
    decay = ProcessTerm("decay", block, block, constant([[-rate]]))
    return model.with_parts(terms=(*model.terms, decay))


def two(reads: Reads) -> Model:
    return build_model([lone("bias", "m/s^2", 1e-3), lone("tilt", "rad", 0.1)], measurements=[reading(reads)])


def test_a_direction_is_told_as_a_change_of_one_prior_sigma_and_what_goes_with_it() -> None:
    """z = bias + 9.8 tilt: a bias of one prior sigma, 1e-3 m/s^2, is not seen with a tilt of -1e-3/9.8 rad."""
    assert undetectable_directions(two({"bias": 1.0, "tilt": 9.8}), {}) == ["bias 0.001 m/s^2, tilt -0.000102 rad"]


def test_the_change_told_is_invisible() -> None:
    (text,) = undetectable_directions(two({"bias": 1.0, "tilt": 9.8}), {})
    bias, tilt = (float(part.split()[1]) for part in text.split(", "))
    assert abs(1.0 * bias + 9.8 * tilt) < 5e-3 * bias  # to the digits printed


def test_numbers_stand_in_the_unit_in_which_people_read_the_state() -> None:
    tilt = BlockParts(StateBlock("tilt", ("",), ("",), "rad", "deg"), ((0.1**2,),), (0.0,))
    model = build_model([lone("bias", "m/s^2", 1e-3), tilt], measurements=[reading({"bias": 1.0, "tilt": 9.8})])
    assert undetectable_directions(model, {}) == ["bias 0.001 m/s^2, tilt -0.00585 deg"]


def test_a_part_that_is_little_of_what_stays_open_of_its_state_is_left_out() -> None:
    """z = bias + 9.8 tilt, w = drift + 0.01 bias + 9.8 turn: that a bias turns a little too is not told."""
    parts = [
        lone("bias", "m/s^2", 1e-3),
        lone("tilt", "rad", 0.1),
        lone("drift", "m/s^2", 1e-3),
        lone("turn", "rad", 0.1),
    ]
    second = Measurement(
        "w", ("",), ("",), "1",
        tuple(MeasurementTerm(n, constant([[k]])) for n, k in (("drift", 1.0), ("bias", 0.01), ("turn", 9.8))),
        ((1.0,),), "density",
    )  # fmt: skip
    texts = undetectable_directions(build_model(parts, measurements=[reading({"bias": 1.0, "tilt": 9.8}), second]), {})
    assert sorted(texts) == ["bias 0.001 m/s^2, tilt -0.000102 rad", "drift 0.001 m/s^2, turn -0.000102 rad"]


def test_an_unread_state_is_its_own_direction() -> None:
    assert undetectable_directions(two({"bias": 1.0}), {}) == ["tilt 0.1 rad"]


def test_an_observable_model_has_none() -> None:
    model = two({"bias": 1.0, "tilt": 9.8})
    growth = ProcessTerm("growth", "bias", "tilt", constant([[2.0]]))
    assert undetectable_directions(model.with_parts(terms=(growth,)), {}) == []


def test_what_decays_by_itself_is_not_complained_about() -> None:
    assert undetectable_directions(with_decay(lambda: two({"bias": 1.0}), "tilt", 0.01), {}) == []
    assert undetectable_directions(with_decay(lambda: two({"bias": 1.0}), "tilt", -0.01), {}) == ["tilt 0.1 rad"]


def test_a_model_without_measurements_has_no_say() -> None:
    model = build_model([lone("x", "m")], [ProcessParts(())])
    assert undetectable_directions(model, {}) == []
