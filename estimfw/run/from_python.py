"""The two calls that take a developer from a config to a result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import Overrides, load_document
from estimfw.data.record import Record
from estimfw.registry.load import load_plugins
from estimfw.run.dataset import result_dataset
from estimfw.run.preprocess import preprocessed
from estimfw.run.run import Progress, run_problem

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["open_filter", "run_filter"]


def open_filter(path: str | Path, overrides: Overrides = ()) -> Problem:
    """Compose a config with the installed plugins.

    Parameters
    ----------
    path : str or Path
        Of a YAML config.
    overrides : sequence of str, or mapping of str to value
        As ``--set`` on the command line: ``["source.seed=2"]`` or ``{"source.seed": 2}``.

    Returns
    -------
    Problem
        The model before and after its policies, their changes, and the plan; no data is read.

    Raises
    ------
    ConfigError, PluginError, NumericalError
        With file, line and column.
    UsageError
        The overrides are no list and no mapping.
    """
    return compose(load_document(path, overrides), load_plugins(core_components()))


def run_filter(problem: Problem, record: Record | None = None, progress: Progress | None = None) -> xr.Dataset:
    """Run a filter over its record.

    Parameters
    ----------
    problem : Problem
    record : Record, optional
        Instead of what the config's source makes; it is preprocessed as the config says.
    progress : callable, optional
        Called with the steps done and the steps in all, now and then.

    Returns
    -------
    xarray.Dataset
        What ``estimfw run`` writes as result.nc, see `estimfw.run.result_names`; SI units, times in s.

    Raises
    ------
    EstimfwError
        Of any kind.
    """
    ready = preprocessed(problem, record) if record is not None else None
    return result_dataset(run_problem(problem, progress, ready))
