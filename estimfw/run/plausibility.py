"""Whether the data agree with what was believed before: estimates far outside of their priors, and NIS far above expectation.

A wrong start, site, unit or axis leaves its mark where the filter has nothing else to explain it with: a bias of many prior
sigmas. The filter's own sigma does not show that; it shrinks however wrong the model is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.health import DEGRADED
from estimfw.data.record import Event
from estimfw.kernels.fuse import FUSED, GATED
from estimfw.model.model import Model
from estimfw.run.indefinite_noise import INDEFINITE_NOISE
from estimfw.run.summary import events_of, measurement_summaries

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["IMPLAUSIBLE", "cautions", "implausible_events", "unmeasured"]

FloatArray = NDArray[np.float64]

IMPLAUSIBLE = "implausible"
"""Kind of the event."""

MOST_SIGMAS = 5.0
"""Of an estimate from its prior: one state in two million is farther away by chance."""

MOST_NIS = 3.0
"""Mean NIS over its expectation: sigmas are too small by its root."""

MUCH_GATED = 0.05
"""Share of gated epochs: a right filter with a gate of 99 % has a fifth of it."""


def unmeasured(
    model: Model, reference: Mapping[str, FloatArray], prior: tuple[FloatArray, FloatArray], elapsed: FloatArray,
    corrected: frozenset[str],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Mean and sigma (K, n) that the states would have without any measurement.

    Parameters
    ----------
    model : Model
    reference : mapping of str to array
        Nominal at the start.
    prior : tuple of (n,) and (n, n) array
        Mean and covariance at the start.
    elapsed : (K,) array
        Time since the start, s.
    corrected : frozenset of str
        Quantities that the nominal can be corrected for. A state that is an error of the nominal is reset in closed loop,
        and grows with the nominal in open loop, so that its prior says nothing of it.

    Notes
    -----
    Known for states that evolve alone, x' = f x + w: constants, random walks, Gauss-Markov processes. With a PSD q of w,
    x = e^{f t} x_0 and sigma^2 = e^{2 f t} sigma_0^2 + q (e^{2 f t} - 1) / (2 f). NaN for all others.
    """
    mean, variance = prior[0], np.diag(prior[1])
    nominal = model.nominal(reference)
    rate = np.diag(model.F.coefficient.evaluate(nominal))
    noise = np.diag(model.diffusion.evaluate(nominal))
    doubled, t = 2.0 * rate, elapsed[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        grown = np.where(doubled == 0.0, t, np.expm1(doubled * t) / doubled)
        sigma = np.sqrt(np.exp(doubled * t) * variance + noise * grown)
        center = np.exp(rate * t) * mean
    unknown = [not alone for alone in _evolve_alone(model, corrected)]
    center[:, unknown] = sigma[:, unknown] = np.nan
    return center, sigma


def _evolve_alone(model: Model, corrected: frozenset[str]) -> list[bool]:
    driven = {i for i, j, _ in model.F.coefficient.entries if i != j} | {i for i, _, _ in model.B.coefficient.entries}
    free = [b.quantity not in corrected for b in model.blocks for _ in b.axes]
    return [free[i] and i not in driven for i in range(len(free))]


def implausible_events(dataset: xr.Dataset) -> tuple[Event, ...]:
    """States that end more than 5 prior sigmas from their prior, the worst first; each an event at the end of the result.

    Notes
    -----
    What a reduction or a stage leaves out moves estimates too, and contradicts nothing. The estimate less the prior mean is
    e + (x - m), e = x^ - x. By the filter's own account Cov(e, x - m) = -P, P its own variance, and its variance is M - P, M
    that of the prior; errors that it does not know of, of variance H - P where H is the honest one, come on top and do not
    depend on x. So M + max(H - P, 0) is what it may have at most; M where the filter's own account is right.
    """
    time = dataset["time"].to_numpy()
    if "unmeasured_sigma" not in dataset or not time.size:
        return ()
    known, end = dataset["covariance_time"].to_numpy(), float(time[-1])
    unknown = _unknown_variance(dataset)
    found = []
    for i, label in enumerate(dataset["state"].to_numpy()):
        mean, sigma = (
            float(np.interp(end, known, dataset[f"unmeasured_{part}"].to_numpy()[:, i])) for part in ("mean", "sigma")
        )
        off = abs(float(dataset["estimate"].to_numpy()[-1, i]) - mean)
        possible = float(np.sqrt(sigma**2 + unknown[i]))
        if sigma > 0.0 and off > MOST_SIGMAS * possible:
            found.append((off / possible, _told(str(label), off / sigma, off / possible), str(label)))
    return tuple(Event(end, label, IMPLAUSIBLE, text, 1) for _, text, label in sorted(found, reverse=True))


def _unknown_variance(dataset: xr.Dataset) -> FloatArray:
    """(n,) of the errors at the end that the filter's own sigmas leave out; 0 where nothing is known of them."""
    own = dataset["sigma"].to_numpy()[-1]
    if "honest_sigma" not in dataset:
        return np.zeros_like(own)
    more = dataset["honest_sigma"].to_numpy()[-1] ** 2 - own**2
    return np.where(np.isfinite(more), np.maximum(more, 0.0), 0.0)


def _told(label: str, ratio: float, possible: float) -> str:
    less = f" (honest: {possible:.3g})" if possible < 0.99 * ratio else ""
    fault = "the data contradict the configured start, site, units or noise"
    return f"{label} is {ratio:.3g} prior sigmas from its prior{less}: {fault}"


def _refused(dataset: xr.Dataset, measurement: str) -> bool:
    """Whether the last usable reading was gated."""
    codes = dataset[f"{measurement}_disposition"].to_numpy()
    usable = codes[(codes == FUSED) | (codes == GATED)]
    return bool(usable.size) and int(usable[-1]) == GATED


def cautions(dataset: xr.Dataset) -> list[str]:
    """What speaks against the result, the worst of each kind first; empty where nothing does.

    It shows a contradiction where there is one to see. That it is empty proves nothing: what no measurement sees can be wrong.
    """
    told = [event.text for event in events_of(dataset) if event.kind in (IMPLAUSIBLE, INDEFINITE_NOISE)]
    told += [
        f"{e.source} was {e.text}" for e in events_of(dataset) if e.kind == DEGRADED and _refused(dataset, e.source)
    ]
    large = [
        (m.nis_mean / m.freedom, m)
        for m in measurement_summaries(dataset)
        if m.freedom > 0 and m.nis_mean > MOST_NIS * m.freedom
    ]
    for ratio, m in sorted(large, key=lambda pair: -pair[0]):
        told.append(
            f"the mean NIS of {m.name} is {m.nis_mean:.3g} where {m.freedom:.3g} is expected: the sigmas are too small, by "
            f"about {np.sqrt(ratio):.2g} times"
        )
    return [*told, *_much_gated(dataset)]


def _much_gated(dataset: xr.Dataset) -> list[str]:
    """A gate looks at the errors themselves: where it refuses much, sigmas that take the fused rows as given cannot be honest."""
    if "honest_sigma" not in dataset:
        return []
    return [
        f"{m.name} was gated in {100 * m.counts['gated'] / m.total:.0f} % of its epochs: honest sigmas take as given what was "
        "fused, and know nothing of errors for which a gate refuses what would tell them"
        for m in measurement_summaries(dataset)
        if m.counts["gated"] > MUCH_GATED * m.total
    ]
