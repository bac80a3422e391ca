"""One exception class per kind of fault; each knows its exit code.

Exit codes: 0 ok, 1 our bug, 2 usage, 3 config, 4 plugin, 5 data, 6 numerical, 7 sweep partly failed, 8 check failed,
130 interrupted.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "CheckError",
    "ConfigError",
    "DataError",
    "EstimfwError",
    "Location",
    "NumericalError",
    "PluginError",
    "SweepError",
    "UsageError",
]


@dataclass(frozen=True, slots=True)
class Location:
    """Where a fault was found: a file, and (1-based) line and column where they are known."""

    file: str
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        place = self.file
        if self.line is not None:
            place += f":{self.line}"
            if self.column is not None:
                place += f":{self.column}"
        return place


class EstimfwError(Exception):
    """A fault that we can name: what happened, where, and what to do about it.

    Parameters
    ----------
    message : str
        What is wrong, with the offending text.
    location : Location, optional
        The file, line and column.
    hint : str, optional
        What was expected, or the nearest valid thing.
    within : tuple of str and int
        For a fault in the settings of a component: the path inside them. Whoever knows where the component stands makes a
        location of it.
    """

    exit_code = 1
    kind = "error"

    def __init__(
        self,
        message: str,
        *,
        location: Location | None = None,
        hint: str | None = None,
        within: tuple[str | int, ...] = (),
    ) -> None:
        super().__init__(message)
        self.message = message
        self.location = location
        self.hint = hint
        self.within = within

    def __str__(self) -> str:
        text = f"{self.location}: {self.message}" if self.location else self.message
        return f"{text}\n  {self.hint}" if self.hint else text

    def as_json(self) -> dict[str, object]:
        """The same facts for machines."""
        place = self.location
        return {
            "kind": self.kind,
            "exit_code": self.exit_code,
            "message": self.message,
            "file": place.file if place else None,
            "line": place.line if place else None,
            "column": place.column if place else None,
            "hint": self.hint,
        }


class UsageError(EstimfwError):
    """The command line is wrong."""

    exit_code = 2
    kind = "usage"


class ConfigError(EstimfwError):
    """The config, or the model that it describes, is wrong."""

    exit_code = 3
    kind = "config"


class PluginError(EstimfwError):
    """A plugin cannot be used, or broke its contract."""

    exit_code = 4
    kind = "plugin"


class DataError(EstimfwError):
    """A data file or a record cannot be read, trusted or written."""

    exit_code = 5
    kind = "data"


class NumericalError(EstimfwError):
    """A computation left the numbers in which it makes sense."""

    exit_code = 6
    kind = "numerical"


class SweepError(EstimfwError):
    """Some runs of a sweep failed."""

    exit_code = 7
    kind = "sweep"


class CheckError(EstimfwError):
    """What was asked to be checked does not hold: the computation went well, its outcome is not good enough."""

    exit_code = 8
    kind = "check"
