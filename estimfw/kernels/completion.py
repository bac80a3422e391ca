"""Derived variables inside the scan: which twins are called on which places of a row, and the code that does it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["NOTHING", "Call", "Completion", "completion_text"]

Place = tuple[int, int]
Monomial = tuple[float, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class Call:
    """``name`` of ``module`` called on places (first, behind the last) of a row, writing into ``result``.

    ``filled`` are held arguments, written into work space behind the row before the call: at each position the sum of
    ``constant * product(row[factors])``.
    """

    module: str
    name: str
    arguments: tuple[Place, ...]
    result: Place
    filled: tuple[tuple[int, tuple[Monomial, ...]], ...] = ()


@dataclass(frozen=True, slots=True)
class Completion:
    """What is due before the process terms, and before what is read at the end of a step, each in its order.

    ``size`` is that of a row with the work space behind it.
    """

    process: tuple[Call, ...]
    end: tuple[Call, ...]
    size: int


#: Of a model without derived variables in its loop.
NOTHING = Completion((), (), 0)


def completion_text(completion: Completion) -> str:
    """The module that stands in the place of `estimfw.kernels.compiled_derived`."""
    calls = list(dict.fromkeys((*completion.process, *completion.end)))
    twins = list(dict.fromkeys((c.module, c.name) for c in calls))
    named = {twin: f"twin_{i}" for i, twin in enumerate(twins)}
    lines = ['"""Derived variables of one plan, written into a row in place."""', "", "from numba import njit", ""]
    lines += [f"from {module} import {name} as {named[module, name]}" for module, name in twins]
    for what, own in (("process", completion.process), ("end", completion.end)):
        lines += ["", "", "@njit(cache=True)", f"def complete_{what}(row):"]
        body = [line for call in own for line in _body(call, named[call.module, call.name])]
        lines += [f"    {line}" for line in body or ["pass"]]
    return "\n".join(lines) + "\n"


def _body(call: Call, twin: str) -> list[str]:
    lines = [f"row[{at}] = {' + '.join(map(_product, monomials)) or '0.0'}" for at, monomials in call.filled]
    places = ", ".join(f"row[{first}:{last}]" for first, last in (*call.arguments, call.result))
    return [*lines, f"{twin}({places})"]


def _product(monomial: Monomial) -> str:
    constant, factors = monomial
    return " * ".join([repr(float(constant)), *(f"row[{position}]" for position in factors)])
