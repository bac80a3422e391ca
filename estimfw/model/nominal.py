"""The nominal: the operating point that coefficients are evaluated at, and the provider that makes it.

A *nominal variable* is a named scalar, vector or matrix. A *nominal row* holds all variables of a provider, flattened
(C order) one after the other. A row belongs to an interval: process terms read the row at the start, middle or end of
the interval (a setting of the plan), measurements the row at its end.

A *provider* is a pure scan: ``initial_state``, ``step(state, sample) -> (state, process row, end row)``,
``correct(state, estimate) -> state``, on flat arrays with leading axes. It declares the operations it computes and the
labels of the error model that mirror them, so that model and provider can be kept equivalent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event, Record, Stream

__all__ = [
    "AxisMirror",
    "BoundProvider",
    "CompiledScan",
    "CorrectionSlot",
    "Evaluation",
    "InitialNominal",
    "NominalProvider",
    "NominalVariable",
    "Operation",
    "ProviderSettings",
    "ScheduledProvider",
    "Share",
    "TermMirror",
    "changing_at",
]

FloatArray = NDArray[np.float64]
Evaluation = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True)
class NominalVariable:
    """A named array of the nominal.

    Attributes
    ----------
    name : str
        Such as ``C_bn`` (rotates a vector from b to n), ``f_n``, ``earth_rate_n``, ``gravity``.
    shape : tuple of int
        ``()``, ``(3,)``, ``(3, 3)``.
    unit : str
        SI.
    changes : 'constant', 'stepped' or 'varying'
        ``constant`` over the whole run, ``stepped`` at a few instants, ``varying`` at every step.
    latex : str
        Symbol for equations.
    """

    name: str
    shape: tuple[int, ...]
    unit: str
    changes: Literal["constant", "stepped", "varying"]
    latex: str = ""

    @property
    def size(self) -> int:
        return int(np.prod(self.shape, dtype=int))


@dataclass(frozen=True, slots=True)
class TermMirror:
    """The model has a process term with this label."""

    label: str


@dataclass(frozen=True, slots=True)
class AxisMirror:
    """The model has a block of this quantity, with this axis (any axis if None)."""

    quantity: str
    axis: str | None = None


@dataclass(frozen=True, slots=True)
class Operation:
    """Something a provider computes, and what mirrors it in the error model.

    ``switchable`` False: computed whatever the config says (a recorded trajectory).
    """

    name: str
    mirror: TermMirror | AxisMirror
    switchable: bool = True
    text: str = ""


@dataclass(frozen=True, slots=True)
class CorrectionSlot:
    """A triad that ``correct`` accepts: ``attitude`` in ``n``, three numbers in the order of the frame's axes.

    Without a frame it is what no frame turns, such as a latitude: up to three numbers, in the order of the block's axes.
    """

    quantity: str
    frame: str | None


@dataclass(frozen=True, slots=True)
class Share:
    """The part of a found error that another quantity causes: an accelerometer bias tilts what is levelled with it.

    Attributes
    ----------
    sensitivity : (3, 3) array
        d(found error)/d(quantity), the quantity in the frame in which its block is declared.
    covariance : (3, 3) array
        Of the quantity, as the found covariance assumed it.
    """

    sensitivity: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, slots=True)
class InitialNominal:
    """Where a provider starts.

    Attributes
    ----------
    values : mapping of str to array
        Such as ``C_bn`` (3, 3) or (runs, 3, 3), ``velocity_n`` (3,) m/s. Found ones (`find`) may have a leading axis over
        candidates.
    covariance : mapping of str to (3, 3) array
        By quantity (``attitude``): the full covariance in the frame of that quantity's correction slot (n for
        attitude), where an alignment found one. It replaces the prior of the block of that quantity.
    shares : mapping of str to mapping of str to Share
        By quantity (``attitude``), then by what causes a part of that covariance (``accel_bias``): where the model has a
        block of it, the two are correlated at the start.
    time : float or None, s
        The instant it holds at; the filter starts there. None: at the start of the record.
    source : str
        For people: ``given``, ``inertial-frame alignment over 60 s``.
    candidates : tuple of str
        Where values have a leading axis over starts that cannot be told apart yet (for a bank): their names, for people.
    """

    values: Mapping[str, FloatArray]
    covariance: Mapping[str, FloatArray] = field(default_factory=dict)
    shares: Mapping[str, Mapping[str, Share]] = field(default_factory=dict)
    time: float | None = None
    source: str = "given"
    events: tuple[Event, ...] = ()
    candidates: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ProviderSettings:
    """What the composed problem tells a provider: which operations are computed, and where process rows are taken."""

    computed: frozenset[str]
    evaluation: Evaluation = "middle"


@dataclass(frozen=True, slots=True)
class CompiledScan:
    """Where the numba functions of a provider live, so that generated code can import them.

    ``module`` is importable; ``step(state, sample, params, process_row, end_row)`` and
    ``correct(state, delta, params)`` are ``@njit(cache=True)`` functions that work in place on 1-D float64 arrays.
    """

    module: str
    step: str
    correct: str


class BoundProvider(Protocol):
    """A provider bound to the structure of one model: pure functions over flat float64 arrays.

    ``state`` is (..., n_state), ``sample`` (..., n_sample), rows (..., row size). ``delta`` is (..., 3 * slots).

    It may have ``difference(state, other) -> delta``, the inverse of ``correct``: ``correct(state, difference(state, other))``
    has what ``other`` has in all slots. An unscented filter needs it.
    """

    params: FloatArray
    n_state: int
    n_sample: int
    compiled: CompiledScan | None

    def initial_state(self, initial: InitialNominal) -> FloatArray: ...

    def initial_row(self, initial: InitialNominal) -> FloatArray:
        """The row at the start, before any sample."""
        ...

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        """Samples (steps, n_sample) from the stream; step k uses stream rows ``rows[k] : rows[k + 1]``."""
        ...

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New state, process row and end row."""
        ...

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray: ...


class ScheduledProvider(BoundProvider, Protocol):
    """A bound provider that time alone drives: samples come of intervals, not of a stream."""

    def samples_between(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Samples (steps, n_sample) for intervals from begin (steps,) to end (steps,), s."""
        ...


class NominalProvider(Protocol):
    """A provider as configured, before any data: hashable by its settings, picklable.

    ``stream`` is what drives it, with ``columns`` in the order in which a streaming session takes them; where it has
    ``column_units`` too (SI, one a column), any source that reads logs can bring that stream. None: nothing drives it, and
    ``bind`` returns None; or time alone does, and ``bind`` returns a `ScheduledProvider`. Such a one may have ``instants``, a
    tuple of s at which its rows change: they are ends of steps, see `changing_at`. One that computes what
    is wanted by itself brings ``outputs`` too, a tuple of `estimfw.model.parts.Output` over its nominal row: the result of a
    determination (``estimator: {kind: determination}``), which has no states. One whose nominal was recorded by a device has
    ``as_recorded(record, time)``, a mapping of nominal variables at instants (K,), before any correction: then the result tells
    what the correction was good for, and the corrected trajectory is written.
    """

    kind: str
    operations: tuple[Operation, ...]
    slots: tuple[CorrectionSlot, ...]
    stream: str | None
    columns: tuple[str, ...]
    samples_per_step: int

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        """The layout of a row. What *changes* may depend on the operations that are computed, the layout may not."""
        ...

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        """Every variable, frozen at the start (for policies, ``explain`` and ranks): for a standing base f = [0, 0, g]."""
        ...

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        """The start to use for this record: the given one, else what the record itself says.

        Raises
        ------
        DataError
            Where neither says it.
        """
        ...

    def bind(self, settings: ProviderSettings) -> BoundProvider | None: ...


def changing_at(provider: object) -> tuple[float, ...]:
    """The instants (s) at which a provider says that its rows change; none where it does not say so."""
    return tuple(float(t) for t in getattr(provider, "instants", ()))


DerivedFunction = Callable[..., Any]
