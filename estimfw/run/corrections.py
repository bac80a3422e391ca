"""What a correction was good for: errors of a recorded trajectory before and after it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimfw.run.outputs import wrapped

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Correction", "Misses", "corrections", "corrections_json"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Misses:
    """Root mean square, and at the end, over the instants whose truth is known, in the unit of the `Correction`; NaN without."""

    rms: float
    end: float


@dataclass(frozen=True, slots=True)
class Correction:
    """Of one output.

    Attributes
    ----------
    label, unit : str
        ``unit`` is that in which its errors are told, m of a latitude.
    before, after : Misses
        Errors as recorded, and corrected.
    smoothed : Misses or None
        Of the smoothed trajectory, where there is one.
    by : float
        What it was corrected by at the end: recorded minus corrected.
    sigma, honest : float
        Of the corrected value there: the filter's own, and that on the truth model (of a reduced or staged filter, else NaN).
    """

    label: str
    unit: str
    before: Misses
    after: Misses
    smoothed: Misses | None
    by: float
    sigma: float
    honest: float

    @property
    def trusted(self) -> float:
        """The sigma to go by: the honest one where there is one."""
        return self.honest if math.isfinite(self.honest) else self.sigma


def corrections(dataset: xr.Dataset) -> tuple[Correction, ...]:
    """Of every output; none of a result whose nominal was not recorded."""
    if "output_recorded" not in dataset or not dataset.sizes["time"]:
        return ()
    return tuple(_of(dataset, i) for i in range(dataset.sizes["output"]))


def corrections_json(dataset: xr.Dataset) -> dict[str, Any]:
    """By the label of the output, in the unit that is told with it; empty where there is nothing to tell."""
    return {
        one.label: {
            "unit": one.unit,
            "correction": one.by,
            "sigma": one.sigma,
            **({"honest_sigma": one.honest} if math.isfinite(one.honest) else {}),
            **{
                f"error_{name}": {"rms": misses.rms, "end": misses.end}
                for name, misses in (("before", one.before), ("after", one.after), ("smoothed", one.smoothed))
                if misses is not None
            },
        }
        for one in corrections(dataset)
    }


def _of(dataset: xr.Dataset, i: int) -> Correction:
    told = str(dataset["output_error_unit"].to_numpy()[i])
    unit = told or str(dataset["output_display_unit"].to_numpy()[i])
    display = 1.0 if told else float(dataset["output_display_scale"].to_numpy()[i])
    scale = dataset["output_error_scale"].to_numpy()[:, i] * display
    period = float(dataset["output_period"].to_numpy()[i])

    def column(name: str) -> FloatArray:
        return np.asarray(dataset[name].to_numpy()[:, i], dtype=float)

    truth = column("output_truth") if "output_truth" in dataset else np.full(scale.size, np.nan)
    known = np.flatnonzero(np.isfinite(truth))
    last = int(known[-1]) if known.size else -1

    def misses(name: str) -> Misses:
        if not known.size:
            return Misses(float("nan"), float("nan"))
        error = wrapped(column(name) - truth, period)[known] * scale[known]
        return Misses(float(np.sqrt(np.mean(error**2))), float(error[-1]))

    def sigma(name: str) -> float:
        return float(column(name)[last] * scale[last]) if name in dataset else math.nan

    by = wrapped(column("output_recorded") - column("output_value"), period)
    smoothed = misses("smoothed_output") if "smoothed_output" in dataset else None
    return Correction(
        str(dataset["output"].to_numpy()[i]), unit, misses("output_recorded"), misses("output_value"), smoothed,
        float(by[last] * scale[last]), sigma("output_sigma"), sigma("output_honest_sigma"),
    )  # fmt: skip
