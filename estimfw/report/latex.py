"""The equations of a model as LaTeX: a line for each state, as assembled, and a line for each term.

Variables of the nominal have the symbols that their provider declares, or are written by their name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from estimfw.model.coefficient import Coefficient
from estimfw.model.model import Model
from estimfw.model.parts import NoiseInput, ProcessTerm, StateBlock
from estimfw.model.polynomial import Monomial
from estimfw.plan.layout import NominalLayout

__all__ = ["model_latex", "symbol"]

Symbols = Mapping[str, str]


def model_latex(model: Model, layout: NominalLayout) -> str:
    """Terms, assembled equations, measurements; a whole ``align*`` environment each."""
    symbols = {v.name: v.latex for v in layout.variables if v.latex} | {
        d.name: d.latex for d in layout.derived if d.latex
    }
    terms = [f"  & \\text{{{t.label.replace('_', ' ')}}} && {_term(model, t, symbols)} \\\\" for t in model.terms]
    states = [s for block in model.blocks for s in _states(block)]
    noises = [_noise(n, axis) for n in (model.settled(n) for n in model.noises) for axis in n.axes]
    inputs = [f"\\mathrm{{{k.name.replace('_', '~')}}}_{{{a}}}" for k in model.inputs for a in k.axes]
    equations = []
    for i, name in enumerate(states):
        right = _row(model.F.coefficient, i, states, symbols) + _row(model.G.coefficient, i, noises, symbols)
        right += _row(model.B.coefficient, i, inputs, symbols)
        equations.append(f"  \\dot{{{_bare(name)}}}{name[len(_bare(name)) :]} &= {_joined(right)} \\\\")
    rows = []
    for m in model.measurements:
        for i, label in enumerate(m.rows):
            right = _row(model.H(m.name).coefficient, i, states, symbols)
            rows.append(f"  z_{{{label or m.name.replace('_', '~')}}} &= {_joined(right)} + v \\\\")
    return "\n".join(
        f"% {title}\n\\begin{{align*}}\n" + "\n".join(lines) + "\n\\end{align*}"
        for title, lines in (("terms", terms), ("dynamics", equations), ("measurements", rows))
        if lines
    )


def _bare(name: str) -> str:
    return name[: name.rindex("_{")] if "_{" in name else name


def _block(block: StateBlock) -> str:
    return block.latex or f"\\mathrm{{{block.name.replace('_', '~')}}}"


def _states(block: StateBlock) -> list[str]:
    return [f"{_block(block)}_{{{axis}}}" if axis else _block(block) for axis in block.axes]


def _noise(noise: NoiseInput, axis: str) -> str:
    word = noise.name.replace("_noise", "").replace("_", "~").replace(".noise", "")
    return f"w_{{\\mathrm{{{word}}},{axis}}}" if axis else f"w_{{\\mathrm{{{word}}}}}"


def _term(model: Model, term: ProcessTerm, symbols: Symbols) -> str:
    target, source = model.block(term.target), model.source(term.source)
    right = _block(source) if isinstance(source, StateBlock) else f"\\mathrm{{{term.source.replace('_', '~')}}}"
    frame = f"^{{{term.frame}}}" if term.frame else ""
    form = re.sub("<([^>]*)>", lambda found: _symbol(found[1], symbols), term.coefficient.form)
    form = f"({form})" if " + " in form else form
    factor = {"I": "", "-I": "-"}.get(form, f"{form}\\," if form else "A\\,")
    return f"\\dot{{{_block(target)}}}{frame} \\mathrel{{+}}= {factor}{right}"


def _row(matrix: Coefficient, row: int, names: list[str], symbols: Symbols) -> list[str]:
    entries = ((names[j], polynomial) for i, j, polynomial in matrix.entries if i == row)
    return [_monomial(monomial, name, symbols) for name, polynomial in entries for monomial in polynomial]


def _monomial(monomial: Monomial, name: str, symbols: Symbols) -> str:
    constant, factors = monomial
    sign = "-" if constant < 0 else "+"
    size = "" if abs(constant) == 1.0 else _number(abs(constant))
    scalars = [_element(_symbol(variable, symbols), index) for variable, index in factors]
    return f"{sign} " + "\\,".join([s for s in (size, *scalars, name) if s])


def _element(base: str, index: tuple[int, ...]) -> str:
    return f"[{base}]_{{{','.join(str(k + 1) for k in index)}}}" if index else base


def _symbol(variable: str, symbols: Symbols) -> str:
    """The declared symbol, else one made of the name; a variable made of held ones has a bar."""
    if variable in symbols:
        return symbols[variable]
    held = variable.removeprefix("fixed.")
    return symbol(variable) if held == variable else rf"\overline{{{_symbol(held, symbols)}}}"


def symbol(name: str) -> str:
    """LaTeX of a variable's name, by the ways names are built: ``C_bn`` is C_b^n, ``f_n`` is f^n, ``speed`` upright."""
    head, _, tail = name.rpartition("_")
    if not head:
        return name if len(name) == 1 else rf"\mathrm{{{name}}}"
    if len(head) == 1 and len(tail) == 2:
        return f"{head}_{{{tail[0]}}}^{{{tail[1]}}}"
    base = head if len(head) == 1 else rf"\mathrm{{{head.replace('_', '~')}}}"
    return f"{base}^{{{tail}}}" if len(tail) == 1 else f"{base}_{{{tail}}}"


def _number(value: float) -> str:
    text = f"{value:.6g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa} \\cdot 10^{{{int(exponent)}}}"


def _joined(parts: list[str]) -> str:
    text = " ".join(parts) or "0"
    return text[2:] if text.startswith("+ ") else text
