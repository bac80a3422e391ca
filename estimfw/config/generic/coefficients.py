"""Coefficients as they stand in a config: numbers, or variables of the nominal by a small vocabulary."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, Strict

from estimfw.config.types import Number, Settings
from estimfw.model.coefficient import Coefficient, constant, identity, matrix, scalar, skew

__all__ = ["CoefficientText", "VariableCoefficient", "coefficient_of"]


class VariableCoefficient(Settings):
    """``{skew: f_n, times: -2}``: exactly one of skew, matrix, scalar; ``times`` multiplies it."""

    skew: Annotated[str | None, Field(description="vector variable v of the nominal: the matrix of v x")] = None
    matrix: Annotated[str | None, Field(description="matrix variable of the nominal")] = None
    scalar: Annotated[str | None, Field(description="scalar variable of the nominal, times the identity")] = None
    times: Annotated[Number, Field(description="a number that multiplies it")] = 1.0


Row = Annotated[tuple[Number, ...], Strict(False)]
CoefficientText = Annotated[
    Number | Annotated[tuple[Row, ...], Strict(False)] | VariableCoefficient,
    Field(description="a number (times the identity), a matrix of numbers row by row, or a variable of the nominal"),
]


def coefficient_of(value: Any, rows: int, columns: int, what: str) -> Coefficient:
    """The coefficient (rows, columns).

    Raises
    ------
    ValueError
        Its shape does not fit.
    """
    made = _make(value, rows, columns, what)
    if made.shape != (rows, columns):
        raise ValueError(f"{what}: coefficient is {made.shape[0]} x {made.shape[1]}, {rows} x {columns} is due")
    return made


def _make(value: Any, rows: int, columns: int, what: str) -> Coefficient:
    if isinstance(value, VariableCoefficient):
        given = [k for k in ("skew", "matrix", "scalar") if getattr(value, k) is not None]
        if len(given) != 1:
            raise ValueError(f"{what}: coefficient needs exactly one of skew, matrix, scalar")
        if value.skew is not None:
            return value.times * skew(value.skew)
        if value.matrix is not None:
            return value.times * matrix(value.matrix, (rows, columns))
        return value.times * identity(rows) * scalar(str(value.scalar))
    if isinstance(value, tuple):
        if len({len(row) for row in value}) != 1:
            raise ValueError(f"{what}: the rows of the coefficient differ in length")
        return constant(value)
    if rows != columns:
        raise ValueError(f"{what}: a number stands for a multiple of the identity, but {rows} x {columns} is due")
    return float(value) * identity(rows)
