"""The assembled model as text: a line for each state and for each row of a measurement."""

from __future__ import annotations

from collections.abc import Sequence

from estimfw.model.coefficient import Coefficient
from estimfw.model.model import Model
from estimfw.model.polynomial import Factor, Monomial

__all__ = ["dynamics", "observations"]


def dynamics(model: Model) -> list[tuple[str, str]]:
    """Each state and what its rate is: ``("gyro_bias[N]", "0")``."""
    noises = model.G.columns
    inputs = [f"{known.name}[{axis}]" if axis else known.name for known in model.inputs for axis in known.axes]
    found = []
    for i, state in enumerate(model.states):
        parts = _row(model, model.F.coefficient, i, model.states)
        parts += _row(model, model.B.coefficient, i, inputs) + _row(model, model.G.coefficient, i, noises)
        found.append((state, _joined(parts)))
    return found


def observations(model: Model) -> list[tuple[str, str]]:
    """Each row of each measurement and what it reads, its noise last."""
    return [
        (label, _joined([*_row(model, model.H(m.name).coefficient, i, model.states), "+ noise"]))
        for m in model.measurements
        for i, label in enumerate(m.labels)
    ]


def _row(model: Model, matrix: Coefficient, row: int, columns: Sequence[str]) -> list[str]:
    entries = ((columns[j], polynomial) for i, j, polynomial in matrix.entries if i == row)
    return [_monomial(model, monomial, column) for column, polynomial in entries for monomial in polynomial]


def _monomial(model: Model, monomial: Monomial, column: str) -> str:
    constant, factors = monomial
    size = [] if abs(constant) == 1 else [f"{abs(constant):.6g}"]
    return f"{'-' if constant < 0 else '+'} {' '.join([*size, *(_factor(model, f) for f in factors), column])}"


def _factor(model: Model, factor: Factor) -> str:
    """A scalar of the nominal with the axes of its frames: ``f_n[U]``, ``C_bn[E,R]``."""
    name, index = factor
    if not index:
        return name
    tail = name.rpartition("_")[2]
    frames = (tail,) if len(index) == 1 else tuple(reversed(tail))
    known = [model.frame_map[frame].axes for frame in frames if frame in model.frame_map]
    labels = [str(k + 1) for k in index]
    if len(known) == len(index) and all(k < len(axes) for axes, k in zip(known, index, strict=True)):
        labels = [axes[k] for axes, k in zip(known, index, strict=True)]
    return f"{name}[{','.join(labels)}]"


def _joined(parts: list[str]) -> str:
    """A sum without a plus in front, and with the sign of its first part close to it."""
    text = " ".join(parts) or "0"
    return f"-{text[2:]}" if text.startswith("- ") else text.removeprefix("+ ")
