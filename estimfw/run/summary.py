"""A result in a few numbers: values at the end, what became of the measurements, what happened."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import Event, FloatArray
from estimfw.run.json_value import without_nan
from estimfw.run.result_names import DISPOSITIONS, measurement_attribute, measurement_names
from estimfw.run.smoother_gain import smoother_json

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "EndValue",
    "MeasurementSummary",
    "end_outputs",
    "end_states",
    "events_of",
    "json_attribute",
    "meaning_of",
    "measurement_summaries",
    "nis_freedom",
    "summarise",
]


@dataclass(frozen=True, slots=True)
class EndValue:
    """The last known value of a state or an output.

    ``value``, ``sigma``, ``honest`` (the sigma on the truth model, of a reduced model only) and ``error`` (value minus truth) are
    in the SI ``unit``, NaN where unknown; times ``display_scale`` they are in ``display_unit``. ``time`` (s) is that of the last
    row with a value. ``meaning`` says what it stands for, where that is not what its label says; else it is empty. Errors are
    told in ``error_unit`` (m of a latitude), which is ``error_scale`` times SI, where that is not empty.
    """

    label: str
    value: float
    sigma: float
    honest: float
    error: float
    time: float
    unit: str
    display_unit: str
    display_scale: float
    meaning: str = ""
    error_unit: str = ""
    error_scale: float = 1.0

    @property
    def trusted(self) -> float:
        """The sigma to go by: the honest one where there is one."""
        return self.honest if math.isfinite(self.honest) else self.sigma

    def display(self) -> tuple[float, float, float]:
        """Value, sigma and error in the display unit."""
        scale = self.display_scale
        return self.value * scale, self.sigma * scale, self.error * scale


@dataclass(frozen=True, slots=True)
class MeasurementSummary:
    """What became of the epochs of one measurement.

    ``counts`` by disposition; ``nis_mean`` over the fused epochs, to be compared with ``freedom``, the mean number of
    their components (NaN where nothing was fused).
    """

    name: str
    unit: str
    components: int
    counts: dict[str, int]
    nis_mean: float
    freedom: float

    @property
    def total(self) -> int:
        """Number of epochs."""
        return sum(self.counts.values())


def end_states(dataset: xr.Dataset) -> tuple[EndValue, ...]:
    """The states at the end, in the order of the model; none for an estimator without states."""
    return tuple(_end_values(dataset, "state", "estimate", "sigma", "honest_sigma", "error"))


def end_outputs(dataset: xr.Dataset) -> tuple[EndValue, ...]:
    """The physical outputs at the end."""
    return tuple(_end_values(dataset, "output", "output_value", "output_sigma", "output_honest_sigma", "output_error"))


def measurement_summaries(dataset: xr.Dataset) -> tuple[MeasurementSummary, ...]:
    """One summary for each measurement of the result."""
    return tuple(_measurement_summary(dataset, name) for name in measurement_names(dataset))


def nis_freedom(dataset: xr.Dataset, measurement: str) -> NDArray[np.int64]:
    """Degrees of freedom of each NIS (N,): the components that have an innovation, or else those that were fused."""
    if f"{measurement}_innovation" in dataset:
        known = np.isfinite(dataset[f"{measurement}_innovation"].to_numpy())
        return np.asarray(known.sum(axis=1), dtype=np.int64)
    return np.asarray(dataset[f"{measurement}_used"].to_numpy(), dtype=np.int64)


def events_of(dataset: xr.Dataset) -> tuple[Event, ...]:
    """The events of the result, in the order of the file."""
    if "event_time" not in dataset:
        return ()
    columns = (dataset[f"event_{part}"].to_numpy() for part in ("time", "source", "kind", "text", "count"))
    return tuple(
        Event(float(time), str(source), str(kind), str(text), int(count))
        for time, source, kind, text, count in zip(*columns, strict=True)
    )


def json_attribute(dataset: xr.Dataset, name: str, default: Any) -> Any:
    """An attribute that holds JSON text; ``default`` where the result has none. Raises ValueError if it is no JSON."""
    text = dataset.attrs.get(name)
    return default if text is None else json.loads(str(text))


def meaning_of(dataset: xr.Dataset, axis: str, column: int) -> str:
    """What a state or an output (``axis``) stands for, where that is not what its label says; else empty."""
    if f"{axis}_meaning" not in dataset.coords:
        return ""
    label, meaning = (str(dataset[name].to_numpy()[column]) for name in (axis, f"{axis}_meaning"))
    return meaning if meaning != label else ""


def summarise(dataset: xr.Dataset) -> dict[str, Any]:
    """The summary as plain JSON values, in SI units and in display units; unknown numbers are None."""
    time = dataset["time"].to_numpy()
    smoother = smoother_json(dataset)
    summary = {
        "title": str(dataset.attrs.get("title", "")),
        "start": float(time[0]) if time.size else None,
        "end": float(time[-1]) if time.size else None,
        "steps": int(time.size),
        "outputs": [_as_json(value) for value in end_outputs(dataset)],
        "states": [_as_json(value) for value in end_states(dataset)],
        **({"smoother": smoother} if smoother is not None else {}),
        "measurements": [
            {
                "name": one.name,
                "epochs": one.total,
                **one.counts,
                "nis_mean": one.nis_mean,
                "degrees_of_freedom": one.freedom,
            }
            for one in measurement_summaries(dataset)
        ],
        "events": _event_counts(events_of(dataset)),
        **({"exchange": json_attribute(dataset, "exchange", None)} if "exchange" in dataset.attrs else {}),
        "policies": json_attribute(dataset, "policies", []),
        "equivalence": json_attribute(dataset, "equivalence", []),
        "provenance": json_attribute(dataset, "provenance", {}),
    }
    cleaned: dict[str, Any] = without_nan(summary)
    return cleaned


def _end_values(dataset: xr.Dataset, axis: str, value: str, sigma: str, honest: str, error: str) -> Iterator[EndValue]:
    if value not in dataset:
        return
    values = dataset[value].to_numpy()
    time = dataset["time"].to_numpy()
    for column, label in enumerate(dataset[axis].to_numpy()):
        known = np.flatnonzero(np.isfinite(values[:, column]))
        row = int(known[-1]) if known.size else -1
        yield EndValue(
            label=str(label),
            value=_at(values, row, column),
            sigma=_at(dataset[sigma].to_numpy(), row, column) if sigma in dataset else math.nan,
            honest=_at(dataset[honest].to_numpy(), row, column) if honest in dataset else math.nan,
            error=_at(dataset[error].to_numpy(), row, column) if error in dataset else math.nan,
            time=float(time[row]) if time.size else math.nan,
            unit=str(dataset[f"{axis}_unit"].to_numpy()[column]),
            display_unit=str(dataset[f"{axis}_display_unit"].to_numpy()[column]),
            display_scale=float(dataset[f"{axis}_display_scale"].to_numpy()[column]),
            meaning=meaning_of(dataset, axis, column),
            **(_error_unit(dataset, row, column) if axis == "output" else {}),
        )


def _error_unit(dataset: xr.Dataset, row: int, column: int) -> dict[str, Any]:
    if "output_error_unit" not in dataset:
        return {}
    unit = str(dataset["output_error_unit"].to_numpy()[column])
    return {"error_unit": unit, "error_scale": _at(dataset["output_error_scale"].to_numpy(), row, column)}


def _at(values: FloatArray, row: int, column: int) -> float:
    return float(values[row, column]) if values.shape[0] else math.nan


def _measurement_summary(dataset: xr.Dataset, name: str) -> MeasurementSummary:
    codes = dataset[f"{name}_disposition"].to_numpy()
    fused = codes == DISPOSITIONS.index("fused")
    nis = dataset[f"{name}_nis"].to_numpy()
    counted = fused & np.isfinite(nis)
    freedom = nis_freedom(dataset, name)
    return MeasurementSummary(
        name=name,
        unit=str(measurement_attribute(dataset, name, "unit") or ""),
        components=int(dataset.sizes.get(f"{name}_row", freedom.max(initial=0))),
        counts={word: int(np.count_nonzero(codes == code)) for code, word in enumerate(DISPOSITIONS)},
        nis_mean=float(nis[counted].mean()) if counted.any() else math.nan,
        freedom=float(freedom[counted].mean()) if counted.any() else math.nan,
    )


def _event_counts(events: Sequence[Event]) -> list[dict[str, Any]]:
    counts: dict[tuple[str, str], int] = {}
    for event in events:
        key = (event.source, event.kind)
        counts[key] = counts.get(key, 0) + event.count
    return [{"source": source, "kind": kind, "count": count} for (source, kind), count in counts.items()]


def _as_json(end: EndValue) -> dict[str, Any]:
    value, sigma, error = end.display()
    return {
        "label": end.label,
        **({"meaning": end.meaning} if end.meaning else {}),
        "time": end.time,
        "value": end.value,
        "sigma": end.sigma,
        "honest_sigma": end.honest,
        "error": end.error,
        "unit": end.unit,
        "display": {"value": value, "sigma": sigma, "error": error, "unit": end.display_unit},
    }
