"""Which quantities are consistent: the rule of `estimfw.analysis.consistency` over a whole Monte Carlo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.chi_square import mean_bounds
from estimfw.analysis.consistency import Judged, at_one_instant, level_of_each, over_time, share_outside

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Verdict", "instant_bounds", "judged"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one quantity.

    ``figure`` is ``NEES``, ``honest NEES`` or ``NIS``. ``whole`` is judged over time and runs, ``end`` at the last instant over
    the runs. ``outside``: share of the instants outside the bounds of one instant. ``checked`` is False of the raw NEES of a
    reduced filter, whose sigmas are known to leave something out: its honest NEES is checked instead.
    """

    quantity: str
    kind: str
    figure: str
    freedom: float
    whole: Judged
    end: Judged | None
    outside: float
    checked: bool

    @property
    def consistent(self) -> bool:
        return self.whole.inside and (self.end is None or self.end.inside)

    @property
    def text(self) -> str:
        if not self.whole.inside or self.end is None or self.end.inside:
            return self.whole.verdict
        return f"{self.end.verdict} at the end"

    def as_json(self) -> dict[str, Any]:
        one = {"mean": self.whole.mean, "low": self.whole.low, "high": self.whole.high}
        end = {} if self.end is None else {"mean": self.end.mean, "low": self.end.low, "high": self.end.high}
        return {
            "quantity": self.quantity,
            "kind": self.kind,
            "figure": self.figure,
            "degrees_of_freedom": self.freedom,
            "over_time": {**one, "effective_samples": self.whole.samples},
            "at_end": end or None,
            "instants_outside": self.outside,
            "checked": self.checked,
            "consistent": self.consistent,
            "verdict": self.text,
        }


def judged(dataset: xr.Dataset, confidence: float) -> tuple[Verdict, ...]:
    """Every quantity and measurement; all that are checked are consistent with this confidence if the filter is."""
    honest = "honest_nees" in dataset
    quantities = {p: _known(dataset, f"{p}run_nees", "quantity") for p in ("honest_", "") if f"{p}nees" in dataset}
    measurements = _known(dataset, "run_nis", "measurement")
    most = max(len(own) for own in quantities.values())
    level = level_of_each(confidence, 2 * most + len(measurements))
    made = [_nis(dataset, j, confidence, level) for j in measurements]
    for prefix, figure in (("honest_", "honest NEES"), ("", "NEES")):
        made += [
            _nees(dataset, i, prefix, figure, confidence, level, checked=bool(prefix) or not honest)
            for i in quantities.get(prefix, ())
        ]
    return tuple(made)


def instant_bounds(confidence: float, freedom: float, samples: FloatArray) -> FloatArray:
    """Bounds (T, 2) of the mean of so many (T,) independent chi-square numbers at an instant."""
    return freedom * mean_bounds(confidence, samples * freedom)


def _known(dataset: xr.Dataset, name: str, axis: str) -> list[int]:
    values = dataset[name].to_numpy()
    return [i for i in range(dataset.sizes[axis]) if np.all(np.isfinite(values[:, i]))]


def _nees(
    dataset: xr.Dataset, i: int, prefix: str, figure: str, confidence: float, level: float, *, checked: bool
) -> Verdict:
    freedom, runs = float(dataset["quantity_freedom"].to_numpy()[i]), dataset.sizes["run"]
    mean = dataset[f"{prefix}nees"].to_numpy()[:, i]
    bounds = instant_bounds(confidence, freedom, np.full(mean.size, float(runs)))
    end = dataset[f"{prefix}end_nees"].to_numpy()[:, i]
    return Verdict(
        quantity=str(dataset["quantity"].to_numpy()[i]),
        kind=str(dataset["quantity_kind"].to_numpy()[i]),
        figure=figure,
        freedom=freedom,
        whole=over_time(dataset[f"{prefix}run_nees"].to_numpy()[:, i], freedom, level),
        end=at_one_instant(end, freedom, level) if np.all(np.isfinite(end)) else None,
        outside=share_outside(mean, bounds[:, 0], bounds[:, 1]),
        checked=checked,
    )


def _nis(dataset: xr.Dataset, j: int, confidence: float, level: float) -> Verdict:
    freedom = float(dataset["measurement_freedom"].to_numpy()[j])
    mean, samples = dataset["nis"].to_numpy()[:, j], dataset["nis_samples"].to_numpy()[:, j]
    bounds = instant_bounds(confidence, freedom, samples)
    return Verdict(
        quantity=str(dataset["measurement"].to_numpy()[j]),
        kind="measurement",
        figure="NIS",
        freedom=freedom,
        whole=over_time(dataset["run_nis"].to_numpy()[:, j], freedom, level),
        end=None,
        outside=share_outside(mean, bounds[:, 0], bounds[:, 1]),
        checked=True,
    )
