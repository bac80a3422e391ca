"""Equations carry the symbols that a provider declares; names stand for the others."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.model.build import build_model
from estimfw.model.coefficient import identity, scalar, skew
from estimfw.model.frame import Frame
from estimfw.model.nominal import NominalVariable
from estimfw.model.parts import BlockParts, DerivedVariable, ProcessParts, ProcessTerm, StateBlock
from estimfw.plan.layout import NominalLayout
from estimfw.policies.fix_nominal import FixNominal
from estimfw.report.latex import model_latex, symbol

FloatArray = NDArray[np.float64]
FRAME = Frame("p", ("x", "y", "z"))


def norm(spin_p: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(spin_p, axis=-1))


def latex(spin: str = "", *, derived: str = r"\nu", fixed: bool = False) -> str:
    """x' = scale [spin x] x + speed x, in a frame and under names that no field knows."""
    block = StateBlock("x", FRAME.axes, FRAME.axes, "m", frame="p", home_frame="p", latex="x")
    parts = BlockParts(block, tuple(map(tuple, np.eye(3).tolist())), (0.0,) * 3, frames=(FRAME,))
    terms = (
        ProcessTerm("turn", "x", "x", scalar("scale") * skew("spin_p"), "p"),
        ProcessTerm("growth", "x", "x", scalar("speed") * identity(3), "p"),
    )
    speed = DerivedVariable("speed", (), ("spin_p",), norm, latex=derived)
    model = build_model([parts], [ProcessParts(terms, derived=(speed,))])
    variables = (
        NominalVariable("spin_p", (3,), "rad/s", "varying", spin),
        NominalVariable("scale", (), "1", "varying"),
    )
    if fixed:
        reference = {"spin_p": np.ones(3), "scale": np.array(1.0)}
        model, _ = FixNominal("spin_p", ("scale", 0.0, 0.0)).apply(model, reference)
    return model_latex(model, NominalLayout(variables, (*model.derived, *model.held)))


def test_declared_symbols_stand_in_terms_and_in_equations() -> None:
    text = latex(r"\Omega^p")
    assert r"\dot{x}^{p} \mathrel{+}= \mathrm{scale}\,[\Omega^p\times]\,x \\" in text
    assert r"\dot{x}_{x} &= \nu\,x_{x} - \mathrm{scale}\,[\Omega^p]_{3}\,x_{y}" in text


def test_without_one_the_name_stands() -> None:
    text = latex(derived="")
    assert r"\mathrm{scale}\,[\mathrm{spin}^{p}\times]\,x" in text
    assert r"\dot{x}_{x} &= \mathrm{speed}\,x_{x}" in text


def test_what_is_made_of_held_values_has_a_bar() -> None:
    text = latex(fixed=True)
    assert r"\dot{x}_{x} &= \overline{\nu}\,x_{x} \\" in text
    assert r"\dot{x}_{y} &= \overline{\nu}\,x_{y} - \mathrm{scale}\,\mathrm{scale}\,x_{z} \\" in text


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("g", "g"),
        ("speed", r"\mathrm{speed}"),
        ("f_n", "f^{n}"),
        ("C_bn", "C_{b}^{n}"),
        ("wind_rate_n", r"\mathrm{wind~rate}^{n}"),
        ("wind_east", r"\mathrm{wind}_{east}"),
    ],
)
def test_a_name_is_written_as_it_is_built(name: str, expected: str) -> None:
    assert symbol(name) == expected
