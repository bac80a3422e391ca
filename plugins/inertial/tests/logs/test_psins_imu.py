"""PSINS logs: header, scale, and the public record against its own NumPy copy."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from estimfw_inertial.readers import read_log

from estimfw.errors import DataError

HEADER = """% PSINS-format SIMU log file.

1.0 2.0 -90.0 0.1 0.2 0.3
34.0 108.0 380.0 5.0 10.0 9.8
0.1 0.2 0.3 100.0 200.0 300.0
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.imu"
    path.write_text(HEADER + "1 2 3 4 5 6\n-1 0 0 0 0 80\n")
    return path


def test_counts_are_scaled_by_the_header(log: Path) -> None:
    stream = read_log(log).stream
    arcsec, ug = np.pi / 180 / 3600, 9.8e-6
    assert stream.values[0] == pytest.approx(
        [0.1 * arcsec, 0.4 * arcsec, 0.9 * arcsec, 400 * ug, 1000 * ug, 1800 * ug], rel=1e-14
    )
    assert stream.time == pytest.approx([5.01, 5.02])
    assert stream.period == 0.01


def test_the_header_gives_place_and_start(log: Path) -> None:
    found = read_log(log)
    assert np.degrees(found.header["latitude"]) == pytest.approx(34.0)
    assert found.header["height"] == 380.0
    assert found.initial["velocity_n"].tolist() == [0.1, 0.2, 0.3]
    forward = found.initial["C_bn"] @ [0.0, 1.0, 0.0]
    assert forward == pytest.approx([np.cos(np.radians(1.0)), 0.0, np.sin(np.radians(1.0))])


def test_the_public_record_is_the_same_from_text_and_from_numpy(lasergyro: Path) -> None:
    text, binary = read_log(lasergyro / "lasergyro.imu").stream, read_log(lasergyro / "lasergyro.npz").stream
    assert text.time == pytest.approx(binary.time, rel=1e-12)
    assert np.allclose(text.values, binary.values, rtol=1e-12, atol=0.0)


def test_half_an_hour_of_text_is_read_in_half_a_second(lasergyro: Path) -> None:
    best = min(_seconds(lasergyro / "lasergyro.imu") for _ in range(3))
    assert best < 0.5


def _seconds(path: Path) -> float:
    begin = time.process_time()
    read_log(path)
    return time.process_time() - begin


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("% only a comment\n", "ends inside its header, before the line with pitch roll yaw"),
        ("1 2 3\n", ":1: '1 2 3' is no header line"),
        (HEADER.replace("10.0 9.8", "0.0 9.8"), ":5: sampling interval 0 ms"),
        (HEADER, "no data rows"),
        (HEADER + "1 2 3 4 5 6\n1 2 3 4 5\n1 2 3 4 5 6\n", ":7: 5 columns, expected 6"),
        (HEADER + "1 2 3 4 5 6\n1 2 3\n", ":7: 3 columns, expected 6\n  the file seems to be cut off"),
        (HEADER + "1 2 3 4 x 6\n", ":6: 'x' in column 5 is not a number"),
        (HEADER + "1 2 3,5 4 5 6\n", "decimal comma"),
    ],
)
def test_a_bad_log_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.imu"
    path.write_text(text)
    with pytest.raises(DataError) as caught:
        read_log(path)
    assert message in str(caught.value)
