"""The answer of a run: its last epoch as plain JSON values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from estimfw.run.bank_end import bank_end
from estimfw.run.corrections import corrections_json
from estimfw.run.json_value import without_nan
from estimfw.run.plausibility import cautions
from estimfw.run.smoother_gain import smoother_json
from estimfw.run.summary import events_of, json_attribute, meaning_of, measurement_summaries

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["answer"]


def answer(dataset: xr.Dataset) -> dict[str, Any]:
    """States, outputs, dispositions, NIS, cautions and provenance, at the last epoch.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result, whole or cut (`estimfw.run.until`).

    Returns
    -------
    dict
        ``states`` maps a label to value, sigma and unit (SI), with the honest sigma of a reduced model, and with truth and
        error where they are known; ``meaning`` says what a state or output stands for that is not what its label says. Each
        output is an entry of its own (``attitude`` -> ``yaw`` ...), in display units (deg). What is unknown is None; a
        determination has no states, and its outputs have no sigma. Of a bank ``bank`` tells the reported member and all weights,
        ``smoother`` what it gained over the run; the last epoch is the filter's.
    """
    row = int(dataset.sizes["time"]) - 1
    smoother = smoother_json(dataset)
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
        **_bank(dataset),
        **_corrections(dataset),
        **({"smoother": smoother} if smoother is not None else {}),
        "cautions": cautions(dataset),
        "dispositions": {word: sum(m.counts[word] for m in measurement_summaries(dataset)) for word in _words(dataset)},
        "mean_nis": sum(m.nis_mean * m.counts["fused"] for m in fused) / total if total else None,
        "measurements": measurements,
        "events": [
            {"time": e.time, "source": e.source, "kind": e.kind, "text": e.text, "count": e.count}
            for e in events_of(dataset)
        ],
        **({"exchange": json_attribute(dataset, "exchange", None)} if "exchange" in dataset.attrs else {}),
        "truth_model": json_attribute(dataset, "truth_model", None),
        "undetermined": json_attribute(dataset, "undetermined", []),
        "policies": json_attribute(dataset, "policies", []),
        "equivalence": json_attribute(dataset, "equivalence", []),
        "provenance": json_attribute(dataset, "provenance", {}),
    }
    cleaned: dict[str, Any] = without_nan(found)
    return cleaned


def _corrections(dataset: xr.Dataset) -> dict[str, Any]:
    told = corrections_json(dataset)
    return {"corrections": told} if told else {}


def _bank(dataset: xr.Dataset) -> dict[str, Any]:
    end = bank_end(dataset)
    if end is None:
        return {}
    return {"bank": {"member": end.member, "weight": end.weight, "since": end.since, "weights": dict(end.weights)}}


def _words(dataset: xr.Dataset) -> list[str]:
    return list(dict.fromkeys(word for m in measurement_summaries(dataset) for word in m.counts))


def _states(dataset: xr.Dataset, row: int) -> dict[str, Any]:
    known = "truth" in dataset
    found: dict[str, Any] = {}
    if "estimate" not in dataset:
        return found
    for i, label in enumerate(dataset["state"].to_numpy()):
        found[str(label)] = {
            "value": float(dataset["estimate"][row, i]),
            "sigma": float(dataset["sigma"][row, i]),
            "unit": str(dataset["state_unit"].to_numpy()[i]),
        }
        if "honest_sigma" in dataset:
            found[str(label)]["honest_sigma"] = float(dataset["honest_sigma"][row, i])
        meaning = meaning_of(dataset, "state", i)
        if meaning:
            found[str(label)]["meaning"] = meaning
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
            **({"sigma": float(dataset["output_sigma"][row, i]) * scale} if "output_sigma" in dataset else {}),
            "unit": str(dataset["output_display_unit"].to_numpy()[i]),
        }
        if "output_honest_sigma" in dataset:
            entry["honest_sigma"] = float(dataset["output_honest_sigma"][row, i]) * scale
        meaning = meaning_of(dataset, "output", i)
        if meaning:
            entry["meaning"] = meaning
        if "output_truth" in dataset:
            entry["truth"] = float(dataset["output_truth"][row, i]) * scale
            entry["error"] = float(dataset["output_error"][row, i]) * scale
        found.setdefault(name, {})[component or name] = entry
    return found
