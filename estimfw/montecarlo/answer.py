"""The answer of a Monte Carlo as plain JSON values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from estimfw.run.json_value import without_nan
from estimfw.run.summary import json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["campaign_answer"]

FIGURES = ("bias", "spread", "rms", "sigma", "ratio", "honest_sigma", "honest_ratio")


def campaign_answer(dataset: xr.Dataset) -> dict[str, Any]:
    """Runs, statistics at the last instant, verdicts and provenance; SI units but for outputs, which are in display units."""
    checked = [entry for entry in json_attribute(dataset, "judged", []) if entry["checked"]]
    found = {
        "title": str(dataset.attrs.get("title", "")),
        "runs": int(dataset.sizes["run"]),
        "time": float(dataset["time"].to_numpy()[-1]),
        "confidence": float(dataset.attrs["confidence"]),
        "consistent": all(entry["consistent"] for entry in checked),
        "states": _at_end(dataset, "state", ""),
        "outputs": _at_end(dataset, "output", "output_") if "output" in dataset.sizes else {},
        "judged": json_attribute(dataset, "judged", []),
        "provenance": json_attribute(dataset, "provenance", {}),
    }
    cleaned: dict[str, Any] = without_nan(found)
    return cleaned


def _at_end(dataset: xr.Dataset, axis: str, prefix: str) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for i, label in enumerate(dataset[axis].to_numpy()):
        scale = float(dataset[f"{axis}_display_scale"][i]) if prefix else 1.0
        unit = dataset[f"{axis}_display_unit" if prefix else f"{axis}_unit"].to_numpy()[i]
        figures = {name: f"{prefix}{name}" for name in FIGURES if f"{prefix}{name}" in dataset}
        made[str(label)] = {
            name: float(dataset[key].to_numpy()[-1, i]) * (1.0 if name.endswith("ratio") else scale)
            for name, key in figures.items()
        } | {"unit": str(unit)}
    return made
