"""One state or one output of a result over time, in its display unit and without jumps of whole turns."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Literal

import numpy as np

from estimfw.data.record import FloatArray
from estimfw.report.angles import beside, unwrapped, wrapped

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Axis", "Series", "grouped", "series_of"]

Axis = Literal["output", "state"]

# fmt: off
VARIABLES: dict[Axis, tuple[str, ...]] = {
    "output": (
        "output_value", "output_sigma", "output_truth", "output_error", "output_honest_sigma",
        "smoothed_output", "smoothed_output_sigma", "smoothed_output_error", "output_recorded",
    ),
    "state": (
        "estimate", "sigma", "truth", "error", "honest_sigma", "smoothed", "smoothed_sigma", "smoothed_error", "",
    ),
}
# fmt: on


@dataclass(frozen=True, slots=True)
class Series:
    """A column of the result; what is unknown is NaN throughout. Arrays are (N,), made when they are asked for."""

    dataset: xr.Dataset
    axis: Axis
    column: int

    @property
    def label(self) -> str:
        """Such as ``velocity_error[E]``."""
        return str(self.dataset[self.axis].to_numpy()[self.column])

    @property
    def group(self) -> str:
        """The block or family: ``velocity_error``, ``attitude``."""
        return re.split(r"[.\[]", self.label)[0]

    @property
    def member(self) -> str:
        """Its name within the group: ``E``, ``yaw``; the label where it is alone."""
        return self.label.removeprefix(self.group).strip(".[]") or self.label

    @property
    def unit(self) -> str:
        """The display unit."""
        return str(self.dataset[f"{self.axis}_display_unit"].to_numpy()[self.column])

    @property
    def value(self) -> FloatArray:
        """Estimated values."""
        return self._value() * self._scale

    @property
    def sigma(self) -> FloatArray:
        """Standard deviations."""
        return self._raw(1) * self._scale

    @property
    def honest(self) -> FloatArray:
        """Standard deviations on the truth model, of a reduced model."""
        return self._raw(4) * self._scale

    @property
    def truth(self) -> FloatArray:
        """True values, beside the estimated ones."""
        raw = self._raw(2)
        return (beside(raw, self._value()) if self._is_angle else raw) * self._scale

    @property
    def error(self) -> FloatArray:
        """Estimate minus truth."""
        raw = self._raw(3)
        return (wrapped(raw) if self._is_angle else raw) * self._scale

    @property
    def smoothed(self) -> FloatArray:
        """Smoothed values, beside the estimated ones."""
        raw = self._raw(5)
        return (beside(raw, self._value()) if self._is_angle else raw) * self._scale

    @property
    def smoothed_sigma(self) -> FloatArray:
        """Standard deviations of the smoothed values."""
        return self._raw(6) * self._scale

    @property
    def smoothed_error(self) -> FloatArray:
        """Smoothed value minus truth."""
        raw = self._raw(7)
        return (wrapped(raw) if self._is_angle else raw) * self._scale

    @property
    def recorded(self) -> FloatArray:
        """What a device recorded before any correction, beside the estimated values."""
        raw = self._raw(8)
        return (beside(raw, self._value()) if self._is_angle else raw) * self._scale

    @property
    def error_unit(self) -> str:
        """The unit in which errors are told: m of a latitude, else the display unit."""
        return self._error_unit or self.unit

    @property
    def in_error_unit(self) -> FloatArray:
        """The factor (N,) from the display unit to ``error_unit``."""
        if not self._error_unit:
            return np.ones(self.dataset.sizes["time"])
        return np.asarray(self.dataset["output_error_scale"].to_numpy()[:, self.column] / self._scale)

    @property
    def _error_unit(self) -> str:
        if self.axis == "state" or "output_error_unit" not in self.dataset:
            return ""
        return str(self.dataset["output_error_unit"].to_numpy()[self.column])

    def _value(self) -> FloatArray:
        raw = self._raw(0)
        return unwrapped(raw) if self._is_angle else raw

    @property
    def is_unwrapped(self) -> bool:
        """Somewhere the curve is drawn a whole turn away from the value in the result."""
        return self._is_angle and bool(np.nanmax(np.abs(self._value() - self._raw(0)), initial=0) > 1e-6)

    @property
    def _scale(self) -> float:
        return float(self.dataset[f"{self.axis}_display_scale"].to_numpy()[self.column])

    @property
    def _is_angle(self) -> bool:
        """An output in rad is an orientation, of which whole turns mean nothing; a state is a small error."""
        return self.axis == "output" and str(self.dataset["output_unit"].to_numpy()[self.column]) == "rad"

    def _raw(self, which: int) -> FloatArray:
        name = VARIABLES[self.axis][which]
        if name not in self.dataset:
            return np.full(self.dataset.sizes["time"], np.nan)
        return np.asarray(self.dataset[name].to_numpy()[:, self.column], dtype=np.float64)


def series_of(dataset: xr.Dataset, axis: Axis) -> tuple[Series, ...]:
    """All states or all outputs of a result, none where it has none."""
    if VARIABLES[axis][0] not in dataset:
        return ()
    return tuple(Series(dataset, axis, column) for column in range(dataset.sizes[axis]))


def grouped(series: tuple[Series, ...], most: int) -> list[tuple[Series, ...]]:
    """Neighbours of one block and one unit together, at most ``most`` in a group; a larger block in parts of one size."""
    families = (tuple(family) for _, family in groupby(series, key=lambda one: (one.group, one.unit)))
    return [part for family in families for part in _parts(family, most)]


def _parts(family: tuple[Series, ...], most: int) -> list[tuple[Series, ...]]:
    size = -(-len(family) // -(-len(family) // most))
    return [family[start : start + size] for start in range(0, len(family), size)]
