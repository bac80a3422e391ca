"""The result of a Monte Carlo on disk: one NetCDF-4 file, the same bytes for the same Monte Carlo."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from estimfw.errors import DataError, Location
from estimfw.run.files import refuse_existing, write_bytes

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FORMAT", "read_campaign", "write_campaign"]

FORMAT = 1
MARK = "estimfw_montecarlo"


def write_campaign(dataset: xr.Dataset, path: Path, *, force: bool = False) -> Path:
    """Write it, whole or not at all.

    Raises
    ------
    DataError
        The file exists, or it cannot be written.
    """
    refuse_existing(path, force=force)
    marked = dataset.copy()
    marked.attrs = {"Conventions": "CF-1.11", **dataset.attrs, MARK: FORMAT}
    packed = {"zlib": True, "complevel": 2, "shuffle": True}
    numbers = [name for name in marked.variables if marked[name].dtype.kind in "iuf" and marked[name].ndim]
    encoding = {n: {**packed, **({"_FillValue": None} if n in marked.coords else {})} for n in numbers}
    return write_bytes(path, marked.to_netcdf(engine="h5netcdf", encoding=encoding), force=force)


def read_campaign(path: Path) -> xr.Dataset:
    """Read it into memory.

    Raises
    ------
    DataError
        No such file, or not of this kind.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            dataset = opened.load()
    except (OSError, ValueError, KeyError) as fault:
        raise DataError(f"cannot be read as a Monte Carlo: {fault}", location=Location(str(path))) from fault
    if int(dataset.attrs.get(MARK, 0)) != FORMAT:
        raise DataError("not the result of a Monte Carlo", location=Location(str(path)))
    return dataset
