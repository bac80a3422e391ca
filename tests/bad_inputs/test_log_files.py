"""Logs that cannot be read (26 to 32): exit code 5, with the file and the line, or the byte."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Check = Callable[..., Any]


def npz(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def imu_npz(rows: Any) -> bytes:
    return npz(t=rows[:, 0], dtheta=rows[:, 1:4], dvel=rows[:, 4:])


def test_good_logs_pass(imu_check: Check, fix_check: Check, imu: Any, fixes: str) -> None:
    told = imu_check(imu.csv())
    assert told.code == 0
    told.says("ok: 6 states, 200 steps")
    assert "note:" not in told.out
    told = fix_check(fixes)
    assert told.code == 0
    told.says("ok: 4 states, 20 steps")


def test_26_a_log_that_is_not_there_names_the_nearest(
    imu_check: Check, fix_check: Check, imu: Any, folder: Path
) -> None:
    (folder / "log1.csv").write_text(imu.csv())
    told = imu_check(None)
    assert told.code == 5
    told.says("log.csv: the IMU log does not exist", "did you mean 'log1.csv'?")
    told = fix_check(None)
    assert told.code == 5
    told.says("fix.csv: the log of stream 'fix' does not exist", f"starts at the working directory, {folder}")
    (folder / "fix.csv").mkdir()
    told = fix_check(None)
    assert told.code == 5
    told.says("fix.csv: the log of stream 'fix' is a folder, not a file")


def test_26_a_log_that_may_not_be_read_says_why(fix_check: Check, fixes: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    told = fix_check(fixes)
    assert told.code == 5
    told.says("fix.csv: cannot read the log: Permission denied")


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("time,x,z", ("fix.csv:1: no column 'y'", "columns found: 'time', 'x', 'z'")),
        ("t,x,y", ("fix.csv:1: no column 'time'", "columns found: 't', 'x', 'y'")),
        ("time,x,x", ("fix.csv:1: the column 'x' stands 2 times in the header", "columns found: 'time', 'x', 'x'")),
        ("times,x,y", ("fix.csv:1: no column 'time'", "did you mean 'times'?")),
    ],
    ids=["27-missing", "27-renamed", "27-duplicate", "27-near"],
)
def test_27_columns_are_told_with_those_found(fix_check: Check, fixes: str, header: str, says: tuple[str, ...]) -> None:
    told = fix_check(fixes.replace("time,x,y", header))
    assert told.code == 5
    told.says(*says)


def test_27_columns_of_an_imu_are_told_with_those_found(imu_check: Check, imu: Any) -> None:
    told = imu_check(imu.csv().replace("t,gx,gy,gz,ax,ay,az", "t,gx,gy,gz,ax,ay,acz"))
    assert told.code == 5
    told.says("log.csv:1: no column 'az'", "'ay', 'acz'; did you mean 'acz'?")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("5.0,10.5,20.5", "5.0,10.5", "fix.csv:11: 2 columns, expected 3"),
        (
            "5.0,10.5,20.5",
            "5.0,10.5,20.5,7",
            "fix.csv:11: 4 columns, expected 3\n  11 | 5.0,10.5,20.5,7\n  every row needs as many",
        ),
        ("5.0,10.5,20.5", "5.0,n/a,20.5", "fix.csv:11: 'n/a' in column 2 is not a number\n  11 | 5.0,n/a,20.5"),
        ("5.0,10.5,20.5", "5.0,True,20.5", "fix.csv:11: 'True' in column 2 is not a number"),
        ("5.0,10.5,20.5", "5.0,1_0,20.5", "fix.csv:11: "),
        ("5.0,10.5,20.5", "five,10.5,20.5", "fix.csv:11: 'five' in column 1 is not a number"),
    ],
    ids=["28-short", "28-long", "28-text", "28-bool", "28-underscore", "28-time"],
)
def test_28_a_ragged_row_and_text_in_a_cell_have_their_line(
    fix_check: Check, fixes: str, old: str, new: str, says: str
) -> None:
    assert old in fixes
    told = fix_check(fixes.replace(old, new))
    assert told.code == 5
    told.says(says)


def test_29_decimal_commas_and_wrong_separators_get_a_hint(fix_check: Check, fixes: str) -> None:
    told = fix_check(fixes.replace(".", ","))
    assert told.code == 5
    told.says("fix.csv:2: 6 columns, expected 3", "decimal commas?")
    told = fix_check(fixes.replace(",", ";"))
    assert told.code == 5
    told.says("fix.csv:1: no columns 'time', 'x', 'y'", "say `separator: ';'`")
    told = fix_check(fixes.replace(",", "\t"))
    assert told.code == 5
    told.says('say `separator: "\\t"`')
    told = fix_check(fixes.replace(",", ";").replace(".", ","), "separator=';'")
    assert told.code == 5
    told.says("fix.csv:2: '0,5' in column 1 is not a number", "say `decimal: ','`")


def test_29_what_the_hints_say_is_what_helps(fix_check: Check, fixes: str) -> None:
    plain = fix_check(fixes, command="run")
    german = fix_check(fixes.replace(",", ";").replace(".", ","), "separator=';'", "decimal=','", command="run")
    tabs = fix_check(fixes.replace(",", "\t"), 'separator="\\t"', command="run")
    assert plain.code == german.code == tabs.code == 0
    assert json.loads(plain.out)["states"] == json.loads(german.out)["states"] == json.loads(tabs.out)["states"]


def test_30_a_truncated_archive_tells_where_it_ends(imu_check: Check, imu: Any) -> None:
    whole = imu_npz(imu.rows)
    assert imu_check(whole, name="log.npz").code == 0
    told = imu_check(whole[:5000], name="log.npz")
    assert told.code == 5
    told.says("log.npz: not a readable NPZ archive", "(the file ends at byte 5000)", "is the file cut off")


def test_30_a_damaged_archive_tells_where(imu_check: Check, imu: Any) -> None:
    whole = imu_npz(imu.rows)
    told = imu_check(whole[:1000] + b"\0\0\0" + whole[1003:], name="log.npz")
    assert told.code == 5
    told.says("Bad CRC-32 for file 't.npy'")


def test_30_a_wrong_number_of_columns_is_told(imu_check: Check, imu: Any) -> None:
    told = imu_check(npz(t=imu.rows[:, 0], dtheta=imu.rows[:, 1:3], dvel=imu.rows[:, 4:]), name="log.npz")
    assert told.code == 5
    told.says("log.npz: t has shape (200,), dtheta (200, 2), dvel (200, 3)", "expected (N,), (N, 3) and (N, 3)")


def test_30_text_that_ends_in_the_middle_of_a_row_is_told(imu_check: Check, imu: Any) -> None:
    told = imu_check(imu.csv()[:-40])
    assert told.code == 5
    told.says("log.csv:201: ", "columns, expected 7", "the file seems to be cut off")


def test_30_a_binary_file_is_no_table(fix_check: Check) -> None:
    told = fix_check(b"time,x,y\n" + bytes(range(128, 256)))
    assert told.code == 5
    told.says("fix.csv:2: byte 9 is not text in UTF-8")


class Trap:
    """Makes a file when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (Path("sprung").touch, ())


def test_31_pickled_objects_are_refused_and_never_unpickled(imu_check: Check, imu: Any, folder: Path) -> None:
    trap = npz(t=imu.rows[:, 0], dtheta=imu.rows[:, 1:4], dvel=np.array([Trap()] * 200, dtype=object))
    told = imu_check(trap, name="log.npz")
    assert told.code == 5
    told.says("log.npz: dvel.npy holds pickled Python objects", "they are never unpickled")
    assert not (folder / "sprung").exists()


def test_31_a_zip_bomb_is_refused_before_it_is_unpacked(imu_check: Check) -> None:
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name in ("t", "dtheta", "dvel"):
            archive.writestr(f"{name}.npy", bytes(1 << 10))
    text = bytearray(bomb.getvalue())
    for at in (i for i in range(len(text)) if text[i : i + 4] == b"PK\x01\x02"):
        text[at + 24 : at + 28] = (1 << 30).to_bytes(4, "little")  # what the directory says it unpacks to
    told = imu_check(bytes(text), name="log.npz")
    assert told.code == 5
    told.says("log.npz: the archive unpacks to 3.22 GB", "the limit is 1.07 GB")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("time,x,y\n", "fix.csv: no data rows"),
        ("", "fix.csv: the file is empty"),
        ("# nothing\n\n", "the file is empty"),
    ],
    ids=["32-header-only", "32-empty", "32-comment"],
)
def test_32_a_log_without_rows_is_refused(fix_check: Check, content: str, says: str) -> None:
    told = fix_check(content)
    assert told.code == 5
    told.says(says)


def test_32_an_archive_without_rows_is_refused(imu_check: Check, imu: Any) -> None:
    told = imu_check(imu_npz(imu.rows[:0]), name="log.npz")
    assert told.code == 5
    told.says("log.npz: the archive holds no samples")
