"""What the variables of a result mean: one sheet of long names and units, written into every file.

A result has the dimensions ``time`` and ``state``, maybe ``output``, ``covariance_time``, ``event`` and
``member`` (of a bank), and for each
measurement ``NAME`` its own ``NAME_time`` and ``NAME_row``. Numbers are in SI units; ``*_display_scale`` takes them to
the display unit beside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DISPOSITIONS", "described", "measurement_attribute", "measurement_names"]

DISPOSITIONS = ("fused", "gated", "late", "missing", "invalid")
"""What can become of a measurement; its code in the file is its place here."""

PER_STATE = "SI, see state_unit"
PER_OUTPUT = "SI, see output_unit"

SHEET: dict[str, tuple[str, str | None]] = {
    "time": ("time, end of each step", "s"),
    "state": ("label of each state: block[axis]", None),
    "state_column": ("label of each state, second axis of the covariance", None),
    "state_unit": ("SI unit of each state", None),
    "state_display_unit": ("unit in which people read each state", None),
    "state_display_scale": ("factor from the SI unit to the display unit of each state", "1"),
    "state_meaning": ("what each state stands for: a combination, in SI units, or what its label says", None),
    "estimate": ("estimate of each state", PER_STATE),
    "sigma": ("standard deviation of each estimate, from the filter's covariance", PER_STATE),
    "prior_sigma": ("standard deviation of each state that a start of the filter assumes", PER_STATE),
    "honest_sigma": ("standard deviation of each estimate on the truth model", PER_STATE),
    "covariance_time": ("time of each stored covariance", "s"),
    "covariance": ("covariance of the estimates", "product of the SI units of its states, see state_unit"),
    "honest_covariance": (
        "covariance of the estimates on the truth model",
        "product of the SI units of its states, see state_unit",
    ),
    "unmeasured_mean": ("each state without any measurement; NaN where others drive it", PER_STATE),
    "unmeasured_sigma": ("sigma of each state without any measurement; NaN where others drive it", PER_STATE),
    "truth": ("true value of each state, where the source knows it", PER_STATE),
    "error": ("estimate minus truth of each state", PER_STATE),
    "output": ("label of each physical output", None),
    "output_unit": ("SI unit of each output", None),
    "output_display_unit": ("unit in which people read each output", None),
    "output_display_scale": ("factor from the SI unit to the display unit of each output", "1"),
    "output_meaning": (
        "each output, and the combinations of states that it is corrected by, where there are such",
        None,
    ),
    "output_value": ("value of each output", PER_OUTPUT),
    "output_sigma": ("standard deviation of each output", PER_OUTPUT),
    "output_honest_sigma": ("standard deviation of each output on the truth model", PER_OUTPUT),
    "output_truth": ("true value of each output, where the source knows it", PER_OUTPUT),
    "output_error": ("value minus truth of each output", PER_OUTPUT),
    "smoothed": (
        "estimate of each state at this time that later data count for too, see the attribute smoother",
        PER_STATE,
    ),
    "smoothed_sigma": ("standard deviation of each smoothed estimate, from the filter's own model", PER_STATE),
    "smoothed_error": ("smoothed estimate minus truth of each state", PER_STATE),
    "smoothed_covariance": (
        "covariance of the smoothed estimates",
        "product of the SI units of its states, see state_unit",
    ),
    "smoothed_output": ("value of each output at this time that later data count for too", PER_OUTPUT),
    "smoothed_output_sigma": ("standard deviation of each smoothed output, from the filter's own model", PER_OUTPUT),
    "smoothed_output_error": ("smoothed value minus truth of each output", PER_OUTPUT),
    "output_recorded": ("value of each output as it was recorded, before any correction", PER_OUTPUT),
    "output_error_scale": ("factor from the SI unit of each output to output_error_unit", "1"),
    "output_error_unit": ("unit in which errors of each output are told; empty: the display unit", None),
    "output_period": ("what a whole turn is of each output; 0 where it does not wrap", PER_OUTPUT),
    "member": ("start of each member of the bank", None),
    "bank_score": (
        "sum of NIS and ln det S of each member, see estimfw.estimators.bank; infinite where it was lost",
        "1",
    ),
    "bank_weight": ("weight of each member: its posterior probability, if one of the starts is right", "1"),
    "bank_member": ("place of the reported member", "1"),
    "event": ("number of the event", "1"),
    "event_time": ("time of the event, NaN where it is tied to no instant", "s"),
    "event_source": ("stream, sensor or component of the event", None),
    "event_kind": ("kind of the event", None),
    "event_text": ("what happened", None),
    "event_count": ("how often it happened", "1"),
}

MEASUREMENT_SHEET: dict[str, tuple[str, str | None]] = {
    "time": ("time of each measurement", "s"),
    "row": ("component of the measurement", None),
    "innovation": ("measured minus predicted", "SI"),
    "innovation_sigma": ("standard deviation that the filter expects of the innovation", "SI"),
    "nis": ("normalised innovation squared", "1"),
    "disposition": ("what became of the measurement", "1"),
    "used": ("number of fused components", "1"),
}


def measurement_names(dataset: xr.Dataset) -> tuple[str, ...]:
    """The measurements of a result, in the order of the file."""
    ending = "_disposition"
    return tuple(str(name).removesuffix(ending) for name in dataset.data_vars if str(name).endswith(ending))


def measurement_attribute(dataset: xr.Dataset, measurement: str, attribute: str) -> object | None:
    """An attribute such as ``unit`` or ``threshold`` from whichever variable of the measurement carries it."""
    parts = (f"{measurement}_{part}" for part in MEASUREMENT_SHEET)
    found: list[object] = [dataset[name].attrs[attribute] for name in parts if _carries(dataset, name, attribute)]
    return found[0] if found else None


def _carries(dataset: xr.Dataset, name: str, attribute: str) -> bool:
    return name in dataset and attribute in dataset[name].attrs


def described(dataset: xr.Dataset) -> xr.Dataset:
    """The same result with ``long_name`` on every variable and ``units`` on every number; what is there stays.

    The data are shared with the argument, the attributes are not.
    """
    result = dataset.copy()
    sheet = SHEET | _measurement_sheet(result)
    for name in result.variables:
        long_name, unit = sheet.get(str(name), (str(name).replace("_", " "), None))
        attributes = result[name].attrs
        attributes.setdefault("long_name", long_name)
        if unit is not None and result[name].dtype.kind in "iuf":
            attributes.setdefault("units", unit)
    for measurement in measurement_names(result):
        codes = np.arange(len(DISPOSITIONS), dtype=np.int8)
        result[f"{measurement}_disposition"].attrs |= {"flag_values": codes, "flag_meanings": " ".join(DISPOSITIONS)}
    return result


def _measurement_sheet(dataset: xr.Dataset) -> dict[str, tuple[str, str | None]]:
    sheet = {}
    for measurement in measurement_names(dataset):
        own_unit = measurement_attribute(dataset, measurement, "unit")
        for part, (meaning, unit) in MEASUREMENT_SHEET.items():
            in_own_unit = unit == "SI" and own_unit is not None
            sheet[f"{measurement}_{part}"] = (f"{measurement}: {meaning}", str(own_unit) if in_own_unit else unit)
    return sheet
