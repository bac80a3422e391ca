"""Settings of ``inertial.imu_log``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from estimfw.config.types import PositiveInt, Settings, non_negative_quantity, positive_quantity, quantity
from estimfw.data.row_order import TimeErrors
from estimfw_inertial.known_mistakes import DEG, Values
from estimfw_inertial.missing_rows import Missing
from estimfw_inertial.mounting import MountingConfig
from estimfw_inertial.readers import CsvLayout

__all__ = ["ColumnsConfig", "ImuLogConfig", "UnitsConfig"]

_Three = Annotated[tuple[str, str, str], Strict(False)]
_LAYOUT = CsvLayout()


class ColumnsConfig(Settings):
    """Names of the columns of a CSV log, as in its header line."""

    time: Annotated[str, Field(description="column of the time stamps; each is the end of its interval")] = _LAYOUT.time
    gyro: Annotated[_Three, Field(description="columns of the gyros x, y, z")] = _LAYOUT.gyro
    accel: Annotated[_Three, Field(description="columns of the accelerometers x, y, z")] = _LAYOUT.accel


class UnitsConfig(Settings):
    """Units of a CSV log. Default: SI."""

    time: Annotated[str | None, Field(description="s (default), ms, us ...")] = None
    gyro: Annotated[
        str | None, Field(description="of increments rad (default), deg ...; of rates rad/s, deg/s ...")
    ] = None
    accel: Annotated[str | None, Field(description="of increments m/s (default), g*s ...; of rates m/s^2, g ...")] = (
        None
    )


class ImuLogConfig(Settings):
    """Settings of ``inertial.imu_log``."""

    kind: Literal["inertial.imu_log"]
    file: Annotated[str, Field(description="path of the log")]
    format: Annotated[
        Literal["auto", "csv", "npz", "psins"],
        Field(description="auto: by the suffix, .csv, .tsv, .txt, .npz, .imu"),
    ] = "auto"
    first_sample: Annotated[PositiveInt | None, Field(description="first row used, counted from 1")] = None
    last_sample: Annotated[PositiveInt | None, Field(description="last row used, counted from 1, included")] = None
    start: Annotated[Annotated[float, quantity("s")] | None, Field(description="rows after this instant")] = None
    stop: Annotated[Annotated[float, quantity("s")] | None, Field(description="rows up to this instant")] = None
    rate: Annotated[
        Annotated[float, positive_quantity("Hz", examples=("100 Hz",))] | None,
        Field(description="sampling rate; default: what the file says, else the median step of the time stamps"),
    ] = None
    columns: Annotated[ColumnsConfig, Field(description="names of the columns (CSV)")] = ColumnsConfig()
    units: Annotated[UnitsConfig, Field(description="units of the columns (CSV)")] = UnitsConfig()
    values: Annotated[Values, Field(description="integrals over each interval, or means over it (CSV)")] = "increment"
    separator: Annotated[str, Field(min_length=1, max_length=1, description="between the columns (CSV)")] = ","
    decimal: Annotated[Literal[".", ","], Field(description="decimal mark (CSV)")] = "."
    mounting: Annotated[MountingConfig | None, Field(description="turn of the IMU against the vehicle")] = None
    time_errors: Annotated[TimeErrors, Field(description="what becomes of rows that go back in time")] = "error"
    missing: Annotated[Missing, Field(description="repeat the last good sample for lost ones, or keep the holes")] = (
        "repeat"
    )
    longest_gap: Annotated[float, positive_quantity("s"), Field(description="longer ones are refused")] = 0.1
    checks: Annotated[bool, Field(description="compare with gravity and the Earth's rate (a standing vehicle)")] = True
    rate_tolerance: Annotated[
        float,
        non_negative_quantity("rad/s", examples=("2 deg/h",)),
        Field(
            description="by how much the mean rate along gravity may miss the Earth's at the site before it is flagged"
        ),
    ] = 2.0 / DEG / 3600.0
