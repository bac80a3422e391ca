"""NPZ logs: what a good one gives, and what a bad one gets."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.readers import npz, read_log

from estimfw.errors import DataError


class Trap:
    """Leaves a file behind if it is ever unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[Path]]:
        return Path.touch, (self.path,)


def good(count: int = 5) -> dict[str, Any]:
    rows = np.arange(count * 3, dtype=float).reshape(count, 3)
    return {"t": 0.01 * np.arange(1, count + 1), "dtheta": rows, "dvel": -rows, "dt": np.array(0.01)}


def test_arrays_become_the_stream_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **good())
    stream = read_log(path).stream
    assert np.array_equal(stream.time, good()["t"])
    assert np.array_equal(stream.values, np.hstack([good()["dtheta"], good()["dvel"]]))
    assert stream.columns == ("dtheta_x", "dtheta_y", "dtheta_z", "dvel_x", "dvel_y", "dvel_z")
    assert (stream.kind, stream.period) == ("increment", 0.01)


def test_pickled_objects_are_refused_and_never_unpickled(tmp_path: Path) -> None:
    trap = tmp_path / "sprung"
    path = tmp_path / "a.npz"
    np.savez(path, **{**good(), "dvel": np.array([Trap(trap)] * 5, dtype=object)})
    with pytest.raises(DataError, match=r"dvel\.npy holds pickled Python objects"):
        read_log(path)
    assert not trap.exists()


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, **{**good(), "zeros": np.zeros(3_000_000)})
    assert path.stat().st_size < 50_000
    monkeypatch.setattr(npz, "LARGEST", 20_000_000)
    monkeypatch.setattr(zipfile.ZipFile, "open", _never)
    with pytest.raises(DataError, match=r"unpacks to 0\.024 GB"):
        read_log(path)


def test_a_header_that_promises_more_than_the_file_holds_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    liar = io.BytesIO()
    np.lib.format.write_array_header_1_0(liar, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 3)})
    np.savez(path, **good())
    with zipfile.ZipFile(path) as old:
        members = {name: old.read(name) for name in old.namelist()}
    with zipfile.ZipFile(path, "w") as new:
        for name, data in members.items():
            new.writestr(name, liar.getvalue() if name == "dvel.npy" else data)
    with pytest.raises(DataError, match=r"dvel\.npy has \d+ bytes, its header promises 24000000000128"):
        read_log(path)


def test_a_cut_off_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **good(1000))
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(DataError, match="not a readable NPZ archive"):
        read_log(path)


def test_a_damaged_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **good(1000))
    data = bytearray(path.read_bytes())
    data[3000] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(DataError, match="not a readable NPZ archive: Bad CRC-32"):
        read_log(path)


def test_a_missing_array_is_named_with_those_found(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    arrays = good()
    arrays["gyro"] = arrays.pop("dtheta")
    np.savez(path, **arrays)
    with pytest.raises(DataError, match="no array 'dtheta'\n  arrays found: dt, dvel, gyro, t;"):
        read_log(path)


@pytest.mark.parametrize(
    ("name", "array", "message"),
    [
        ("dvel", np.zeros((4, 3)), r"t has shape \(5,\), dtheta \(5, 3\), dvel \(4, 3\)"),
        ("dvel", np.zeros((5, 4)), r"dvel \(5, 4\)"),
        ("t", np.array(["a"] * 5), r"t\.npy holds <U1, not real numbers"),
        ("dtheta", np.zeros((5, 3), dtype=complex), "holds complex128"),
        ("dt", np.array(0.0), "dt is 0.0"),
        ("dt", np.array([0.01, 0.02]), r"dt is \[0.01, 0.02\]"),
    ],
)
def test_odd_arrays_are_refused(tmp_path: Path, name: str, array: Any, message: str) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **{**good(), name: array})
    with pytest.raises(DataError, match=message):
        read_log(path)


def test_no_samples_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **good(0))
    with pytest.raises(DataError, match="no samples"):
        read_log(path)


def _never(*_: object, **__: object) -> None:
    raise AssertionError("unpacked")
