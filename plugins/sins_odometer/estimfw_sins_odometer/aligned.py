"""The start of a run as another run found it: ``sins_odometer.aligned`` reads the attitude out of its result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from estimfw_inertial.rotation import attitude_matrix
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Settings, Site, quantity
from estimfw.data.record import Record
from estimfw.errors import DataError, Location
from estimfw.model.nominal import InitialNominal

__all__ = ["Aligned", "AlignedConfig", "aligned"]

FloatArray = NDArray[np.float64]
ANGLES = ("attitude.yaw", "attitude.pitch", "attitude.roll")


class AlignedConfig(Settings):
    """Attitude, and gyro biases where it estimated them, of an alignment of the same record."""

    kind: Literal["sins_odometer.aligned"]
    result: Annotated[str, Field(description="path of the result.nc of an alignment")]
    at: Annotated[
        Annotated[float, quantity("s", examples=("300 s",))] | None,
        Field(description="instant at which it is taken over; left out: the end of the alignment"),
    ] = None
    gyro_bias: Annotated[str, Field(description="name of the block of the gyro biases")] = "gyro_bias"


@dataclass(frozen=True, slots=True)
class Aligned:
    """``at`` in s; the file is read when the start is looked for."""

    result: str
    at: float | None
    gyro_bias: str
    needs_record: bool = True

    def reference(self) -> InitialNominal:
        """What is known before any file is read: nothing, so North."""
        return InitialNominal({"C_bn": np.eye(3)}, source="aligned")

    def find(self, record: Record) -> InitialNominal:
        """C_bn (3, 3) and gyro_bias_b (3,) at the last epoch that is not after ``at``.

        Raises
        ------
        DataError
            No such file, no attitude in it, or no epoch before ``at``.
        """
        del record
        import xarray as xr

        if not Path(self.result).is_file():
            raise DataError(
                "there is no result of an alignment", location=Location(self.result), hint="run it first, with -o"
            )
        with xr.open_dataset(self.result) as data:
            names = [str(name) for name in data["output"].values] if "output" in data else []
            if not set(ANGLES) <= set(names):
                raise DataError("the result has no output 'attitude'", location=Location(self.result))
            time = np.asarray(data["time"].values, dtype=float)
            epoch = int(np.searchsorted(time, (time[-1] if self.at is None else self.at) + 1e-9)) - 1
            if epoch < 0:
                raise DataError(
                    f"the result begins at {time[0]:g} s, after {self.at:g} s", location=Location(self.result)
                )
            angles = data["output_value"].sel(output=list(ANGLES)).values[epoch]
            states = [str(name) for name in data["state"].values] if "state" in data else []
            wanted = [f"{self.gyro_bias}[{axis}]" for axis in "RFU"]
            known = set(wanted) <= set(states)
            bias = data["estimate"].sel(state=wanted).values[epoch] if known else np.zeros(3)
        values = {"C_bn": attitude_matrix(*angles), "gyro_bias_b": np.asarray(bias, dtype=float)}
        return InitialNominal(values, time=float(time[epoch]), source=f"aligned, taken over at {time[epoch]:g} s")


def aligned(cfg: AlignedConfig, site: Site | None) -> Aligned:
    """The finder that a config describes."""
    del site
    return Aligned(cfg.result, cfg.at, cfg.gyro_bias)
