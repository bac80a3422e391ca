"""Honest sigmas along a run of a reduced filter: those of its errors on the truth model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.dual_covariance import DualCovariance, JointMoments
from estimfw.analysis.error_sources import Source, all_sources
from estimfw.config.truth import Truth
from estimfw.errors import NumericalError
from estimfw.estimators.stretch import Stretch
from estimfw.run.found_start import with_found_covariance
from estimfw.run.prepare import Prepared

__all__ = ["Honest", "HonestSigma", "TruthStart", "of_reported", "output_moments", "truth_start"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TruthStart:
    """The truth model at the start of a run.

    ``mean`` (a,) and ``covariance`` (a, a) of its states, ``map`` (n, a) to those of the filter.
    """

    mean: FloatArray
    covariance: FloatArray
    map: FloatArray


def truth_start(prepared: Prepared, truth: Truth) -> TruthStart:
    """Prior of the truth model, with the covariance of a start that was found."""
    layout = truth.plan.plan.layout
    row = layout.complete(prepared.state.row)
    nominal = layout.unpack(row)
    mean, covariance = truth.plan.plan.prior.evaluate(nominal)
    found = with_found_covariance(truth.model.model, covariance, prepared.start, nominal)
    return TruthStart(mean, found, truth.plan.map.evaluate(row))


def output_moments(truth: Truth, stretch: Stretch, joint: JointMoments) -> FloatArray:
    """Mean squares (K, S, all components) of the errors of the filter's outputs."""
    plan, layout = stretch.plan, truth.plan.plan.layout
    ran, rows = stretch.rows[1][joint.steps], stretch.best_rows[1][joint.steps]
    own_rows, true_rows = plan.layout.complete(rows), layout.complete(rows)
    parts = []
    for (_, own), true in zip(plan.outputs, truth.plan.jacobians, strict=True):
        J = own.evaluate(own_rows)
        J_t = true.evaluate(true_rows) if true is not None else np.zeros((*J.shape[:-1], joint.map.shape[-1]))
        parts.append(joint.outputs(own.evaluate(ran), J, J_t))
    return np.concatenate(parts, axis=2) if parts else np.zeros((len(rows), joint.sources, 0))


@dataclass(frozen=True)
class Honest:
    """``sigma`` (K, n) of the states, ``output_sigma`` (K, components), ``covariance`` (samples, n, n)."""

    sigma: FloatArray
    output_sigma: FloatArray
    covariance: FloatArray


class HonestSigma:
    """Watches a run.

    Parameters
    ----------
    prepared : Prepared
    truth : Truth
    wanted : (samples,) array of int
        Steps of which the whole covariance is kept.

    Attributes
    ----------
    lost : str
        Why there is no honest sigma: the errors on the truth model left the numbers, which is no fault of the filter.
    """

    def __init__(self, prepared: Prepared, truth: Truth, wanted: NDArray[np.int64]) -> None:
        start = truth_start(prepared, truth)
        sources: tuple[Source, ...] = all_sources(start.mean, start.covariance, start.map, prepared.prior[0])
        self._truth, self._wanted, self._at = truth, wanted, 0
        self._parts: list[Honest] = []
        self.lost = ""
        try:
            self._dual = DualCovariance(truth.plan, sources, prepared.state.row)
        except NumericalError as error:
            self.lost = error.message

    def __call__(self, stretch: Stretch) -> None:
        if self.lost:
            return
        try:
            for joint in self._dual.advance(stretch):
                self._keep(stretch, joint)
        except NumericalError as error:
            self.lost = error.message
        self._at += len(stretch)

    def _keep(self, stretch: Stretch, joint: JointMoments) -> None:
        covariance = joint.state_covariance()
        inside = np.isin(joint.steps + self._at, self._wanted)
        self._parts.append(
            Honest(
                _root(np.einsum("kii->ki", covariance)),
                _root(output_moments(self._truth, stretch, joint)[:, 0]),
                covariance[inside],
            )
        )

    @property
    def begun(self) -> bool:
        """Whether any step is known."""
        return bool(self._parts)

    def collected(self) -> Honest:
        """All of it so far."""
        return Honest(
            *(
                np.concatenate([getattr(p, name) for p in self._parts])
                for name in ("sigma", "output_sigma", "covariance")
            )
        )


def of_reported(members: Sequence[HonestSigma], best: NDArray[np.int64], wanted: NDArray[np.int64]) -> Honest:
    """At each step that of the member ``best`` (K,) of a bank; ``wanted`` are the steps of the covariances.

    NaN where it was lost.
    """
    if len(members) == 1:
        return members[0].collected()
    known = {i: one.collected() for i, one in enumerate(members) if one.begun}

    def picked(name: str, which: NDArray[np.int64]) -> FloatArray:
        values = {i: getattr(one, name) for i, one in known.items()}
        made = np.full((which.size, *next(iter(values.values())).shape[1:]), np.nan)
        for i, own in values.items():
            at = np.flatnonzero(which[: len(own)] == i)
            made[at] = own[at]
        return made

    return Honest(picked("sigma", best), picked("output_sigma", best), picked("covariance", best[wanted]))


def _root(square: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(square, 0.0))
