"""What is read off a model: measurements, and outputs, the physical quantities that people want."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from estimfw.model.coefficient import Coefficient
from estimfw.model.derived import DerivedVariable
from estimfw.model.dynamics import axis_labels

__all__ = ["Measurement", "MeasurementTerm", "Output"]


@dataclass(frozen=True, slots=True)
class MeasurementTerm:
    """z += coefficient @ block, taken to the measurement's frame; (all rows, all axes of the block).

    A measurement without a frame (plain rows) reads the block in the frame it was declared in.
    """

    block: str
    coefficient: Coefficient
    label: str = ""


@dataclass(frozen=True, slots=True)
class Measurement:
    """z = H x + v, with z = innovation(nominal) + sign * record.

    Attributes
    ----------
    name : str
    all_rows, rows : tuple of str
        Names of all rows (the axes of the frame where it has one), and of those that live.
    unit : str
    terms : tuple of MeasurementTerm
    covariance : tuple of tuple of float
        (all rows, all rows): SI^2 per measurement, or SI^2 s where ``noise`` is a density.
    noise : 'per_measurement' or 'density'
        A density's variance is covariance / T for a measurement every T s.
    frame : str or None
    innovation : Coefficient or None
        (all rows, 1) over the nominal at the end of the interval.
    stream : str or None
        The stream whose columns enter z; None for a pseudo-measurement that falls due by itself.
    columns : tuple of str
        One a row.
    sign : float
        +1 (z is the reading) or -1 (z is nominal minus reading).
    every : float or None, s
        For a pseudo-measurement: its interval; None: at every step.
    perfect : bool
        R = 0 is meant.
    text : str
    derived : tuple of DerivedVariable
        What innovation and coefficients read that is no sum of products of the nominal: a range, a direction.
    period : float
        360 deg in SI where the rows are angles that wrap, else 0: innovations are taken the shorter way round.
    """

    name: str
    all_rows: tuple[str, ...]
    rows: tuple[str, ...]
    unit: str
    terms: tuple[MeasurementTerm, ...]
    covariance: tuple[tuple[float, ...], ...]
    noise: Literal["per_measurement", "density"]
    frame: str | None = None
    innovation: Coefficient | None = None
    stream: str | None = None
    columns: tuple[str, ...] = ()
    sign: float = 1.0
    every: float | None = None
    perfect: bool = False
    text: str = ""
    derived: tuple[DerivedVariable, ...] = ()
    period: float = 0.0

    @property
    def labels(self) -> tuple[str, ...]:
        return axis_labels(self.name, self.rows)

    @property
    def live(self) -> tuple[int, ...]:
        return tuple(self.all_rows.index(r) for r in self.rows)


@dataclass(frozen=True, slots=True)
class Output:
    """A physical quantity computed from states and nominal.

    Attributes
    ----------
    name : str
    components : tuple of str
        Labels become ``name.component``.
    units, display_units : tuple of str
    value : callable
        ``value(estimates, nominal) -> (..., components)``; ``estimates[block]`` (..., all axes), zero where an axis is gone.
    jacobian : tuple of (block, Coefficient, frame)
        d(components)/d(block's full triad in frame), over nominal and derived variables.
    truth : callable or None
        ``truth(truth values) -> (..., components)``.
    needs : tuple of str
        Nominal variables that ``value`` reads.
    period : float
        360 deg in SI where the components are angles that wrap, else 0.
    error_unit : str
        In which people want its errors, if in another unit than the value: m of a latitude; else empty.
    error_scale : callable or None
        ``error_scale(nominal) -> (..., components)``: from the SI unit to ``error_unit``.
    """

    name: str
    components: tuple[str, ...]
    units: tuple[str, ...]
    display_units: tuple[str, ...]
    value: Callable[..., Any]
    jacobian: tuple[tuple[str, Coefficient, str | None], ...]
    needs: tuple[str, ...] = ()
    truth: Callable[..., Any] | None = None
    period: float = 0.0
    error_unit: str = ""
    error_scale: Callable[..., Any] | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"{self.name}.{c}" for c in self.components)
