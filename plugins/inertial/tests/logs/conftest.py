"""A log of a standing IMU, as arrays and as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.log_config import ImuLogConfig
from estimfw_inertial.log_source import build_imu_log
from estimfw_inertial.rotation import attitude_matrix
from numpy.typing import NDArray

from estimfw.config.types import Site
from estimfw.data.record import Record
from estimfw.model.nominal import InitialNominal

FloatArray = NDArray[np.float64]

PERIOD = 0.01
LATITUDE = np.radians(34.0)
GRAVITY = 9.7966
RATE = 7.292115e-5


@dataclass(frozen=True)
class Arrays:
    """t (N,) s, dtheta (N, 3) rad, dvel (N, 3) m/s."""

    t: FloatArray
    dtheta: FloatArray
    dvel: FloatArray

    def changed(self, **fields: FloatArray) -> Arrays:
        return replace(self, **fields)

    def rows(self) -> FloatArray:
        return np.column_stack([self.t, self.dtheta, self.dvel])


@pytest.fixture
def standing() -> Arrays:
    """10 s at 100 Hz of a slightly tilted vehicle, with the noise of a good IMU."""
    rng = np.random.default_rng(5)
    count = 1000
    C = attitude_matrix(0.4, 0.02, -0.03)
    rate = C.T @ (RATE * np.array([0.0, np.cos(LATITUDE), np.sin(LATITUDE)]))
    force = C.T @ np.array([0.0, 0.0, GRAVITY])
    dtheta = rate * PERIOD + 1e-8 * rng.standard_normal((count, 3))
    dvel = force * PERIOD + 1e-5 * rng.standard_normal((count, 3))
    return Arrays(PERIOD * np.arange(1, count + 1, dtype=np.float64), dtheta, dvel)


def csv_text(rows: FloatArray | Sequence[Sequence[str | float]], header: str = "t,gx,gy,gz,ax,ay,az") -> str:
    separator = next(s for s in (";", "\t", ",") if s in header)
    return "\n".join([header, *(separator.join(_cell(c) for c in row) for row in rows)]) + "\n"


def _cell(value: str | float) -> str:
    return value if isinstance(value, str) else repr(float(value))


@pytest.fixture
def csv_of(tmp_path: Path) -> Callable[..., Path]:
    """Writes rows (or a whole text) to a CSV log."""

    def write(rows: Any, header: str = "t,gx,gy,gz,ax,ay,az") -> Path:
        path = tmp_path / "log.csv"
        path.write_text(rows if isinstance(rows, str) else csv_text(rows, header), encoding="utf-8")
        return path

    return write


@pytest.fixture
def npz_of(tmp_path: Path) -> Callable[[Arrays], Path]:
    """Writes arrays to an NPZ log."""

    def write(arrays: Arrays) -> Path:
        path = tmp_path / "log.npz"
        np.savez(path, t=arrays.t, dtheta=arrays.dtheta, dvel=arrays.dvel, dt=np.array(PERIOD))
        return path

    return write


COLUMNS = {"time": "t", "gyro": ["gx", "gy", "gz"], "accel": ["ax", "ay", "az"]}
SITE = Site.model_validate({"latitude": "34 deg", "longitude": "75 deg", "height": "0 m"})


@pytest.fixture
def load() -> Callable[..., Record]:
    """Runs the source `inertial.imu_log` on a file, at latitude 34 deg or another site."""

    def run(path: Path, site: Site = SITE, **settings: object) -> Record:
        if path.suffix == ".csv":
            settings = {"columns": COLUMNS, **settings}
        config = ImuLogConfig.model_validate({"kind": "inertial.imu_log", "file": str(path), **settings})
        return build_imu_log(config, site, InitialNominal(values={})).load()

    return run
