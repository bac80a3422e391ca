"""The direct measurement: selected states, or linear combinations of them, read from a stream."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, Strict, model_validator
from pydantic_core import PydanticCustomError

from estimfw.config.generic.blocks import Value, Values
from estimfw.config.generic.coefficients import CoefficientText, coefficient_of
from estimfw.config.generic.values import as_config_error, not_negative, numbers_in, product_unit, refuse_twice
from estimfw.config.quantity_types import refuse
from estimfw.config.types import Names, Number, Settings
from estimfw.errors import ConfigError
from estimfw.model.coefficient import constant
from estimfw.model.parts import Measurement, MeasurementTerm, StateBlock
from estimfw.model.prior import check_covariance
from estimfw.units.quantity import parse_quantity
from estimfw.units.table import NAMED_SI
from estimfw.units.unit import Dimension
from estimfw.units.unit_text import parse_unit

__all__ = ["DirectConfig", "direct"]


class DirectTerm(Settings):
    """One block's part: z += coefficient @ block (left out: its selected ``axes``, one a row)."""

    block: Annotated[str, Field(description="name of the block that is read")]
    axes: Annotated[Names, Field(description="which of its axes (left out: all)")] = ()
    coefficient: Annotated[
        CoefficientText | None,
        Field(description="rows x axes, or a number: what a reading gets of them (left out: one axis a row)"),
    ] = None


class DirectConfig(Settings):
    """z = sum of the blocks' parts + noise.

    ``of`` lists the blocks; ``rows`` names the rows (left out: the axes of the first block); ``stream`` (left out: the entry's
    name) and ``columns`` (left out: the rows) say where the readings come from. The noise says by its unit whether it is per
    measurement (``0.1 m``) or a density (``0.1 m/sqrt(Hz)``); ``correlation`` is a matrix over the rows.
    """

    kind: Literal["direct"]
    of: Annotated[
        tuple[DirectTerm, ...],
        Strict(False),
        Field(min_length=1, description="blocks that are read; their parts add up"),
    ]
    rows: Annotated[Names, Field(description="names of the rows (left out: the axes of the first block)")] = ()
    unit: Annotated[str, Field(description="SI unit of the readings (left out: that of the first block)")] = ""
    noise: Annotated[
        Values, Field(description="sigma per measurement (0.1 m) or density (0.1 m/sqrt(Hz)), by its unit")
    ]
    correlation: Annotated[
        Annotated[tuple[Annotated[tuple[Number, ...], Strict(False)], ...], Strict(False)] | None,
        Field(description="correlation matrix of the noise, row by row (left out: independent rows)"),
    ] = None
    stream: Annotated[
        str | None, Field(description="stream that holds the readings (left out: the name of this entry)")
    ] = None
    columns: Annotated[Names, Field(description="its columns, one for each row (left out: the names of the rows)")] = ()
    perfect: Annotated[bool, Field(description="allow a noise of zero")] = False
    period: Annotated[
        Value | None, Field(description="of readings that wrap, such as 360 deg: the shorter way round is meant")
    ] = None

    @model_validator(mode="after")
    def _square(self) -> Self:
        refuse_twice(self.rows, "rows")
        if self.correlation is not None and any(len(row) != len(self.correlation) for row in self.correlation):
            refuse(
                "the correlation is no square matrix",
                "one row of numbers for each row of the measurement",
                "correlation",
            )
        return self


def direct(name: str, cfg: DirectConfig, context: Any) -> Measurement:
    """The measurement; ConfigError where sizes or units do not fit."""
    first = context.block(cfg.of[0].block)
    rows = cfg.rows or cfg.of[0].axes or first.all_axes
    try:
        covariance, kind = _noise(cfg, cfg.unit or first.unit, rows)
        terms = tuple(_term(t, context.block(t.block), rows, name) for t in cfg.of)
        period = _period(cfg, cfg.unit or first.unit)
    except PydanticCustomError as error:
        raise as_config_error(error) from error
    except ValueError as error:
        raise ConfigError(str(error), within=("of",)) from error
    return Measurement(
        name=name,
        all_rows=rows,
        rows=rows,
        unit=cfg.unit or first.unit,
        terms=terms,
        covariance=covariance,
        noise=kind,
        stream=cfg.stream or name,
        columns=cfg.columns or tuple(row or name for row in rows),
        perfect=cfg.perfect,
        period=period,
    )


def _term(term: DirectTerm, block: StateBlock, rows: tuple[str, ...], name: str) -> MeasurementTerm:
    what = f"measurement {name}, block {term.block}"
    if term.coefficient is not None:
        made = coefficient_of(term.coefficient, len(rows), len(term.axes or block.all_axes), what)
        place = _selection(term.axes or block.all_axes, block, what)
        return MeasurementTerm(block.name, made @ constant(place))
    selected = _selection(term.axes or block.all_axes, block, what)
    if selected.shape[0] != len(rows):
        raise ValueError(f"{what}: {selected.shape[0]} axes for {len(rows)} rows; give a coefficient")
    return MeasurementTerm(block.name, constant(selected))


def _selection(axes: tuple[str, ...], block: StateBlock, what: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    unknown = [a for a in axes if a not in block.all_axes]
    if unknown:
        raise ValueError(f"{what}: no axis {unknown[0]!r}; it has {', '.join(a or '(one)' for a in block.all_axes)}")
    return np.array([[float(a == b) for b in block.all_axes] for a in axes])


def _noise(
    cfg: DirectConfig, unit: str, rows: tuple[str, ...]
) -> tuple[tuple[tuple[float, ...], ...], Literal["per_measurement", "density"]]:
    _refuse_forgotten_unit(cfg, unit)
    kind = _kind(cfg, unit)
    density = product_unit(unit, "sqrt(s)")
    sigma = np.array(numbers_in(cfg.noise, density if kind == "density" else unit, len(rows), "noise"))
    not_negative(sigma.tolist(), cfg.noise, "noise")
    correlation = np.eye(len(rows)) if cfg.correlation is None else np.array(cfg.correlation)
    _check_correlation(correlation, rows)
    return tuple(tuple(float(x) for x in row) for row in sigma[:, None] * correlation * sigma), kind


def _period(cfg: DirectConfig, unit: str) -> float:
    """SI; 0 where readings do not wrap."""
    if cfg.period is None:
        return 0.0
    (period,) = numbers_in(cfg.period, unit, 1, "period")
    if not period > 0.0:
        refuse(f"the period is {cfg.period!r}", "such as 360 deg", "period")
    return period


def _refuse_forgotten_unit(cfg: DirectConfig, unit: str) -> None:
    """A noise in another unit than the block's, where the measurement itself names none."""
    written = _dimension(cfg)
    due = [parse_unit(unit).dimension, parse_unit(product_unit(unit, "sqrt(s)")).dimension]
    if cfg.unit or written is None or written.is_none or written in due:
        return
    per_reading = written * parse_unit("1/sqrt(s)").dimension
    found = NAMED_SI.get(written) or NAMED_SI.get(per_reading) or str(written)
    first = cfg.noise[0] if isinstance(cfg.noise, tuple) else cfg.noise
    refuse(
        f"{first!r} is in {NAMED_SI.get(written, str(written))}, not in {unit}",
        f"the readings are taken to be in {unit}, as the first block; if they are in {found}, say `unit: {found}`",
        "noise",
    )


def _check_correlation(correlation: np.ndarray[Any, np.dtype[np.float64]], rows: tuple[str, ...]) -> None:
    n = len(rows)
    if correlation.shape != (n, n):
        refuse(f"{correlation.shape[0]} x {correlation.shape[0]} where {n} x {n} is due", None, "correlation")
    if np.any(np.diag(correlation) != 1.0):
        refuse("a diagonal that is not 1 everywhere", "correlations are relative to the sigmas in noise", "correlation")
    try:
        check_covariance(correlation, rows, "the correlation")
    except ConfigError as error:
        refuse(error.message, error.hint, "correlation")


def _kind(cfg: DirectConfig, unit: str) -> Literal["per_measurement", "density"]:
    density = parse_unit(product_unit(unit, "sqrt(s)")).dimension
    return "density" if _dimension(cfg) == density else "per_measurement"


def _dimension(cfg: DirectConfig) -> Dimension | None:
    """Of the first noise; None where it cannot be read, which is told where it is made a number."""
    first = cfg.noise[0] if isinstance(cfg.noise, tuple) else cfg.noise
    try:
        return parse_quantity(str(first)).unit.dimension
    except ConfigError:
        return None
