"""The preprocessing of a config, one component after the other, on a record or on the records of many runs."""

from __future__ import annotations

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.errors import ConfigError, DataError, PluginError
from estimfw.registry.contract import plugin_code
from estimfw.run.guard import check_record

__all__ = ["preprocessed"]


def preprocessed(problem: Problem, record: Record) -> Record:
    """The record that the filter sees.

    Parameters
    ----------
    problem : Problem
    record : Record
        As the sources made it; values (N, k), or (R, N, k) of R runs.

    Raises
    ------
    ConfigError, DataError, PluginError
        At the place of the component.
    """
    for name, component in problem.preprocess.items():
        owner, what = problem.owners.get(f"preprocess.{name}"), f"preprocess {name!r}"
        try:
            with plugin_code(owner, f"apply() of {what}"):
                made = component.apply(record)
            record = check_record(made, owner, what, leading=True)
        except (ConfigError, DataError, PluginError) as error:
            error.message = error.message if error.within else f"{what}: {error.message}"
            problem.document.placed(error, ("preprocess", name))
            raise
    return record
