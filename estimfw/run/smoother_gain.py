"""What a smoother gained over the run: its sigmas and errors beside those of the filter."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from estimfw.data.record import FloatArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Gain", "gains", "smoother_json", "smoother_text"]

VARIABLES = {
    "output": ("output_sigma", "smoothed_output_sigma", "output_error", "smoothed_output_error"),
    "state": ("sigma", "smoothed_sigma", "error", "smoothed_error"),
}


@dataclass(frozen=True, slots=True)
class Gain:
    """Root mean squares over all epochs of one state or output, in the SI ``unit``; NaN where the truth is not known."""

    label: str
    sigma: float
    smoothed_sigma: float
    error: float
    smoothed_error: float
    unit: str
    display_unit: str
    display_scale: float


def gains(dataset: xr.Dataset) -> tuple[Gain, ...]:
    """Outputs, then states; none where no smoother ran."""
    return tuple(gain for axis, names in VARIABLES.items() for gain in _gains(dataset, axis, names))


def smoother_text(dataset: xr.Dataset) -> str:
    """Which smoother ran, for people; empty where none did."""
    if "smoother" not in dataset.attrs or "smoothed" not in dataset:
        return ""
    cfg = json.loads(str(dataset.attrs["smoother"]))
    every = "all data of the record count at each instant"
    if cfg["kind"] == "fixed_lag":
        lag, time = f"{cfg['lag']:.10g} s", dataset["time"].to_numpy()
        if time.size and cfg["lag"] >= time[-1] - time[0]:
            return f"fixed lag of {lag}, no shorter than the record, so that it is the fixed interval: {every}"
        return f"fixed lag: data up to {lag} after each instant count"
    return f"fixed interval: {every}"


def smoother_json(dataset: xr.Dataset) -> dict[str, Any] | None:
    """The smoother and its gains as plain JSON values in SI; None where none ran."""
    if not smoother_text(dataset):
        return None
    return {
        **json.loads(str(dataset.attrs["smoother"])),
        "over_the_run": [
            {
                "label": one.label,
                "unit": one.unit,
                "sigma_rms": one.sigma,
                "smoothed_sigma_rms": one.smoothed_sigma,
                "error_rms": one.error,
                "smoothed_error_rms": one.smoothed_error,
            }
            for one in gains(dataset)
        ],
    }


def _gains(dataset: xr.Dataset, axis: str, names: tuple[str, ...]) -> Iterator[Gain]:
    if names[1] not in dataset:
        return
    for column, label in enumerate(dataset[axis].to_numpy()):
        sigma, smoothed, error, smoothed_error = (
            _rms(dataset[name].to_numpy()[:, column]) if name in dataset else math.nan for name in names
        )
        yield Gain(
            label=str(label),
            sigma=sigma,
            smoothed_sigma=smoothed,
            error=error,
            smoothed_error=smoothed_error,
            unit=str(dataset[f"{axis}_unit"].to_numpy()[column]),
            display_unit=str(dataset[f"{axis}_display_unit"].to_numpy()[column]),
            display_scale=float(dataset[f"{axis}_display_scale"].to_numpy()[column]),
        )


def _rms(values: FloatArray) -> float:
    """Over what is known."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else math.nan
