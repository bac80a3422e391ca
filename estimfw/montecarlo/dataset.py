"""The labelled result of a Monte Carlo.

Dimensions ``run``, ``time`` (a grid of step ends), ``state``, maybe ``output``, ``measurement``, ``quantity`` (what NEES is made
of: all states, a block, a state, an output). SI units; nothing depends on the clock or on who computed it.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.moments import Moments
from estimfw.montecarlo.campaign import Campaign, manifest_of
from estimfw.montecarlo.verdicts import judged

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SHEET", "campaign_dataset"]

FloatArray = NDArray[np.float64]

#: Long names, by the name of a variable without ``output_``.
SHEET = {
    "bias": "mean error over the runs",
    "spread": "standard deviation of the error over the runs",
    "rms": "root mean square of the error over the runs",
    "sigma": "root of the mean variance that the filter says",
    "ratio": "rms over the filter's own sigma",
    "honest_sigma": "honest sigma, of the first run",
    "honest_ratio": "rms over the honest sigma",
    "end_error": "error of each run at the last instant",
    "end_sigma": "the filter's sigma of each run at the last instant",
    "nees": "normalised estimation error squared, mean over the runs",
    "run_nees": "NEES of each run, mean over time",
    "end_nees": "NEES of each run at the last instant",
    "honest_nees": "NEES with the honest covariance, mean over the runs",
    "honest_run_nees": "NEES of each run with the honest covariance, mean over time",
    "honest_end_nees": "NEES of each run with the honest covariance at the last instant",
    "nis": "normalised innovation squared, mean over the runs and since the instant before",
    "nis_samples": "innovations behind each NIS",
    "run_nis": "NIS of each run, mean over time",
    "gated": "share of the epochs of each run at which a gate refused the measurement",
}


def campaign_dataset(done: Campaign, confidence: float = 0.95) -> xr.Dataset:
    """The statistics of a Monte Carlo, and its verdicts (attribute ``judged``, JSON) at this confidence."""
    import xarray as xr

    task, part = done.task, done.part
    variables = {**_errors(done), **_nees(part), **_nis(done)}
    coordinates: dict[str, Any] = {
        "time": ("time", task.time[task.grid], {"units": "s", "long_name": "time, end of the step"}),
        "run": ("run", np.arange(task.runs)),
        "quantity": ("quantity", [q.name for q in task.quantities]),
        "quantity_kind": ("quantity", [q.kind for q in task.quantities]),
        "quantity_freedom": ("quantity", np.array([q.freedom for q in task.quantities], dtype=np.int64)),
        "measurement": ("measurement", [m.name for m in task.problem.plan.measurements]),
        "measurement_freedom": (
            "measurement",
            np.array([m.rows for m in task.problem.plan.measurements], dtype=np.int64),
        ),
    }
    for axis in ("state", "output"):
        coordinates |= {str(name): c for name, c in done.nominal.coords.items() if c.dims == (axis,)}
    made = xr.Dataset(variables, coordinates)
    for name in made.data_vars:
        made[name].attrs["long_name"] = SHEET[str(name).removeprefix("output_")]
    problem = task.problem
    provenance = {
        **manifest_of(problem, task.seed, task.runs, done.chunk),
        "config": problem.document.data,
        "source": dict(json.loads(done.nominal.attrs["provenance"]).get("record", {})),
    }
    made.attrs = {
        "title": problem.config.name,
        "confidence": confidence,
        "judged": json.dumps([one.as_json() for one in judged(made, confidence)]),
        "provenance": json.dumps(provenance),
    }
    return made


def _errors(done: Campaign) -> dict[str, Any]:
    """Bias, spread, rms and sigmas of states and of outputs."""
    part, runs = done.part, int(done.part["count"][0])
    n = len(done.task.problem.plan.states)
    error = Moments(runs, part["error_mean"], part["error_deviation"])
    sigma = np.sqrt(part["variance_mean"])
    values = {"bias": error.mean, "spread": error.spread, "rms": error.rms, "sigma": sigma}
    values["ratio"] = _ratio(error.rms, sigma)
    if done.task.honest is not None:
        honest = done.task.honest
        own = np.sqrt(np.maximum(np.einsum("gii->gi", honest.covariance), 0.0))
        values["honest_sigma"] = np.concatenate([own, honest.output_sigma], axis=1)
        values["honest_ratio"] = _ratio(error.rms, values["honest_sigma"])
    made: dict[str, Any] = {}
    for axis, prefix, own_columns in (("state", "", slice(0, n)), ("output", "output_", slice(n, None))):
        if axis == "output" and error.mean.shape[1] == n:
            continue
        made |= {f"{prefix}{name}": (("time", axis), value[:, own_columns]) for name, value in values.items()}
        made[f"{prefix}end_error"] = (("run", axis), part["end_error"][:, own_columns])
        made[f"{prefix}end_sigma"] = (("run", axis), np.sqrt(part["end_variance"][:, own_columns]))
    return made


def _ratio(rms: FloatArray, sigma: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(sigma > 0.0, rms / sigma, np.nan)


def _nees(part: dict[str, FloatArray]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for prefix in ("", "honest_"):
        if f"{prefix}squares_mean" in part:
            made[f"{prefix}nees"] = (("time", "quantity"), part[f"{prefix}squares_mean"])
            made[f"{prefix}run_nees"] = (("run", "quantity"), part[f"{prefix}run_squares"])
            made[f"{prefix}end_nees"] = (("run", "quantity"), part[f"{prefix}end_squares"])
    return made


def _nis(done: Campaign) -> dict[str, Any]:
    """Per squared innovation of all its rows: where some were missing, as if the rest stood for them."""
    part, rows = done.part, np.array([m.rows for m in done.task.problem.plan.measurements], dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        nis, run = part["nis_total"] / part["nis_freedom"] * rows, part["run_nis"] / part["run_nis_freedom"] * rows
    return {
        "nis": (("time", "measurement"), nis),
        "nis_samples": (("time", "measurement"), part["nis_freedom"] / rows),
        "run_nis": (("run", "measurement"), run),
        "gated": (("run", "measurement"), part["run_gated"] / np.maximum(part["run_due"], 1.0)),
    }
