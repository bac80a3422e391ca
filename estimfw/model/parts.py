"""The parts of a model: state blocks, process terms, noise inputs, known inputs, measurements, outputs.

All are values: frozen, hashable, picklable, equal when equal. A part refers to others by name. Coefficients are written
for full triads in the frame in which they act; where a block lives in another frame, the model inserts the rotation, then
selects the axes that live.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from estimfw.model.coefficient import Coefficient
from estimfw.model.derived import DerivedVariable
from estimfw.model.frame import Frame

__all__ = [
    "BlockParts",
    "DerivedVariable",
    "KnownInput",
    "Measurement",
    "MeasurementTerm",
    "NoiseInput",
    "Output",
    "ProcessParts",
    "ProcessTerm",
    "StateBlock",
]


def _labels(name: str, axes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{name}[{axis}]" if axis else name for axis in axes)


@dataclass(frozen=True, slots=True)
class StateBlock:
    """A named group of states.

    Attributes
    ----------
    name : str
        From the config; state labels are ``name[axis]``.
    all_axes : tuple of str
        Axes of the frame, or the block's own names; ``("",)`` for a single state.
    axes : tuple of str
        Those that live.
    unit, display_unit : str
        SI, and what people read (``deg/h``).
    frame : str or None
    home_frame : str or None
        The frame it was declared in (its truth is known there).
    quantity : str
        The physical quantity whose error it is (``velocity``, ``attitude``, ``position``), by which a provider
        knows what to correct; ``""`` where none does.
    latex : str
        Symbol.
    truth : str
        Name of the truth value (in ``home_frame``) that the state should equal; ``""`` if it is an error of the
        nominal, see ``truth_error``.
    truth_error : callable or None
        ``truth_error(nominal, truth) -> (..., axes)``, a module-level function: the true error of the nominal.
    """

    name: str
    all_axes: tuple[str, ...]
    axes: tuple[str, ...]
    unit: str
    display_unit: str = ""
    frame: str | None = None
    home_frame: str | None = None
    quantity: str = ""
    latex: str = ""
    truth: str = ""
    truth_error: Callable[..., Any] | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        return _labels(self.name, self.axes)

    @property
    def live(self) -> tuple[int, ...]:
        """Positions of the living axes among all axes."""
        return tuple(self.all_axes.index(a) for a in self.axes)

    @property
    def declared_frame(self) -> str | None:
        """The frame in which coefficients that name none are written."""
        return self.home_frame or self.frame

    def in_frame(self, frame: Frame) -> StateBlock:
        """The full triad in another frame."""
        return replace(self, frame=frame.name, home_frame=self.declared_frame, all_axes=frame.axes, axes=frame.axes)


@dataclass(frozen=True, slots=True)
class NoiseInput:
    """A white source: ``psd`` (SI^2 s) per axis, in its frame; axes that drive nothing are gone."""

    name: str
    all_axes: tuple[str, ...]
    axes: tuple[str, ...]
    psd: tuple[float, ...]
    unit: str
    frame: str | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        return _labels(self.name, self.axes)

    @property
    def live(self) -> tuple[int, ...]:
        return tuple(self.all_axes.index(a) for a in self.axes)

    @property
    def is_isotropic_triad(self) -> bool:
        """A full triad with one PSD: a rotation does not change it."""
        return len(self.axes) == len(self.all_axes) == 3 and len(set(self.psd)) == 1


@dataclass(frozen=True, slots=True)
class KnownInput:
    """A source with known values: constant over steps of a schedule.

    ``times`` (s) are the instants from which ``values`` (one row an instant, SI) hold; before the first the input is zero.
    """

    name: str
    axes: tuple[str, ...]
    unit: str
    times: tuple[float, ...]
    values: tuple[tuple[float, ...], ...]

    @property
    def labels(self) -> tuple[str, ...]:
        return _labels(self.name, self.axes)


@dataclass(frozen=True, slots=True)
class ProcessTerm:
    """d(target)/dt += coefficient @ source, both taken to ``frame``.

    Attributes
    ----------
    label : str
        What policies name: ``coriolis``.
    target : str
        A block.
    source : str
        A block, a noise input or a known input.
    coefficient : Coefficient
        (all axes of target, all axes of source), acting in ``frame``.
    frame : str or None
        None: the frame that the target was declared in, if it has one, else the source's.
    text : str
        What it is, for people, with its source (paper, equation).
    aliases : tuple of str
        Former labels.
    """

    label: str
    target: str
    source: str
    coefficient: Coefficient
    frame: str | None = None
    text: str = ""
    aliases: tuple[str, ...] = ()


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

    @property
    def labels(self) -> tuple[str, ...]:
        return _labels(self.name, self.rows)

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

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"{self.name}.{c}" for c in self.components)


@dataclass(frozen=True, slots=True)
class BlockParts:
    """What a block component brings: the block, its prior, and the dynamics that are its own.

    ``mean`` and ``covariance`` (SI, SI^2) are over all axes. ``frames`` are those that it and its terms name.
    """

    block: StateBlock
    covariance: tuple[tuple[float, ...], ...]
    mean: tuple[float, ...]
    terms: tuple[ProcessTerm, ...] = ()
    noises: tuple[NoiseInput, ...] = ()
    frames: tuple[Frame, ...] = ()
    outputs: tuple[Output, ...] = ()
    derived: tuple[DerivedVariable, ...] = ()


@dataclass(frozen=True, slots=True)
class ProcessParts:
    """What a process component brings."""

    terms: tuple[ProcessTerm, ...]
    noises: tuple[NoiseInput, ...] = ()
    frames: tuple[Frame, ...] = ()
    derived: tuple[DerivedVariable, ...] = field(default=())
