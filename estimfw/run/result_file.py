"""A result on disk: one NetCDF-4 file that `xarray.open_dataset` and ``ncdump`` read without us, and a short JSON."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from estimfw.errors import DataError, Location
from estimfw.run.files import refuse_existing, write_bytes, write_text
from estimfw.run.result_names import described
from estimfw.run.summary import json_attribute, summarise

__all__ = ["FORMAT", "check_result", "read_result", "write_result", "write_summary_json"]

FORMAT = 1
"""Version of the file's layout; a newer one is refused."""

MARK = "estimfw_result"
PAIRS = (("estimate", "state"), ("output_value", "output"))
LISTS = ("policies", "equivalence")


def write_result(dataset: xr.Dataset, path: Path, *, force: bool = False) -> Path:
    """Write a result as NetCDF-4 (HDF5), compressed, whole or not at all.

    Parameters
    ----------
    dataset : xarray.Dataset
        A result; long names and units are added where they are missing.
    path : Path
        Such as ``result.nc``.
    force : bool
        Replace a file that is there.

    Raises
    ------
    DataError
        No result, the file exists, or it cannot be written.
    """
    refuse_existing(path, force=force)
    check_result(dataset)
    complete = described(dataset)
    complete.attrs = {"Conventions": "CF-1.11", **_known(dataset.attrs), MARK: FORMAT}

    # Composed in memory: HDF5 that meets a full disk while it closes a file takes the interpreter down with it.
    content = complete.to_netcdf(engine="h5netcdf", encoding=_encoding(complete))
    return write_bytes(path, content, force=force)


def read_result(path: Path) -> xr.Dataset:
    """Read a result into memory; the file is closed again.

    Raises
    ------
    DataError
        No such file, no NetCDF-4 file or a damaged one, no result of ours, or one of a newer version.
    """
    place = Location(str(path))
    if not path.is_file():
        raise DataError("no such file", location=place, hint="expected the result of a run, such as result.nc")
    try:
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            dataset = opened.load()
    except (OSError, ValueError, KeyError, RuntimeError, TypeError) as fault:
        hint = "expected the result of a run (NetCDF-4); the file is of another kind, or it is damaged"
        raise DataError(f"cannot be read as a result: {fault}", location=place, hint=hint) from fault
    _check_mark(dataset, place)
    check_result(dataset, location=place)
    return dataset


def check_result(dataset: xr.Dataset, *, location: Location | None = None) -> None:
    """Raise `DataError` unless the dataset has what every result has.

    That is: ``time``, states or outputs over it with a display unit and scale each, and readable JSON attributes.
    """
    missing = [] if "time" in dataset.coords else ["time"]
    if not any(value in dataset for value, _ in PAIRS):
        missing.append("estimate or output_value")
    for value, axis in PAIRS:
        if value in dataset:
            needed = (axis, f"{axis}_unit", f"{axis}_display_unit", f"{axis}_display_scale")
            missing += [name for name in needed if name not in dataset]
            if dataset[value].dims != ("time", axis):
                missing.append(f"{value}(time, {axis})")
    if missing:
        raise DataError(f"not a result of ours: {', '.join(missing)} missing", location=location)
    try:
        sound = isinstance(json_attribute(dataset, "provenance", {}), dict)
        sound = sound and all(_is_list_of_objects(json_attribute(dataset, name, [])) for name in LISTS)
    except ValueError as fault:
        raise DataError(f"not a result of ours: an attribute is no JSON: {fault}", location=location) from fault
    if not sound:
        raise DataError(
            "not a result of ours: provenance, policies or equivalence have the wrong shape", location=location
        )


def write_summary_json(dataset: xr.Dataset, path: Path, *, force: bool = False) -> Path:
    """Write what a script wants to know of a result: end values, counts, provenance (`summarise`). NaN becomes null.

    Raises
    ------
    DataError
        No result, the file exists, or it cannot be written.
    """
    refuse_existing(path, force=force)
    check_result(dataset)
    return write_text(
        path, json.dumps(summarise(dataset), indent=2, ensure_ascii=False, allow_nan=False) + "\n", force=force
    )


def _known(attributes: Mapping[Hashable, Any]) -> dict[Hashable, Any]:
    """NetCDF has no None."""
    return {name: value for name, value in attributes.items() if value is not None}


def _check_mark(dataset: xr.Dataset, place: Location) -> None:
    mark = dataset.attrs.get(MARK)
    if mark is None:
        raise DataError(f"not a result of ours: it has no attribute {MARK!r}", location=place)
    try:
        version = int(mark)
    except (TypeError, ValueError):
        raise DataError(f"not a result of ours: attribute {MARK!r} is {mark!r}", location=place) from None
    if version > FORMAT:
        text = f"the result has layout {version}, this program knows up to {FORMAT}"
        raise DataError(text, location=place, hint="read it with a newer estimfw")


def _is_list_of_objects(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(item, dict) for item in value)


def _encoding(dataset: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    packed = {"zlib": True, "complevel": 2, "shuffle": True}
    numbers = [name for name in dataset.variables if dataset[name].dtype.kind in "iuf" and dataset[name].ndim]
    return {name: {**packed, **({"_FillValue": None} if name in dataset.coords else {})} for name in numbers}
