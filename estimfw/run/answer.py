"""The answer of a run: the last (or a stated) epoch as plain JSON values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from estimfw.errors import UsageError
from estimfw.run.summary import events_of, json_attribute, measurement_summaries

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["answer", "outputs_csv", "until"]


def answer(dataset: xr.Dataset, at: float | None = None) -> dict[str, Any]:
    """States, outputs, dispositions, NIS and provenance.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result.
    at : float, optional
        Instant in s; None: the last epoch.

    Returns
    -------
    dict
        ``states`` maps a label to value, sigma and unit (SI), with truth and error where they are known. Each output is an
        entry of its own (``attitude`` -> ``yaw`` ...), in display units (deg). What is unknown is None.

    Raises
    ------
    UsageError
        The instant lies outside the run.
    """
    row = _row(dataset, at)
    measurements = {
        m.name: {**m.counts, "nis_mean": m.nis_mean, "degrees_of_freedom": m.freedom}
        for m in measurement_summaries(dataset)
    }
    fused = [m for m in measurement_summaries(dataset) if m.counts["fused"]]
    total = sum(m.counts["fused"] for m in fused)
    found = {
        "title": str(dataset.attrs.get("title", "")),
        "time": float(dataset["time"].to_numpy()[row]),
        "steps": int(dataset.sizes["time"]),
        "states": _states(dataset, row),
        **_outputs(dataset, row),
        "dispositions": {word: sum(m.counts[word] for m in measurement_summaries(dataset)) for word in _words(dataset)},
        "mean_nis": sum(m.nis_mean * m.counts["fused"] for m in fused) / total if total else None,
        "measurements": measurements,
        "events": [
            {"time": e.time, "source": e.source, "kind": e.kind, "text": e.text, "count": e.count}
            for e in events_of(dataset)
        ],
        "policies": json_attribute(dataset, "policies", []),
        "equivalence": json_attribute(dataset, "equivalence", []),
        "provenance": json_attribute(dataset, "provenance", {}),
    }
    cleaned: dict[str, Any] = _without_nan(found)
    return cleaned


def outputs_csv(dataset: xr.Dataset) -> str:
    """Outputs over time with their sigmas, in display units; one line an epoch, a header with the units."""
    import pandas as pd

    columns = {"time [s]": dataset["time"].to_numpy()}
    if "output_value" in dataset:
        for i, label in enumerate(dataset["output"].to_numpy()):
            unit, scale = str(dataset["output_display_unit"].to_numpy()[i]), float(dataset["output_display_scale"][i])
            columns[f"{label} [{unit}]"] = dataset["output_value"].to_numpy()[:, i] * scale
            columns[f"{label} sigma [{unit}]"] = dataset["output_sigma"].to_numpy()[:, i] * scale
    return str(pd.DataFrame(columns).to_csv(index=False, float_format="%.12g"))


def until(dataset: xr.Dataset, at: float) -> xr.Dataset:
    """The result cut after an instant (s); UsageError where it lies outside the run."""
    return dataset.isel(time=slice(None, _row(dataset, at) + 1))


def _row(dataset: xr.Dataset, at: float | None) -> int:
    time = dataset["time"].to_numpy()
    if at is None:
        return int(time.size) - 1
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    if not time[0] - step <= at <= time[-1] + step:
        raise UsageError(f"--at {at:g} s lies outside the run, {time[0]:g} to {time[-1]:g} s")
    return int(np.argmin(np.abs(time - at)))


def _words(dataset: xr.Dataset) -> list[str]:
    return list(dict.fromkeys(word for m in measurement_summaries(dataset) for word in m.counts))


def _states(dataset: xr.Dataset, row: int) -> dict[str, Any]:
    known = "truth" in dataset
    found: dict[str, Any] = {}
    for i, label in enumerate(dataset["state"].to_numpy()):
        found[str(label)] = {
            "value": float(dataset["estimate"][row, i]),
            "sigma": float(dataset["sigma"][row, i]),
            "unit": str(dataset["state_unit"].to_numpy()[i]),
        }
        if known:
            found[str(label)] |= {"truth": float(dataset["truth"][row, i]), "error": float(dataset["error"][row, i])}
    return found


def _outputs(dataset: xr.Dataset, row: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if "output_value" not in dataset:
        return found
    for i, label in enumerate(dataset["output"].to_numpy()):
        name, _, component = str(label).partition(".")
        scale = float(dataset["output_display_scale"][i])
        entry = {
            "value": float(dataset["output_value"][row, i]) * scale,
            "sigma": float(dataset["output_sigma"][row, i]) * scale,
            "unit": str(dataset["output_display_unit"].to_numpy()[i]),
        }
        if "output_truth" in dataset:
            entry["truth"] = float(dataset["output_truth"][row, i]) * scale
            entry["error"] = float(dataset["output_error"][row, i]) * scale
        found.setdefault(name, {})[component or name] = entry
    return found


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
