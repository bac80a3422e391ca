"""The log of the compass: CSV with the columns ``time`` (s), ``E``, ``N``, ``U`` (m)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from estimfw.config.types import Settings
from estimfw.data.record import Record, Stream
from estimfw.errors import DataError, Location

__all__ = ["CompassLog", "CompassLogConfig", "compass_log"]

COLUMNS = ["time", "E", "N", "U"]


class CompassLogConfig(Settings):
    """``file`` is the path of the log, ``stream`` the name that measurements read it by."""

    kind: Literal["acme.compass_log"]
    file: str
    stream: str = "compass"


@dataclass(frozen=True, slots=True)
class CompassLog:
    """A log on disk; ``load`` reads it anew each time."""

    config: CompassLogConfig

    def load(self) -> Record:
        """One stream; a reading that the compass left empty is NaN, and is skipped by the filter.

        Raises
        ------
        DataError
            No such file, no such column, or what is no number.
        """
        path = Path(self.config.file)
        try:
            table = pd.read_csv(path, usecols=COLUMNS, dtype=np.float64)
        except (OSError, ValueError) as cause:
            wanted = f"expected a CSV file with the columns {', '.join(COLUMNS)}"
            raise DataError(
                f"cannot read the compass log: {cause}", location=Location(str(path)), hint=wanted
            ) from cause
        stream = Stream(self.config.stream, table["time"].to_numpy(), table[COLUMNS[1:]].to_numpy(), ("E", "N", "U"))
        return Record({stream.name: stream}, attributes={"file": str(path)})


def compass_log(config: CompassLogConfig, site: Any, initial: Any) -> CompassLog:
    """The source; it needs neither the site nor the start."""
    return CompassLog(config)
