"""The smoother of a run: it watches the filter go, and then goes back over what it saw."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.config.generic.smoother import FixedLagConfig
from estimfw.data.shelf import IN_MEMORY, Shelf
from estimfw.estimators.fixed_lag import FixedLag, Lagged
from estimfw.estimators.links import Linker, Links
from estimfw.estimators.scan import ChunkResult
from estimfw.estimators.stretch import Stretch
from estimfw.kernels import smooth, ud
from estimfw.run.kernel_choice import Scan
from estimfw.run.outputs import output_values
from estimfw.run.prepare import Prepared

__all__ = [
    "Smoothed",
    "Smoothing",
    "chosen_smoothing",
    "smoothing_kernel",
]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Smoothed:
    """Of K steps.

    ``estimate`` and ``sigma`` (K, n), ``output`` and ``output_sigma`` (K, components), ``covariance`` (samples, n, n);
    ``seconds`` is how long it took to get them.
    """

    estimate: FloatArray
    sigma: FloatArray
    output: FloatArray
    output_sigma: FloatArray
    covariance: FloatArray
    seconds: float = 0.0


class Smoothing(ABC):
    """Sees the stretches of a run in order, see `estimfw.estimators.stretch.Watcher`.

    Parameters
    ----------
    prepared : Prepared
    wanted : (samples,) array of int
        Steps of which the whole covariance is kept.
    """

    def __init__(self, prepared: Prepared, wanted: NDArray[np.int64]) -> None:
        self._prepared, self._wanted = prepared, wanted
        self._kernel, self._seconds = smoothing_kernel(prepared.scan), 0.0
        self._linked = Linker(self._kernel, factored=prepared.problem.estimator.covariance == "ud")

    def __call__(self, stretch: Stretch) -> None:
        begin = time.perf_counter()
        self._see(stretch, self._linked(stretch))
        self._seconds += time.perf_counter() - begin

    def smoothed(self) -> Smoothed:
        """Of all steps, once all were seen."""
        begin = time.perf_counter()
        parts = self._parts()
        names = ("estimate", "sigma", "output", "output_sigma", "covariance")
        made = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return Smoothed(**made, seconds=self._seconds + time.perf_counter() - begin)

    @abstractmethod
    def _see(self, stretch: Stretch, links: Links) -> None: ...

    @abstractmethod
    def _parts(self) -> list[Smoothed]: ...

    def _part(self, first: int, estimate: FloatArray, form: FloatArray, rows: FloatArray) -> Smoothed:
        """What is kept of K steps from ``first`` on: estimates, factored covariances, nominal (K, provided)."""
        values, sigmas = smoothed_outputs(self._prepared.problem, estimate, form, rows)
        inside = self._wanted[(self._wanted >= first) & (self._wanted < first + len(estimate))] - first
        U, D = ud.split(form)
        sigma = np.sqrt(np.maximum((U**2 @ D[..., None])[..., 0], 0.0))
        return Smoothed(estimate, sigma, values, sigmas, ud.covariance(form[inside]))


class FixedIntervalSmoothing(Smoothing):
    """Keeps the links of all steps, and goes back over them when the last one is there."""

    def __init__(self, prepared: Prepared, wanted: NDArray[np.int64]) -> None:
        super().__init__(prepared, wanted)
        self._shelf = Shelf(IN_MEMORY)
        self._steps, self._last = 0, np.zeros((0, 0))

    def _see(self, stretch: Stretch, links: Links) -> None:
        self._shelf.lay(links.gain, links.shift, links.rest, stretch.result.estimate, stretch.result.rows)
        self._last, self._steps = links.form[-1], self._steps + len(stretch)

    def _parts(self) -> list[Smoothed]:
        parts: list[Smoothed] = []
        correction, form, end = np.zeros(len(self._last)), self._last, self._steps
        with self._shelf as shelf:
            while len(shelf):
                gain, shift, rest, estimate, rows = shelf.take()
                u, forms = self._kernel.backward(gain, shift, rest, correction, form)
                correction, form, end = u[0], forms[0], end - len(estimate)
                parts.append(self._part(end, estimate + u[1:], forms[1:], rows))
        return parts[::-1]


class FixedLagSmoothing(Smoothing):
    """Smooths each step as soon as the filter is a lag after it; the last ones at the end of the record."""

    def __init__(self, prepared: Prepared, wanted: NDArray[np.int64], lag: float) -> None:
        super().__init__(prepared, wanted)
        self._lag, self._done = FixedLag(lag, self._kernel), list[Smoothed]()
        self._rows: deque[FloatArray] = deque()
        self._count = 0

    def _see(self, stretch: Stretch, links: Links) -> None:
        self._rows.extend(stretch.result.rows)
        self._keep(self._lag.push(stretch.time, links, stretch.result.estimate))

    def _parts(self) -> list[Smoothed]:
        self._keep(self._lag.rest())
        return self._done

    def _keep(self, done: list[Lagged]) -> None:
        if not done:
            return
        rows = np.stack([self._rows.popleft() for _ in done])
        estimate, form = np.stack([one.estimate for one in done]), np.stack([one.form for one in done])
        self._done.append(self._part(self._count, estimate, form, rows))
        self._count += len(done)


def chosen_smoothing(prepared: Prepared, wanted: NDArray[np.int64]) -> Smoothing | None:
    """As the config says; None where it asks for none."""
    cfg = prepared.problem.estimator.smoother
    if cfg is None:
        return None
    if isinstance(cfg, FixedLagConfig):
        return FixedLagSmoothing(prepared, wanted, cfg.lag)
    return FixedIntervalSmoothing(prepared, wanted)


def smoothing_kernel(scan: Scan) -> ModuleType:
    """Compiled where the filter is."""
    if scan.name != "numba":
        return smooth
    from estimfw.kernels.generated import compiled_smoother

    return compiled_smoother()


def smoothed_outputs(
    problem: Problem, estimate: FloatArray, form: FloatArray, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values and sigmas (K, all components) of the outputs for smoothed states, which correct the nominal rows (K, provided).

    ``form`` (K, n, n): their covariances, factored.
    """
    empty = np.zeros((len(estimate), 0))
    if not problem.plan.outputs:
        return empty, empty
    complete = problem.plan.layout.complete(rows)
    result = replace(ChunkResult.empty(problem.plan, 0, 0), estimate=estimate, covariance=ud.covariance(form))
    made = [output_values(problem, o, j, result, complete) for o, j in problem.plan.outputs]
    values, sigmas = ([empty, *(each[i] for each in made)] for i in (0, 1))
    return np.concatenate(values, axis=1), np.concatenate(sigmas, axis=1)
