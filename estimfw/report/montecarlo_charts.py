"""The charts of a Monte Carlo: NEES and NIS over time with their bounds, and errors against sigmas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.montecarlo.verdicts import instant_bounds
from estimfw.report.numbers import plain
from estimfw.report.palette import BAND_MOST, INK, SERIES
from estimfw.report.panel import Band, Chart, Curve, Panel, slug
from estimfw.report.timescale import TimeScale

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["campaign_charts"]

GROUPS = ("states", "block")


def campaign_charts(dataset: xr.Dataset) -> tuple[Chart, ...]:
    """NIS, NEES of groups, and for outputs and states the errors over the runs against the sigmas."""
    scale = TimeScale.of(dataset["time"].to_numpy())
    charts = [_nis(dataset, scale), _nees(dataset, scale, "", "NEES")]
    if "honest_nees" in dataset:
        charts.append(_nees(dataset, scale, "honest_", "NEES with the honest covariance"))
    axes = [(axis, prefix) for axis, prefix in (("output", "output_"), ("state", "")) if axis in dataset.sizes]
    charts += [chart for axis, prefix in axes for chart in _errors(dataset, scale, axis, prefix)]
    return tuple(chart for chart in charts if chart.panels)


def _nis(dataset: xr.Dataset, scale: TimeScale) -> Chart:
    panels = []
    for j, name in enumerate(dataset["measurement"].to_numpy()):
        freedom, samples = float(dataset["measurement_freedom"][j]), dataset["nis_samples"].to_numpy()[:, j]
        panels.append(
            _against_bounds(dataset, scale, str(name), "NIS", dataset["nis"].to_numpy()[:, j], freedom, samples)
        )
    return Chart("nis", "nis", "NIS of the measurements", scale.unit, _seen(panels))


def _nees(dataset: xr.Dataset, scale: TimeScale, prefix: str, title: str) -> Chart:
    panels = []
    for i, name in enumerate(dataset["quantity"].to_numpy()):
        if str(dataset["quantity_kind"].to_numpy()[i]) in GROUPS or dataset.sizes["quantity"] == 1:
            freedom, mean = float(dataset["quantity_freedom"][i]), dataset[f"{prefix}nees"].to_numpy()[:, i]
            samples = np.full(mean.size, float(dataset.sizes["run"]))
            panels.append(_against_bounds(dataset, scale, str(name), "NEES", mean, freedom, samples))
    return Chart(f"{prefix}nees", "nees", title, scale.unit, _seen(panels))


def _against_bounds(
    dataset: xr.Dataset, scale: TimeScale, name: str, figure: str, mean: FloatArray, freedom: float, samples: FloatArray
) -> Panel:
    """A mean over the runs and the bounds of each instant; logarithmic where it is far away."""
    time = scale.of_seconds(dataset["time"].to_numpy())
    confidence = float(dataset.attrs["confidence"])
    bounds = instant_bounds(confidence, freedom, samples)
    known = mean[np.isfinite(mean) & (mean > 0.0)]
    far = bool(known.size) and bool(known.max() > 10.0 * freedom or known.min() < 0.1 * freedom)
    curves = (
        Curve("mean over the runs", time, np.where(mean > 0.0, mean, np.nan) if far else mean, SERIES[0]),
        Curve("expected", time, np.full(time.size, freedom), INK, "dashed"),
    )
    band = Band(f"{plain(100 * confidence)} % bounds", time, bounds[:, 0], bounds[:, 1], BAND_MOST)
    return Panel(f"{name} ({plain(freedom)} degrees of freedom)", figure, curves, (band,), logarithmic=far)


def _errors(dataset: xr.Dataset, scale: TimeScale, axis: str, prefix: str) -> Iterator[Chart]:
    """For each group of outputs or states (a block) a chart of rms and spread against the sigmas."""
    time = scale.of_seconds(dataset["time"].to_numpy())
    groups: dict[str, list[Panel]] = {}
    for i, label in enumerate(dataset[axis].to_numpy()):
        factor, unit = float(dataset[f"{axis}_display_scale"][i]), str(dataset[f"{axis}_display_unit"].to_numpy()[i])
        names = (("rms error", "rms", "line"), ("|bias|", "bias", "dots"), ("own σ", "sigma", "dashed"))
        curves = [
            Curve(shown, time, _positive(dataset[f"{prefix}{name}"].to_numpy()[:, i] * factor), SERIES[k], style)  # type: ignore[arg-type]
            for k, (shown, name, style) in enumerate(names)
        ]
        if f"{prefix}honest_sigma" in dataset:
            honest = _positive(dataset[f"{prefix}honest_sigma"].to_numpy()[:, i] * factor)
            curves.append(Curve("honest σ", time, honest, SERIES[3], "dashed"))
        group = str(label).partition("[")[0].partition(".")[0]
        panel = Panel(str(label), unit, tuple(curves), logarithmic=True, view=_view(curves))
        groups.setdefault(group, []).append(panel)
    for group, panels in groups.items():
        if _seen(panels):
            yield Chart(
                f"errors_{slug(group)}", f"{axis}_errors", f"{group}: errors of the runs", scale.unit, _seen(panels)
            )


def _view(curves: Sequence[Curve]) -> tuple[float, float] | None:
    """All of the sigmas and of the rms; of a bias that is far smaller only that it is."""
    shown = np.concatenate([curve.values for curve in curves if curve.style != "dots"])
    shown = shown[np.isfinite(shown)]
    return (0.2 * float(shown.min()), 1.5 * float(shown.max())) if shown.size else None


def _positive(values: FloatArray) -> FloatArray:
    size = np.abs(values)
    return np.where(size > 0.0, size, np.nan)


def _seen(panels: list[Panel]) -> tuple[Panel, ...]:
    return tuple(panel for panel in panels if np.isfinite(panel.curves[0].values).any())
