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


def test_a_direction_is_told_in_state_names_with_its_factor_and_unit() -> None:
    """z = bias + 9.8 tilt: a tilt of -1/9.8 rad for each m/s^2 of bias is not seen."""
    texts = undetectable_directions(two({"bias": 1.0, "tilt": 9.8}), {})
    assert texts == ["bias - 0.102 rad/(m/s^2) tilt"]


def test_the_direction_told_is_invisible() -> None:
    factor = float(undetectable_directions(two({"bias": 1.0, "tilt": 9.8}), {})[0].split()[2])
    assert abs(1.0 * 1.0 + 9.8 * -factor) < 5e-3  # to the digits printed


def test_an_unread_state_is_its_own_direction() -> None:
    assert undetectable_directions(two({"bias": 1.0}), {}) == ["tilt"]


def test_an_observable_model_has_none() -> None:
    model = two({"bias": 1.0, "tilt": 9.8})
    growth = ProcessTerm("growth", "bias", "tilt", constant([[2.0]]))
    assert undetectable_directions(model.with_parts(terms=(growth,)), {}) == []


def test_what_decays_by_itself_is_not_complained_about() -> None:
    assert undetectable_directions(with_decay(lambda: two({"bias": 1.0}), "tilt", 0.01), {}) == []
    assert undetectable_directions(with_decay(lambda: two({"bias": 1.0}), "tilt", -0.01), {}) == ["tilt"]


def test_a_model_without_measurements_has_no_say() -> None:
    model = build_model([lone("x", "m")], [ProcessParts(())])
    assert undetectable_directions(model, {}) == []
