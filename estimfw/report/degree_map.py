"""The heat map of a result: sigma over prior sigma of each state, with time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from estimfw.report.heat_map import HeatMap
from estimfw.report.timescale import TimeScale

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["NOTE", "degree_map"]

NOTE = (
    "The sigma of each state over its prior sigma: 1 (bright) where the measurements tell nothing of it, 0.01 where they make it "
    "a hundred times better known. A state that noise drives may end above 1."
)


def degree_map(dataset: xr.Dataset) -> HeatMap | None:
    """None where the result has no prior sigma, or no state."""
    if "prior_sigma" not in dataset or "sigma" not in dataset or not dataset.sizes["time"]:
        return None
    time = dataset["time"].to_numpy()
    prior = dataset["prior_sigma"].to_numpy()
    scale = TimeScale.of(time)
    values = dataset["sigma"].to_numpy() / np.where(prior > 0.0, prior, np.nan)
    rows = tuple(str(s) for s in dataset["state"].to_numpy())
    return HeatMap("degrees", "Sigma over prior sigma", rows, scale.of_seconds(time), scale.unit, values, NOTE)
