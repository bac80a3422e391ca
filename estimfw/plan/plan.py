"""The plan: the compiled filter. Names are gone but for reports; it holds no record, so its hash depends on none."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from estimfw.model.model import Model
from estimfw.model.nominal import CorrectionSlot
from estimfw.model.parts import KnownInput, Output
from estimfw.model.prior import Prior
from estimfw.plan.correction import correction
from estimfw.plan.discretisation import Discretisation
from estimfw.plan.layout import NominalLayout
from estimfw.plan.lowering import Lowered, lower
from estimfw.plan.separation import Separation
from estimfw.plan.stages import Stage
from estimfw.plan.subsystems import Subsystems
from estimfw.plan.watched import watched

__all__ = ["MeasurementPlan", "Plan", "make_plan", "varying"]

FloatArray = NDArray[np.float64]
Pace = Literal["constant", "stepped", "varying"]


@dataclass(frozen=True, slots=True)
class MeasurementPlan:
    """One measurement model, lowered.

    ``R`` is per measurement, or a density that is divided by the measurement's interval. ``gate`` is the probability of the
    chi-square gate, None without one. ``period`` is that of rows that wrap (0: they do not).
    """

    name: str
    labels: tuple[str, ...]
    unit: str
    H: Lowered
    innovation: Lowered
    R: tuple[tuple[float, ...], ...]
    density: bool
    stream: str | None
    columns: tuple[str, ...]
    sign: float
    every: float | None
    gate: float | None
    period: float = 0.0

    @property
    def rows(self) -> int:
        return len(self.labels)


@dataclass(frozen=True, slots=True)
class Plan:
    """Index maps and coefficients of one filter.

    Attributes
    ----------
    states, units : tuple of str
    layout : NominalLayout
    F, D, B : Lowered
        Dynamics, diffusion G Q G^T, known-input coupling.
    inputs : tuple of KnownInput
    measurements : tuple of MeasurementPlan
    prior : Prior
    correction : Lowered
        (3 * slots of the provider, states): the provider's correction from the estimate, see `estimfw.plan.correction`.
    discretisation : Discretisation
    varying : tuple of (what, variable, change)
        Why it is not time-invariant; empty if it is.
    outputs : tuple of (Output, Lowered Jacobian)
    subsystems : Subsystems or None
        The nodes of a decentralised filter; see `estimfw.plan.subsystems.cut`.
    stages : tuple of Stage
        What is believed when, see `estimfw.plan.stages`; empty: all states are estimated all the time.
    considered : (n,) tuple of bool, or empty
        States that get no gain though their covariance counts, in the plan of a stage; empty: none.
    """

    states: tuple[str, ...]
    units: tuple[str, ...]
    layout: NominalLayout
    F: Lowered
    D: Lowered
    B: Lowered
    inputs: tuple[KnownInput, ...]
    measurements: tuple[MeasurementPlan, ...]
    prior: Prior
    correction: Lowered
    discretisation: Discretisation
    varying: tuple[tuple[str, str, str], ...]
    outputs: tuple[tuple[Output, Lowered], ...] = ()
    subsystems: Subsystems | None = None
    stages: tuple[Stage, ...] = ()
    considered: tuple[bool, ...] = ()

    @property
    def whole(self) -> Plan:
        """The plan before it was cut into subsystems: what the model says."""
        return self if self.subsystems is None else self.subsystems.whole

    @property
    def separation(self) -> Separation | None:
        """How filters side by side are kept apart; None for an optimal filter."""
        return None if self.subsystems is None else self.subsystems.separation

    @property
    def time_invariant(self) -> bool:
        return not self.varying

    @property
    def pace(self) -> Pace:
        """How often Phi and Q change between steps of one length: never, at times, or always; what is measured may vary."""
        measured = {f"measurement {m.name}" for m in self.measurements}
        changes = {change for what, _, change in self.varying if what not in measured}
        return "varying" if "varying" in changes else "stepped" if changes else "constant"

    @property
    def steady(self) -> bool:
        """Whether Phi and Q are the same at every step of one length; what is measured may vary."""
        return self.pace == "constant"

    @property
    def watched(self) -> tuple[int, ...]:
        """Positions in the provided part of a row: while these stay, and length of step and inputs, so do Phi, Q and d."""
        return watched(self.layout, (self.F, self.D, self.B))

    @property
    def corrected(self) -> tuple[bool, ...]:
        """Which states correct the provider, and are zero after it."""
        n = len(self.states)
        live = {entry % n for entry, _, _ in self.correction.monomials}
        return tuple(i in live for i in range(n))

    @property
    def reason(self) -> str:
        """Why Phi and Q are (not) the same at every step, for people."""
        if self.time_invariant:
            return "no live coefficient needs a varying nominal variable: Phi and Q are made once a segment"
        return "; ".join(f"{what} needs {variable}, which is {change}" for what, variable, change in self.varying)

    @property
    def hash(self) -> str:
        """SHA-256 over everything in it, as hexadecimal text."""
        return hashlib.sha256(repr(_canonical(self)).encode()).hexdigest()

    def thresholds(self, measurement: MeasurementPlan) -> FloatArray | None:
        """Largest NIS that is fused, by number of usable components (rows + 1,); None without a gate."""
        if measurement.gate is None:
            return None
        # The quantile of chi-square, without the half second that scipy.stats takes to import.
        from scipy.special import gammaincinv

        halves = 0.5 * np.arange(1, measurement.rows + 1)
        return np.concatenate([[0.0], 2.0 * gammaincinv(halves, measurement.gate)])

    def discretised(
        self, rows: FloatArray, u: FloatArray, dt: FloatArray, doublings: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Phi, Q (..., n, n) and d (..., n) for complete process rows (..., size) and inputs u (..., inputs)."""
        F, D = self.F.evaluate(rows), self.D.evaluate(rows)
        b = (self.B.evaluate(rows) @ u[..., None])[..., 0]  # einsum leaves a sum over no inputs uninitialised
        Phi, Q, d = self.discretisation.apply(F, D, b, dt, doublings)
        return (Phi, Q, d) if self.separation is None else (*self.separation.transition(Phi, Q), d)

    def transitions(
        self, rows: FloatArray, inputs: FloatArray, dt: FloatArray, doublings: Callable[[float], int]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Phi, Q (K, n, n) and d (K, n) of K steps at once; unless they change at every step, equal ones are made once.

        Parameters
        ----------
        rows : (K, size) array
            Complete process rows.
        inputs : (K, inputs) array
        dt : (K,) array, s
            A step of no length leaves everything as it is.
        doublings : callable
            Sub-steps of a step of this length, see `Discretisation.doublings`.
        """
        steps, n = dt.shape[0], len(self.states)
        Phi, Q, d = np.broadcast_to(np.eye(n), (steps, n, n)).copy(), np.zeros((steps, n, n)), np.zeros((steps, n))
        for length in np.unique(dt[dt > 0.0]):
            own = np.flatnonzero(dt == length)
            first, each = self._unlike(rows[own], inputs[own])
            made = self.discretised(rows[own[first]], inputs[own[first]], np.array(length), doublings(float(length)))
            Phi[own], Q[own], d[own] = (m[each] for m in made)
        return Phi, Q, d

    def _unlike(self, rows: FloatArray, inputs: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Steps of one length whose matrices may differ, and for each step which of these it is like."""
        if self.pace == "varying":
            every = np.arange(len(rows))
            return every, every
        seen = np.hstack([rows[:, list(self.watched)], inputs])
        _, first, each = np.unique(seen, axis=0, return_index=True, return_inverse=True)
        return first, each.ravel()

    def design(self, rows: FloatArray) -> FloatArray:
        """H (..., all rows of all measurements one behind the other, n) for complete nominal rows (..., size) at a step's end."""
        lead, n = rows.shape[:-1], len(self.states)
        return np.concatenate([np.zeros((*lead, 0, n)), *(m.H.evaluate(rows) for m in self.measurements)], axis=-2)

    def noise(self, interval: FloatArray) -> FloatArray:
        """R (K, all rows, all rows) for the intervals (K, measurements) in s that the measurements of K steps stand for."""
        total, at = sum(m.rows for m in self.measurements), 0
        R = np.zeros((interval.shape[0], total, total))
        for j, m in enumerate(self.measurements):
            own = slice(at, at + m.rows)
            R[:, own, own] = np.array(m.R) / (interval[:, j, None, None] if m.density else 1.0)
            at += m.rows
        return R if self.subsystems is None else self._with_noise_between(R, interval)

    def _with_noise_between(self, R: FloatArray, interval: FloatArray) -> FloatArray:
        at = np.cumsum([0, *(m.rows for m in self.measurements)])
        for pair in self.subsystems.noise if self.subsystems is not None else ():
            i, j = (slice(at[place], at[place + 1]) for place in (pair.first, pair.second))
            own = np.array(pair.R) / (
                interval[:, pair.first, None, None] if self.measurements[pair.first].density else 1.0
            )
            R[:, i, j], R[:, j, i] = own, np.swapaxes(own, -1, -2)
        return R


def _canonical(value: Any) -> Any:
    """Nested tuples of names and numbers: functions by their qualified name, so that no address gets in."""
    if is_dataclass(value) and not isinstance(value, type):
        inner = tuple((f.name, _canonical(getattr(value, f.name))) for f in fields(value) if f.compare)
        return (type(value).__name__, inner)
    if isinstance(value, tuple):
        return tuple(_canonical(v) for v in value)
    if isinstance(value, float):
        return float(value) + 0.0  # equal numbers, equal text: neither a NumPy scalar nor -0.0 gets in
    if callable(value):
        return f"{value.__module__}.{value.__qualname__}"
    return value


def make_plan(
    model: Model,
    layout: NominalLayout,
    slots: tuple[CorrectionSlot, ...],
    discretisation: Discretisation,
    gates: dict[str, float | None],
) -> Plan:
    """Lower a model.

    Raises
    ------
    ConfigError
        The model needs a nominal variable that the layout does not have, or a block cannot be taken to its slot's frame.
    """
    return Plan(
        states=model.states,
        units=tuple(b.unit for b in model.blocks for _ in b.axes),
        layout=layout,
        F=lower(model.F.coefficient, layout),
        D=lower(model.diffusion, layout),
        B=lower(model.B.coefficient, layout),
        inputs=model.inputs,
        measurements=tuple(_measurement(model, m.name, layout, gates.get(m.name)) for m in model.measurements),
        prior=model.prior,
        correction=lower(correction(model, slots), layout),
        discretisation=discretisation,
        varying=tuple(varying(model, layout)),
        outputs=tuple((o, lower(model.jacobian(o), layout)) for o in model.outputs),
    )


def _measurement(model: Model, name: str, layout: NominalLayout, gate: float | None) -> MeasurementPlan:
    m = model.measurement(name)
    return MeasurementPlan(
        name=name,
        labels=m.labels,
        unit=m.unit,
        H=lower(model.H(name).coefficient, layout),
        innovation=lower(model.innovation(name), layout),
        R=tuple(tuple(float(x) for x in row) for row in model.R(name)),
        density=m.noise == "density",
        stream=m.stream,
        columns=tuple(m.columns[i] for i in m.live) if m.stream else (),
        sign=m.sign,
        every=m.every,
        gate=gate,
        period=m.period,
    )


def varying(model: Model, layout: NominalLayout) -> list[tuple[str, str, str]]:
    """(what, variable, change) of all that keeps a model from being time-invariant."""
    found: list[tuple[str, str, str]] = []
    names = {n.name for n in model.noises}

    def look(what: str, needs: frozenset[str]) -> None:
        found.extend((what, variable, layout.changes(variable)) for variable in layout.reasons(needs))

    for term in model.terms:
        if term.source not in names:
            look(term.label, model.term_matrix(term).needs)
    moving = layout.reasons(model.diffusion.needs)
    for term in model.terms:
        if term.source in names and moving:
            look(term.label, model.term_matrix(term).needs & model.diffusion.needs)
    for m in model.measurements:
        look(f"measurement {m.name}", model.H(m.name).coefficient.needs)
    return found
