"""A recorded drive: IMU and pulses from CSV or NPZ files, or from one file, give what the record itself gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.run.record_file import write_record
from estimfw.run.run import run_problem

SHORT = "source.duration=40 s"


@pytest.mark.parametrize("layout", ["csv", "npz", "one csv"])
def test_a_log_is_aligned_as_the_record_that_it_was_written_from(opened: Any, tmp_path: Path, layout: str) -> None:
    direct = run_problem(opened("odometer_aeba.yaml", SHORT))
    record = opened("odometer_aeba.yaml", SHORT).source.load()
    kind = layout.split()[-1]
    imu, odometer, *_ = write_record(record, tmp_path, kind, force=False)
    if layout == "one csv":
        rows, pulses = (np.loadtxt(path, delimiter=",", skiprows=1) for path in (imu, odometer))
        names = f"{imu.read_text().splitlines()[0]},pulses"
        imu = odometer = tmp_path / "both.csv"
        np.savetxt(imu, np.column_stack([rows, pulses[1:, 1]]), delimiter=",", fmt="%.17g", header=names, comments="")
    files = (f"source.file={imu}", f"aiding.wheel.streams.odometer.file={odometer}")
    logged = run_problem(opened("odometer_log.yaml", *files))
    behind = 0 if layout != "one csv" else 1  # without the count at 0 s the low-pass begins a row later
    streams = [done.prepared.record.streams["imu"] for done in (direct, logged)]
    assert streams[1].time == pytest.approx(streams[0].time[behind:], abs=1e-9)
    assert streams[1].values == pytest.approx(streams[0].values[behind:], abs=1e-9)
    if not behind:
        assert logged.output == pytest.approx(direct.output, abs=1e-8)
