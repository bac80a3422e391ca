"""Whether a filter believes itself: innovations inside their bounds, NIS as chi-square says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from estimfw.analysis.chi_square import quantile
from estimfw.data.record import FloatArray
from estimfw.report.judgement import nis_verdict
from estimfw.report.palette import BAND, BAND_MOST, BAND_NEARLY_ALL, ROLES
from estimfw.report.panel import Band, Chart, Curve, Panel, focused, slug, thinned
from estimfw.report.timescale import TimeScale
from estimfw.run.result_names import DISPOSITIONS, measurement_attribute
from estimfw.run.summary import measurement_summaries, nis_freedom
from estimfw.units.display import DisplayUnit, display_unit

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["innovation_chart", "mean_window", "nis_chart"]

FUSED = DISPOSITIONS.index("fused")


def innovation_chart(dataset: xr.Dataset, name: str, scale: TimeScale, limit: int) -> Chart:
    """A panel for each component, with the +-3 sigma that the filter expects."""
    time = scale.of_seconds(dataset[f"{name}_time"].to_numpy())
    shown = _shown(dataset, name)
    codes = dataset[f"{name}_disposition"].to_numpy()
    panels: list[Panel] = []
    if f"{name}_innovation" in dataset:
        for column, row in enumerate(dataset[f"{name}_innovation"].to_numpy().T):
            label, values = _row_label(dataset, name, column), shown.scale * np.asarray(row, dtype=np.float64)
            band = _innovation_band(dataset, name, column, time, shown.scale, limit)
            view = focused((time, values), *(((band.time, band.lower), (band.time, band.upper)) if band else ()))
            curves = _by_disposition(time, values, codes, limit)
            panels.append(Panel(label, shown.text, curves, (band,) if band else (), view=view))
    return Chart(f"innovations_{slug(name)}", "innovations", f"{name}: innovations", scale.unit, tuple(panels))


def _shown(dataset: xr.Dataset, name: str) -> DisplayUnit:
    """In which unit people read the innovations of a measurement: an angle in degrees."""
    unit = measurement_attribute(dataset, name, "unit")
    return display_unit(str(unit), name) if unit else DisplayUnit("SI unit", 1.0)


def _row_label(dataset: xr.Dataset, name: str, column: int) -> str:
    """Such as ``zero_velocity[E]``; the name alone where the measurement has one unnamed row."""
    row = str(dataset[f"{name}_row"].to_numpy()[column]) if f"{name}_row" in dataset else str(column + 1)
    return name if row == name else f"{name}[{row}]"


def nis_chart(dataset: xr.Dataset, name: str, scale: TimeScale, limit: int) -> Chart:
    """NIS of each epoch against the upper bounds of chi-square, and its windowed mean against both bounds."""
    nis = np.asarray(dataset[f"{name}_nis"].to_numpy(), dtype=np.float64)
    nis = np.where(nis > 0, nis, np.nan)
    time = scale.of_seconds(dataset[f"{name}_time"].to_numpy())
    codes = dataset[f"{name}_disposition"].to_numpy()
    freedom = nis_freedom(dataset, name)
    counted = (codes == FUSED) & np.isfinite(nis) & (freedom > 0)
    window = mean_window(int(counted.sum()))
    panels = [_nis_panel(nis, time, codes, freedom, limit)] if np.isfinite(nis).any() else []
    if counted.any():
        panels.append(_mean_panel(nis[counted], time[counted], freedom[counted], window, limit))
    verdict = next(nis_verdict(one).sentence for one in measurement_summaries(dataset) if one.name == name)
    note = f"{verdict} Below, the mean of {window} epochs: a consistent filter has it in the 95 % band 19 times in 20."
    return Chart(f"nis_{slug(name)}", "nis", f"{name}: normalised innovation squared", scale.unit, tuple(panels), note)


def mean_window(epochs: int) -> int:
    """How many epochs a windowed mean takes: a twentieth of them, 10 to 500 where there are so many."""
    return max(1, min(epochs, max(10, min(500, epochs // 20))))


def _nis_panel(
    nis: FloatArray, time: FloatArray, codes: NDArray[np.int8], freedom: NDArray[np.int64], limit: int
) -> Panel:
    known = freedom[freedom > 0]
    usual = int(np.median(known)) if known.size else 1
    degrees = np.where(freedom > 0, freedom, usual)
    outer, inner = quantile(0.99, degrees), quantile(0.95, degrees)
    bound_time, (inner, outer) = thinned(time, (inner, outer), limit)
    curves = (
        *_by_disposition(time, nis, codes, limit),
        Curve("95 % bound", bound_time, inner, ROLES["bound"]),
        Curve("99 % bound", bound_time, outer, ROLES["bound_outer"], "dashed"),
    )
    title = f"each epoch ({usual} degree{'s' if usual > 1 else ''} of freedom)"
    return Panel(title, "NIS", curves, logarithmic=True, view=_nis_view(nis, inner, outer))


def _nis_view(nis: FloatArray, inner: FloatArray, outer: FloatArray) -> tuple[float, float] | None:
    """A logarithmic range that is not stretched by the few epochs with an innovation near zero."""
    known = nis[np.isfinite(nis)]
    if not known.size:
        return None
    lowest = min(float(np.quantile(known, 0.02)), 0.1 * float(inner.min()))
    return 0.5 * lowest, 2 * max(float(known.max()), float(outer.max()))


def _mean_panel(nis: FloatArray, time: FloatArray, freedom: NDArray[np.int64], window: int, limit: int) -> Panel:
    means, expected = _trailing_mean(nis, window), _trailing_mean(freedom.astype(np.float64), window)
    time, (means, expected) = thinned(time[window - 1 :], (means, expected), limit)
    degrees = np.round(expected * window).astype(np.int64)
    bounds = [quantile(level, degrees) / window for level in (0.005, 0.025, 0.975, 0.995)]
    bands = (
        Band("99 % of means", time, bounds[0], bounds[3], BAND_NEARLY_ALL),
        Band("95 % of means", time, bounds[1], bounds[2], BAND_MOST),
    )
    curves = (
        Curve(f"mean of {window}", time, means, ROLES["mean"]),
        Curve("expected", time, expected, ROLES["truth"], "dashed"),
    )
    return Panel(f"mean of the last {window}", "NIS", curves, bands, logarithmic=True)


def _trailing_mean(values: FloatArray, window: int) -> FloatArray:
    """Means of ``window`` neighbours, (N - window + 1,); not by differences of sums, in which one outlier stays for ever."""
    return np.asarray(sliding_window_view(values, window).mean(axis=1), dtype=np.float64)


def _by_disposition(time: FloatArray, values: FloatArray, codes: NDArray[np.int8], limit: int) -> tuple[Curve, ...]:
    """Dots for what was fused, crosses in their own colours for what was not."""
    curves = []
    for code, word in enumerate(DISPOSITIONS):
        chosen = (codes == code) & np.isfinite(values)
        if chosen.any():
            thin_time, (thin,) = thinned(time[chosen], (values[chosen],), limit)
            curves.append(Curve(word, thin_time, thin, ROLES[word], "dots" if code == FUSED else "crosses"))
    return tuple(curves)


def _innovation_band(
    dataset: xr.Dataset, name: str, column: int, time: FloatArray, scale: float, limit: int
) -> Band | None:
    if f"{name}_innovation_sigma" not in dataset:
        return None
    spread = 3 * scale * np.asarray(dataset[f"{name}_innovation_sigma"].to_numpy()[:, column], dtype=np.float64)
    time, (lower, upper) = thinned(time, (-spread, spread), limit)
    return Band("±3σ", time, lower, upper, BAND) if np.isfinite(upper).any() else None
