"""The report of a result: a page and its pictures, from the result alone."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from estimfw.errors import DataError, Location
from estimfw.run.files import refuse_existing, write_atomically, write_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIGURES", "PAGE", "states_only_on_page", "write_report"]

PAGE = "report.html"
FIGURES = "figures"
PICTURE_POINTS = 4000

PICTURED_STATES = 48
"""More states than these are drawn one by one on the page alone: drawing pictures takes longer than such a filter runs."""


def states_only_on_page(dataset: xr.Dataset) -> bool:
    """Whether there are too many states for pictures of each; their sigmas, outputs and measurements have pictures still."""
    return int(dataset.sizes.get("state", 0)) > PICTURED_STATES


def write_report(dataset: xr.Dataset | Path, folder: Path, *, force: bool = False) -> list[Path]:
    """Write ``report.html`` and ``figures/*.png`` into a folder; many states are on the page alone (`states_only_on_page`).

    Parameters
    ----------
    dataset : xarray.Dataset or Path
        A result, or the file of one.
    folder : Path
        Made where it is missing. It is not locked here: whoever writes more into it holds `output_folder` around it.
    force : bool
        Replace files that are there.

    Returns
    -------
    list of Path
        What was written, the page first.

    Raises
    ------
    DataError
        No result, a file exists, or one cannot be written. Nothing is written if a file would be refused.
    """
    from estimfw.report.charts import charts_of
    from estimfw.report.page import page
    from estimfw.report.pictures import save_picture
    from estimfw.run.result_file import check_result, read_result

    result = read_result(dataset) if isinstance(dataset, Path) else dataset
    check_result(result)
    charts = charts_of(result, PICTURE_POINTS)
    if states_only_on_page(result):
        charts = tuple(chart for chart in charts if chart.section not in ("states", "state_errors"))
    pictures = {folder / FIGURES / f"{chart.key}.png": chart for chart in charts}
    paths = [folder / PAGE, *pictures]
    for path in paths:
        refuse_existing(path, force=force)
    _make(folder / FIGURES if pictures else folder)
    write_text(folder / PAGE, page(result), force=force)
    for path, chart in pictures.items():
        write_atomically(path, partial(save_picture, chart), force=force)
    return paths


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise DataError(f"cannot write: {fault.strerror}", location=Location(str(folder))) from fault
