"""Logs that cannot be read or trusted (26 to 32, 36, 37, 40 to 42, 47): exit code 5, with the file and the line."""

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


@pytest.fixture
def imu_check(check: Check, standing: str, folder: Path) -> Check:
    """Checks the standing vehicle on a log with this content, with further ``--set``."""

    def run(content: str | bytes | None, *settings: str, name: str = "log.csv", command: str = "check") -> Any:
        if content is not None:
            (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        more = [word for setting in settings for word in ("--set", setting)]
        return check(
            standing, *more, "--set", f"source.file={name}", *(["--json"] if command == "run" else []), command=command
        )

    return run


@pytest.fixture
def fix_check(check: Check, logged: str, folder: Path) -> Check:
    """Checks the tracker on a log ``fix.csv`` with this content."""

    def run(content: str | bytes | None, *settings: str, command: str = "check") -> Any:
        if content is not None:
            (folder / "fix.csv").write_bytes(content.encode() if isinstance(content, str) else content)
        more = [word for setting in settings for word in ("--set", f"source.streams.fix.{setting}")]
        return check(logged, *more, *(["--json"] if command == "run" else []), command=command)

    return run


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
    told.says("fix.csv:1: no column 'time'", "say `separator: ';'`")
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


def test_36_time_that_goes_backwards_is_refused_sorted_or_dropped(fix_check: Check, fixes: str) -> None:
    late = fixes.replace("5.0,10.5,20.5", "4.25,10.5,20.5")
    told = fix_check(late)
    assert told.code == 5
    told.says("fix.csv:11: time goes backwards, from 4.5 s to 4.25 s\n  11 | 4.25,10.5,20.5")
    told.says("`time_errors: sort`", "`time_errors: drop`")
    told = fix_check(late, "time_errors=sort")
    assert told.code == 0
    told.says("20 steps", "note: fix: time order, time goes backwards, from 4.5 s to 4.25 s; 1 late row sorted")
    told = fix_check(late, "time_errors=drop")
    assert told.code == 0
    told.says("19 steps", "1 late row dropped")


def test_36_an_imu_whose_time_goes_backwards_is_refused(imu_check: Check, imu: Any) -> None:
    told = imu_check(imu.changed((100, 0), lambda t: t - 1.0).csv())
    assert told.code == 5
    told.says("log.csv:102: time goes backwards, from 10 s to 9.1 s")


def test_37_identical_rows_of_one_time_are_dropped_and_flagged(fix_check: Check, fixes: str) -> None:
    row = "5.0,10.5,20.5\n"
    told = fix_check(fixes.replace(row, row + row), command="run")
    assert told.code == 0
    done = json.loads(told.out)
    assert done["dispositions"]["fused"] == 20
    (event,) = [e for e in done["events"] if e["kind"] == "duplicate"]
    assert (event["source"], event["time"], event["count"]) == ("fix", 5.0, 1)


def test_37_different_rows_of_one_time_are_refused(fix_check: Check, imu_check: Check, fixes: str, imu: Any) -> None:
    told = fix_check(fixes.replace("5.0,10.5,20.5", "4.5,10.5,20.5"))
    assert told.code == 5
    told.says("fix.csv:11: two different rows have the time stamp 4.5 s")
    told = imu_check(imu.changed((100, 0), lambda t: t - 0.1).csv())
    assert told.code == 5
    told.says("log.csv:102: two different rows have the time stamp 10 s")


def test_40_milliseconds_for_seconds_are_guessed_from_the_rate(
    imu_check: Check, fix_check: Check, imu: Any, fixes: str
) -> None:
    thousandfold = imu.changed((slice(None), 0), lambda t: 1000.0 * t).csv()
    told = imu_check(thousandfold)
    assert told.code == 5
    told.says("log.csv: the time stamps are 100 s apart: time in ms, not in s?", "`units: {time: ms}`")
    told = imu_check(thousandfold, "source.rate=10 Hz")
    assert told.code == 5
    told.says("the time stamps are 100 s apart, the sampling interval is 0.1 s: time in ms, not in s?")
    assert imu_check(thousandfold, "source.units={time: ms}").code == 0
    told = fix_check(fixes, "rate=2000 Hz")
    assert told.code == 5
    told.says("fix.csv: the time stamps are 0.5 s apart, the sampling interval is 0.0005 s: time in ms, not in s?")
    assert fix_check(fixes, "rate=2 Hz").code == 0


@pytest.mark.parametrize(
    ("columns", "factor", "parts"),
    [
        (slice(1, 4), 180.0 / np.pi, ("the mean rate is", "deg for rad?", "say the unit of the gyros (deg)")),
        (
            slice(4, 7),
            1.0 / 9.80665,
            ("the mean specific force is", "g for m/s^2?", "say the unit of the accelerometers (g)"),
        ),
        (slice(1, 7), 10.0, ("rates taken for increments?", "say `values: rate`")),
    ],
    ids=["41-deg-for-rad", "41-g-for-m/s^2", "41-rate-for-increment"],
)
def test_41_wrong_units_of_a_standing_imu_are_guessed(
    imu_check: Check, imu: Any, columns: slice, factor: float, parts: tuple[str, ...]
) -> None:
    told = imu_check(imu.changed((slice(None), columns), lambda x: factor * x).csv())
    assert told.code == 5
    told.says("log.csv: ", *parts)


@pytest.mark.parametrize(
    ("order", "signs", "parts"),
    [
        ([1, 3, 2, 4, 6, 5], [1, 1, 1, 1, 1, 1], ("shows on +y, not on +z: axes swapped?", "source.mounting")),
        ([1, 2, 3, 4, 5, 6], [1, 1, 1, -1, -1, -1], ("the signs of the accelerometers are flipped",)),
        ([1, 2, 3, 4, 5, 6], [1, -1, -1, 1, -1, -1], ("shows on -z, not on +z: z points down?", "source.mounting")),
    ],
    ids=["42-swapped", "42-flipped", "42-z-down"],
)
def test_42_swapped_axes_and_flipped_signs_show_in_the_direction_of_gravity(
    imu_check: Check, imu: Any, order: list[int], signs: list[int], parts: tuple[str, ...]
) -> None:
    told = imu_check(imu.changed((slice(None), slice(1, 7)), lambda x: x[:, np.array(order) - 1] * signs).csv())
    assert told.code == 5
    told.says("log.csv: the reaction to gravity ", *parts)


@pytest.fixture
def departing(imu: Any) -> str:
    """The vehicle stands for 15 s, then drives off to the right."""
    return imu.changed((slice(150, None), 4), lambda x: x + 0.1).csv()  # type: ignore[no-any-return]


def test_47_a_vehicle_that_drives_off_is_flagged_and_the_run_stopped_or_restarted(
    imu_check: Check, imu: Any, departing: str
) -> None:
    assert not [e for e in json.loads(imu_check(imu.csv(), command="run").out)["events"] if e["kind"] == "motion"]
    flagged = json.loads(imu_check(departing, command="run").out)
    (event,) = [e for e in flagged["events"] if e["kind"] == "motion"]
    assert event["source"] == "motion"
    assert event["time"] == pytest.approx(15.0, abs=1.0)
    assert "the vehicle accelerates from 15.0 to 20.0 s" in event["text"]
    assert flagged["time"] == pytest.approx(20.0)
    stopped = json.loads(imu_check(departing, "monitors.motion.action=stop", command="run").out)
    assert stopped["time"] == pytest.approx(15.0, abs=1.0)
    assert abs(stopped["states"]["velocity_error[N]"]["value"]) < 0.05


def test_47_a_vehicle_that_moves_from_the_start_leaves_nothing_to_run(imu_check: Check, imu: Any) -> None:
    turning = imu.changed((slice(None), 3), lambda x: x + np.radians(2.0) * 0.1)
    told = imu_check(turning.csv(), "source.checks=false", "monitors.motion.action=stop", command="run")
    assert told.code == 5
    told.says("the run would stop before its first step", "the vehicle moves from the start")
