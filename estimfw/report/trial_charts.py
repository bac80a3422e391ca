"""How the errors of several filters shrink, over many runs."""

from __future__ import annotations

import numpy as np

from estimfw.montecarlo.trial import Trial
from estimfw.report.palette import SERIES
from estimfw.report.panel import Chart, Curve, Panel, slug
from estimfw.report.timescale import TimeScale

__all__ = ["trial_charts"]

PANELS = 6
NOTE = "Root mean square over {} runs."
EACH = "The absolute error of each run."


def trial_charts(trial: Trial) -> tuple[Chart, ...]:
    """Rms of all outputs over time; and for each output every run of every filter."""
    scale = TimeScale.of(trial.time)
    time = scale.of_seconds(trial.time)
    charts = []
    for part, start in enumerate(range(0, len(trial.quantities), PANELS)):
        panels = tuple(_rms(trial, q, time) for q in range(len(trial.quantities))[start : start + PANELS])
        tail = f"_{part + 1}" if part else ""
        charts.append(Chart(f"rms{tail}", "rms", "Errors over time", scale.unit, panels, NOTE.format(trial.runs)))
    for q, label in enumerate(trial.quantities):
        panels = tuple(_each(trial, f, q, time) for f in range(len(trial.names)))
        for part, start in enumerate(range(0, len(panels), PANELS)):
            tail = f"_{part + 1}" if part else ""
            key = f"runs_{slug(label)}{tail}"
            charts.append(Chart(key, "runs", f"{label}: every run", scale.unit, panels[start : start + PANELS], EACH))
    return tuple(charts)


def _rms(trial: Trial, q: int, time: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Panel:
    curves = []
    for f, name in enumerate(trial.names):
        with np.errstate(invalid="ignore"):
            rms = np.sqrt(np.mean(trial.error[f, :, :, q] ** 2, axis=0)) * trial.scales[q]
        curves.append(
            Curve(name, time, np.where(rms > 0.0, rms, np.nan), SERIES[f % len(SERIES)], "dashed" if f % 2 else "line")
        )
    return Panel(trial.quantities[q], trial.units[q], tuple(curves), logarithmic=True)


def _each(trial: Trial, f: int, q: int, time: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Panel:
    error = np.abs(trial.error[f, :, :, q]) * trial.scales[q]
    curves = tuple(
        Curve(f"run {r}", time, np.where(one > 0.0, one, np.nan), SERIES[r % len(SERIES)], listed=False)
        for r, one in enumerate(error)
    )
    return Panel(trial.names[f], trial.units[q], curves, logarithmic=True)
