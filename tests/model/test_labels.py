"""Labels are an interface: aliases of renamed terms hold, and what is not there names what is near."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from estimfw.errors import ConfigError
from estimfw.model.build import build_model
from estimfw.model.coefficient import identity, zeros
from estimfw.model.frame import Frame
from estimfw.model.model import Model
from estimfw.model.parts import BlockParts, Measurement, MeasurementTerm, NoiseInput, ProcessParts, ProcessTerm

Block = Callable[..., BlockParts]
Noise = Callable[..., NoiseInput]
Reading = Callable[..., Measurement]


def with_terms(block: Block, *terms: ProcessTerm) -> Model:
    return build_model([block("x", "n")], [ProcessParts(terms)])


def test_a_renamed_term_is_found_by_its_former_label(block: Block) -> None:
    model = with_terms(block, ProcessTerm("coriolis_acceleration", "x", "x", identity(3), "n", aliases=("coriolis",)))
    assert model.term("coriolis").label == "coriolis_acceleration"


def test_a_label_goes_before_an_alias(block: Block) -> None:
    old = ProcessTerm("new_name", "x", "x", identity(3), "n", aliases=("taken",))
    model = with_terms(block, old, ProcessTerm("taken", "x", "x", 2.0 * identity(3), "n"))
    assert model.term("taken").label == "taken"


def test_a_provider_sees_a_renamed_term_under_its_former_label(block: Block) -> None:
    model = with_terms(block, ProcessTerm("coriolis_acceleration", "x", "x", identity(3), "n", aliases=("coriolis",)))
    assert model.structure.has_term("coriolis")
    assert not model.structure.has_term("transport_rate")


def test_a_term_without_effect_does_not_live(block: Block) -> None:
    model = with_terms(block, ProcessTerm("coriolis", "x", "x", zeros(3, 3), "n"))
    assert not model.structure.has_term("coriolis")


def test_a_term_that_is_not_there_names_the_nearest(block: Block) -> None:
    with pytest.raises(ConfigError, match="no process term 'corolis'") as caught:
        with_terms(block, ProcessTerm("coriolis", "x", "x", identity(3), "n")).term("corolis")
    assert "did you mean 'coriolis'" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: ProcessTerm("t", "y", "x", identity(3), "n"), "no block 'y'"),
        (lambda t: ProcessTerm("t", "x", "y", identity(3), "n"), "no block, noise or input 'y'"),
        (lambda t: ProcessTerm("t", "x", "x", identity(2), "n"), "its coefficient is 2 x 2, but x -> x needs 3 x 3"),
        (lambda t: ProcessTerm("t", "x", "x", identity(3), "m"), "names the frame 'm', which is not there"),
    ],
)
def test_a_term_that_does_not_fit_is_refused(block: Block, change: Callable[[int], ProcessTerm], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        with_terms(block, change(0))


def test_a_measurement_that_does_not_fit_is_refused(block: Block, reading: Reading) -> None:
    with pytest.raises(ConfigError, match="no block 'y'"):
        build_model([block("x", "n")], measurements=[reading("z", "y")])
    with pytest.raises(ConfigError, match="coefficient of k is 3 x 3, it needs 3 x 1"):
        build_model([block("k")], measurements=[reading("z", "k")])
    with pytest.raises(ConfigError, match="measurement 'z' names the frame 'm'"):
        build_model([block("x", "n")], measurements=[reading("z", "x", frame="m")])


def test_names_are_given_once(block: Block, noise: Noise, reading: Reading) -> None:
    with pytest.raises(ConfigError, match="2 times a block, noise or input 'x'"):
        build_model([block("x", "n"), block("x", "b")])
    with pytest.raises(ConfigError, match="2 times a block, noise or input 'x'"):
        build_model([block("x", "n")], [ProcessParts((), (noise("x", "n", [1.0] * 3),))])
    twice = (ProcessTerm("t", "x", "x", identity(3), "n"),) * 2
    with pytest.raises(ConfigError, match="2 times a process term 't'"):
        build_model([block("x", "n")], [ProcessParts(twice)])
    with pytest.raises(ConfigError, match="2 times a measurement 'z'"):
        build_model([block("x", "n")], measurements=[reading("z", "x")] * 2)


def test_a_frame_that_two_parts_define_differently_is_refused(block: Block) -> None:
    other = Frame("b", ("R", "F", "U"), parent="n", rotation="C_mine")
    with pytest.raises(ConfigError, match="frame 'b' is defined twice"):
        build_model([block("x", "n")], [ProcessParts((), frames=(other,))])


def test_a_correlation_names_a_state_that_is_there(block: Block) -> None:
    with pytest.raises(ConfigError, match=r"names the state 'x\[Q\]'"):
        build_model([block("x", "n")], correlations={("x[E]", "x[Q]"): 0.1})


def test_a_correlation_above_one_is_no_covariance(block: Block) -> None:
    with pytest.raises(ConfigError, match=r"not positive semidefinite: worst eigenvalue -0\.5"):
        build_model([block("x", "n")], correlations={("x[E]", "x[N]"): 1.5})


def test_a_measurement_term_of_a_lone_state(block: Block) -> None:
    m = Measurement("z", ("",), ("",), "1", (MeasurementTerm("k", identity(1)),), ((4.0,),), "density")
    model = build_model([block("k")], measurements=[m])
    assert model.H("z").rows == ("z",)
    assert model.R("z").tolist() == [[4.0]]
