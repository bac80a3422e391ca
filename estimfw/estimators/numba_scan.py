"""The recursion compiled by numba: a chunk in one call, the same results as `NumpyScan`."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.scan import Chunk, ChunkResult, FilterSettings, FilterState, Moves, SubSteps, row_offsets
from estimfw.kernels import joseph, ud
from estimfw.kernels.compiled_discretise import HELD_NOISE, SERIES, VAN_LOAN
from estimfw.kernels.generated import compiled_scan_for
from estimfw.model.nominal import BoundProvider
from estimfw.plan.completion import completion
from estimfw.plan.lowering import Lowered
from estimfw.plan.plan import Plan
from estimfw.plan.stages import Stage, in_stage

__all__ = ["NumbaScan"]

FloatArray = NDArray[np.float64]

FORMULAS = {"series": SERIES, "van_loan": VAN_LOAN, "held_noise": HELD_NOISE}


class NumbaScan:
    """As `estimfw.estimators.numpy_scan.NumpyScan`, for plans whose derived variables have compiled twins."""

    name = "numba"

    def __init__(
        self,
        plan: Plan,
        provider: BoundProvider | None,
        settings: FilterSettings,
        initial_row: FloatArray,
        prior: tuple[FloatArray, FloatArray],
    ) -> None:
        self.plan, self.provider, self.settings = plan, provider, settings
        self.doublings = SubSteps(plan, initial_row)
        completed = completion(plan)
        self.width = completed.size
        self.scan = compiled_scan_for(provider.compiled if provider is not None else None, completed)
        kernel = ud if settings.covariance == "ud" else joseph
        self.prior = (np.ascontiguousarray(prior[0], dtype=float), np.ascontiguousarray(kernel.factor(prior[1])))
        self.params = provider.params if provider is not None else np.zeros(1)
        self.process, self.reads = self._process(), self._reads()
        self.measurements = self._measurements()
        self.watched = np.array(plan.watched, dtype=np.int64)
        self.correction = (
            *plan.correction.tables(),
            np.array(plan.corrected, dtype=np.bool_),
            plan.correction.shape[0],
        )
        self._load(initial_row)

    def begun(self, doublings: SubSteps, mean: FloatArray, form: FloatArray) -> NumbaScan:
        """The same recursion with the sub-steps and the prior of another run, its covariance in the kernel's form."""
        other = copy(self)
        other.doublings, other.prior = doublings, (np.ascontiguousarray(mean), np.ascontiguousarray(form))
        return other

    def in_stage(self, stage: Stage) -> NumbaScan:
        """The same recursion in a stage of its plan, see `estimfw.plan.stages`."""
        other = copy(self)
        other.plan = in_stage(self.plan, stage)
        other.process, other.measurements = other._process(), other._measurements()
        return other

    def _load(self, row: FloatArray) -> None:
        """Have the machine code loaded, or made, before the run: it is no part of the filter's time."""
        mean, form = self.prior
        n_state, n_sample = (self.provider.n_state, self.provider.n_sample) if self.provider is not None else (0, 1)
        rows, many = row_offsets(self.plan)[-1], len(self.plan.measurements)
        inputs = sum(len(known.axes) for known in self.plan.inputs)
        nothing = Chunk(
            samples=np.zeros((0, n_sample)),
            dt=np.zeros(0),
            restart=np.zeros(0, dtype=bool),
            inputs=np.zeros((0, inputs)),
            readings=np.zeros((0, rows)),
            due=np.zeros((0, many), dtype=bool),
            interval=np.ones((0, many)),
            time=np.zeros(0),
        )
        self.run(FilterState(mean, form, np.zeros(n_state), row), nothing)

    def run(self, state: FilterState, chunk: Chunk) -> tuple[FilterState, ChunkResult]:
        """K steps; see `Chunk` and `ChunkResult`."""
        result = ChunkResult.empty(self.plan, len(chunk), state.provider.shape[-1], self.settings.moves)
        moves = result.moves or Moves.none(0, len(self.plan.states))
        x, form, provider = (np.array(a, order="C") for a in (state.x, state.form, state.provider))
        row = np.concatenate([state.row, np.zeros(self.width - state.row.shape[0])])
        d = self.plan.discretisation
        lengths, which = np.unique(chunk.dt, return_inverse=True)
        doublings = np.array([self.doublings(float(dt)) for dt in lengths], dtype=np.int64)[which]
        wrong = self.scan(
            x, form, provider, self.params, row,
            (
                np.ascontiguousarray(chunk.samples), chunk.dt, chunk.restart, chunk.inputs, chunk.readings, chunk.due,
                chunk.interval,
            ),
            self.process, self.reads, self.measurements,
            (FORMULAS[d.method], d.phi_order, d.q_order), doublings,
            (
                self.settings.covariance == "ud", self.settings.closed_loop, self.watched,
            ),
            self.prior, self.correction,
            (
                result.estimate, result.covariance, result.rows, result.provider, result.innovation, result.sigma, result.nis,
                result.disposition, result.used, result.log_det,
            ),
            (moves.transition, moves.noise, moves.drift, moves.form),
        )  # fmt: skip
        if wrong >= 0:
            result.estimate[wrong + 1 :] = result.covariance[wrong + 1 :] = result.rows[wrong + 1 :] = np.nan
        return FilterState(x, form, provider, row[: self.plan.layout.provided]), result

    def _process(self) -> tuple[Any, ...]:
        plan, n = self.plan, len(self.plan.states)
        F = plan.F.tables()
        live = np.unique(F.entry)
        return (*F, *plan.D.tables(), *plan.B.tables(), live // n, live % n)

    def _reads(self) -> tuple[Any, ...]:
        H = _stacked([m.H for m in self.plan.measurements], len(self.plan.states))
        innovation = _stacked([m.innovation for m in self.plan.measurements], 1)
        return (*H.tables(), *innovation.tables())

    def _measurements(self) -> tuple[Any, ...]:
        plan = self.plan
        offsets = row_offsets(plan)
        most = max((m.rows for m in plan.measurements), default=1)
        R = np.zeros((offsets[-1], most))
        thresholds = np.zeros((len(plan.measurements), most + 1))
        gated = np.zeros(len(plan.measurements), dtype=bool)
        for j, m in enumerate(plan.measurements):
            R[offsets[j] : offsets[j + 1], : m.rows] = np.array(m.R)
            limit = plan.thresholds(m)
            if limit is not None:
                thresholds[j, : m.rows + 1], gated[j] = limit, True
        density = np.array([m.density for m in plan.measurements], dtype=bool)
        sign = np.array([m.sign for m in plan.measurements], dtype=float)
        period = np.array([m.period for m in plan.measurements], dtype=float)
        considered = np.array(plan.considered, dtype=bool)
        return np.array(offsets, dtype=np.int64), R, density, sign, thresholds, gated, period, considered


def _stacked(parts: list[Lowered], columns: int) -> Lowered:
    monomials: list[tuple[int, float, tuple[int, ...]]] = []
    at = 0
    for part in parts:
        monomials.extend((entry + at * columns, c, f) for entry, c, f in part.monomials)
        at += part.shape[0]
    return Lowered((at, columns), tuple(monomials))
