"""Outputs over time as a file: for a spreadsheet, for another program, or for a filter that reads it as its log.

Of a nominal that was recorded this is the corrected trajectory.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CORRECTED", "OUTPUTS", "values_csv", "values_npz"]

FloatArray = NDArray[np.float64]
#: How the file is called, without its suffix: where it is a corrected trajectory, and else.
CORRECTED, OUTPUTS = "corrected", "outputs"
#: What is told of an output or a state besides its value: the word in a header, and the variables of the result.
BESIDES = (
    ("sigma", "output_sigma", "sigma"),
    ("honest sigma", "output_honest_sigma", "honest_sigma"),
    ("smoothed", "smoothed_output", "smoothed"),
    ("smoothed sigma", "smoothed_output_sigma", "smoothed_sigma"),
    ("recorded", "output_recorded", ""),
)


def values_csv(dataset: xr.Dataset) -> str:
    """Outputs over time with their sigmas, in display units; the states of a result without outputs.

    One line an epoch, a header with the units.
    """
    import pandas as pd

    axis = _axis(dataset)
    columns = {"time [s]": dataset["time"].to_numpy()}
    for i, label in enumerate(dataset[axis].to_numpy()):
        unit, scale = str(dataset[f"{axis}_display_unit"].to_numpy()[i]), float(dataset[f"{axis}_display_scale"][i])
        for word, values in _told(dataset, axis, i):
            columns[f"{label}{word and ' '}{word} [{unit}]"] = values * scale
    return str(pd.DataFrame(columns).to_csv(index=False, float_format="%.12g"))


def values_npz(dataset: xr.Dataset) -> bytes:
    """The same to the last bit, in SI units: ``t`` (N,) s, and for each output its label and ``<label>_sigma`` ..., (N,)."""
    axis = _axis(dataset)
    arrays = {"t": np.asarray(dataset["time"].to_numpy(), dtype=float)}
    for i, label in enumerate(dataset[axis].to_numpy()):
        for word, values in _told(dataset, axis, i):
            arrays[f"{label}{word and '_'}{word.replace(' ', '_')}"] = values
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def _axis(dataset: xr.Dataset) -> str:
    return "output" if "output_value" in dataset else "state"


def _told(dataset: xr.Dataset, axis: str, column: int) -> Iterator[tuple[str, FloatArray]]:
    """The value under an empty word, and what is told besides, (N,) SI."""
    first = "output_value" if axis == "output" else "estimate"
    for word, of_output, of_state in (("", first, first), *BESIDES):
        name = of_output if axis == "output" else of_state
        if name in dataset:
            yield word, np.asarray(dataset[name].to_numpy()[:, column], dtype=float)
