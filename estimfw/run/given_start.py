"""The start of a filter that runs without a record: only one that is given."""

from __future__ import annotations

from estimfw.config.compose import Problem
from estimfw.errors import UsageError
from estimfw.model.nominal import InitialNominal

__all__ = ["given_start"]


def given_start(problem: Problem) -> InitialNominal | None:
    """The start that a config gives; None where it says nothing of it.

    Raises
    ------
    UsageError
        It has to be found from a record (the component's ``needs_record``).
    """
    if problem.initial is None:
        return None
    if getattr(problem.initial, "needs_record", False):
        raise UsageError(
            "the start of this filter is found from a record, and a session has none",
            hint="find it with the first samples: found = problem.initial.find(record); "
            "then Session(problem, start=found, time=found.time)",
        )
    given: InitialNominal = problem.initial.reference()
    return given
