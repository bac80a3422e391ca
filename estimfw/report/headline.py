"""What one wants to know first: the attitude at the end, and how far to trust it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from estimfw.report.numbers import plus_minus, significant
from estimfw.run.summary import EndValue, end_outputs, json_attribute

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Headline", "headlines", "start_line"]

ARCMIN = 60 * 180 / math.pi


@dataclass(frozen=True, slots=True)
class Headline:
    """One output at the end as text: ``yaw``, ``179.982``, ``0.061``, ``deg``.

    ``sigma`` is the honest one where the model was reduced, ``fine`` the same in the unit of its errors (m of a latitude) or in
    arcmin for an angle, else empty; ``error`` says how far it is from the truth, where that is known; ``trusted`` is False where
    the truth lies outside of 3 sigma.
    """

    name: str
    value: str
    sigma: str
    unit: str
    fine: str
    error: str
    trusted: bool


def headlines(dataset: xr.Dataset) -> tuple[Headline, ...]:
    """The attitude if the result has one, else every output; none for a result without outputs."""
    outputs = end_outputs(dataset)
    attitude = tuple(output for output in outputs if output.label.startswith("attitude."))
    return tuple(_headline(output) for output in attitude or outputs)


def start_line(dataset: xr.Dataset) -> str:
    """Where the filter began, where an alignment found it: its name, and the attitude of the first step; else empty."""
    provenance = json_attribute(dataset, "provenance", {})
    if not provenance.get("start_found"):
        return ""
    first = (one for one in headlines(dataset.isel(time=slice(0, 1))) if one.name != "heading")
    angles = ", ".join(f"{one.name} {one.value}{one.unit} ± {one.sigma}{one.unit}" for one in first)
    return f"start: {provenance.get('start')}" + (f": {angles}" if angles else "")


def _headline(end: EndValue) -> Headline:
    value, _, error = end.display()
    sigma = end.trusted * end.display_scale
    shown, spread = plus_minus(value, sigma)
    fine_unit, fine_scale = _fine(end)
    unit = {"deg": "°"}.get(end.display_unit, f" {end.display_unit}")
    known = math.isfinite(end.error)
    error_text = f"{plus_minus(error, sigma)[0]}{unit}" if known else ""
    if known and fine_unit:
        error_text += f" ({significant(end.error * fine_scale, 2)}{fine_unit})"
    return Headline(
        name=end.label.removeprefix("attitude."),
        value=shown,
        sigma=spread,
        unit=unit,
        fine=f"{significant(end.trusted * fine_scale, 2)}{fine_unit}"
        if fine_unit and math.isfinite(end.trusted)
        else "",
        error=error_text,
        trusted=not abs(error) > 3 * sigma,
    )


def _fine(end: EndValue) -> tuple[str, float]:
    """The unit in which small errors are told too, and the factor from SI to it; no unit where there is none."""
    if end.error_unit:
        return f" {end.error_unit}", end.error_scale
    return ("′", ARCMIN) if end.unit == "rad" else ("", 1.0)
