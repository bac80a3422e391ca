"""The source `inertial.imu_log`: selection, order of time, holes, mounting, provenance."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.log_config import ImuLogConfig
from estimfw_inertial.log_source import build_imu_log
from estimfw_inertial.rotation import attitude_matrix

from estimfw.data.record import Record
from estimfw.errors import ConfigError, DataError
from estimfw.model.nominal import InitialNominal

Load = Callable[..., Record]
Write = Callable[..., Path]


def refusal(load: Load, path: Path, **settings: object) -> str:
    with pytest.raises(DataError) as caught:
        load(path, **settings)
    return str(caught.value)


def kinds(record: Record) -> list[tuple[str, int]]:
    return [(event.kind, event.count) for event in record.events]


def test_a_good_log_passes_without_events(load: Load, npz_of: Write, standing: Any) -> None:
    record = load(npz_of(standing))
    assert record.events == ()
    assert np.array_equal(record.streams["imu"].values, np.hstack([standing.dtheta, standing.dvel]))


def test_the_public_record_passes_without_events(load: Load, lasergyro: Path) -> None:
    site_is_elsewhere = [("place", 1)]
    assert kinds(load(lasergyro / "lasergyro.npz")) == []
    assert kinds(load(lasergyro / "lasergyro.imu")) == site_is_elsewhere


def test_samples_are_counted_from_one_and_the_last_is_included(load: Load, npz_of: Write, standing: Any) -> None:
    time = load(npz_of(standing), first_sample=100, last_sample=300).streams["imu"].time
    assert (time.size, time[0], time[-1]) == (201, pytest.approx(1.0), pytest.approx(3.0))


def test_start_and_stop_cut_by_the_end_of_the_interval(load: Load, npz_of: Write, standing: Any) -> None:
    time = load(npz_of(standing), start="2 s", stop="5 s").streams["imu"].time
    assert (time.size, time[0], time[-1]) == (300, pytest.approx(2.01), pytest.approx(5.0))


def test_what_a_selection_leaves_out_is_told(load: Load, npz_of: Write, standing: Any) -> None:
    path = npz_of(standing)
    (event,) = load(path, first_sample=100, last_sample=300).events
    assert (event.kind, event.count) == ("cut", 799)
    assert event.text == (
        "201 of 1000 samples are used, 1 s to 3 s; left out are 99 before and 700 after them "
        "(`first_sample` 100, `last_sample` 300)"
    )
    (event,) = load(path, stop="5 s").events
    assert (event.kind, event.count) == ("cut", 500)
    assert load(path, last_sample=1000, start="0 s").events == ()


def test_the_file_is_named_by_its_hash(load: Load, npz_of: Write, standing: Any) -> None:
    path = npz_of(standing)
    attributes = load(path).attributes
    assert attributes["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert attributes["samples"] == 1000


def test_a_selection_outside_the_log_is_refused(load: Load, npz_of: Write, standing: Any) -> None:
    path = npz_of(standing)
    assert "no sample is left by the selection; the log has 1000 from 0.01 s to 10 s" in refusal(
        load, path, start="20 s"
    )
    text = refusal(load, path, last_sample=2000)
    assert "`last_sample` is 2000, the log has 1000 samples" in text
    assert "--set source.last_sample=null" in text
    assert "no sample is left" in refusal(load, path, first_sample=1001)


def test_a_missing_file_and_a_folder_are_refused(load: Load, tmp_path: Path) -> None:
    assert "nowhere.npz: the IMU log does not exist" in refusal(load, tmp_path / "nowhere.npz")
    assert "the IMU log is a folder" in refusal(load, tmp_path)


def test_an_unreadable_file_is_refused(
    load: Load, npz_of: Write, standing: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = npz_of(standing)

    def forbidden(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("zipfile.ZipFile", forbidden)
    assert "log.npz: cannot read the IMU log: Permission denied" in refusal(load, path)


def test_an_unknown_suffix_asks_for_the_format(load: Load, npz_of: Write, standing: Any) -> None:
    path = npz_of(standing).rename(npz_of(standing).with_suffix(".dat"))
    assert "the suffix '.dat' does not tell the format\n  say `format`: one of csv, npz, psins" in refusal(load, path)
    assert len(load(path, format="npz").streams["imu"]) == 1000


def test_time_that_goes_backwards_is_refused_with_its_line(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[[500, 501]] = rows[[501, 500]]
    text = refusal(load, csv_of(rows))
    assert "log.csv:503: time goes backwards, from 5.02 s to 5.01 s" in text


def test_a_week_rollover_is_guessed(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[:, 0] += 604795.0
    rows[rows[:, 0] >= 604800.0, 0] -= 604800.0
    assert "a GPS week (604800 s)?" in refusal(load, csv_of(rows))


def test_late_rows_can_be_sorted_or_dropped_and_are_flagged(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    swapped = rows.copy()
    swapped[[500, 501]] = rows[[501, 500]]
    ordered = load(csv_of(swapped), time_errors="sort")
    assert np.array_equal(ordered.streams["imu"].values, rows[:, 1:])
    assert kinds(ordered) == [("time order", 1)]
    dropped = load(csv_of(swapped), time_errors="drop", missing="keep")
    assert np.array_equal(dropped.streams["imu"].values, np.delete(rows, 500, axis=0)[:, 1:])
    assert kinds(dropped) == [("time order", 1), ("gap", 1)]


def test_identical_rows_of_one_time_are_dropped_and_flagged(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    record = load(csv_of(np.insert(rows, 501, rows[500], axis=0)))
    assert np.array_equal(record.streams["imu"].values, rows[:, 1:])
    assert kinds(record) == [("duplicate", 1)]


def test_different_rows_of_one_time_are_refused(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[501, 0] = rows[500, 0]
    assert "log.csv:503: two different rows have the time stamp 5.01 s" in refusal(load, csv_of(rows))


def test_a_missing_time_stamp_is_refused(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[3, 0] = np.nan
    assert "log.csv:5: row 4 has no time stamp" in refusal(load, csv_of(rows))


def test_a_short_gap_is_bridged_by_the_last_sample_and_flagged(load: Load, npz_of: Write, standing: Any) -> None:
    lost = [400, 401, 402]
    cut = standing.changed(**{k: np.delete(getattr(standing, k), lost, axis=0) for k in ("t", "dtheta", "dvel")})
    record = load(npz_of(cut))
    stream = record.streams["imu"]
    assert stream.time == pytest.approx(standing.t)
    assert np.array_equal(stream.values[400:403, :3], np.repeat(standing.dtheta[399:400], 3, axis=0))
    assert np.array_equal(stream.values[403:, 3:], standing.dvel[403:])
    assert kinds(record) == [("gap", 3), ("repeated", 3)]


def test_a_long_gap_is_refused(load: Load, csv_of: Write, standing: Any) -> None:
    rows = np.delete(standing.rows(), np.arange(400, 411), axis=0)
    text = refusal(load, csv_of(rows), rate="100 Hz")
    assert "log.csv:402: a gap of 0.12 s after 4 s, longer than the limit of 0.1 s" in text
    assert kinds(load(csv_of(rows), longest_gap="0.11 s")) == [("gap", 11), ("repeated", 11)]


def test_one_missing_number_is_repeated_in_its_component_alone(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[100, 2] = np.nan
    record = load(csv_of(rows))
    expected = rows[:, 1:].copy()
    expected[100, 1] = rows[99, 2]
    assert np.array_equal(record.streams["imu"].values, expected)
    assert kinds(record) == [("repeated", 1)]


def test_missing_numbers_can_be_kept(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[100, 2] = np.nan
    values = load(csv_of(rows), missing="keep").streams["imu"].values
    assert np.array_equal(values, rows[:, 1:], equal_nan=True)


def test_numbers_missing_for_too_long_or_at_the_start_are_refused(load: Load, csv_of: Write, standing: Any) -> None:
    rows = standing.rows()
    rows[100:120, 2] = np.nan
    assert "log.csv:112: no good sample for more than 0.1 s before 1.11 s" in refusal(load, csv_of(rows))
    rows[0, 2] = np.nan
    assert "log.csv:2: the first samples are not numbers" in refusal(load, csv_of(rows))


def test_mounting_turns_the_axes_into_those_of_the_vehicle(load: Load, npz_of: Write, standing: Any) -> None:
    C = attitude_matrix(np.radians(90.0), 0.0, np.radians(180.0))
    turned = standing.changed(dtheta=standing.dtheta @ C, dvel=standing.dvel @ C)
    stream = load(npz_of(turned), mounting={"yaw": "90 deg", "roll": "180 deg"}).streams["imu"]
    assert np.allclose(stream.values, np.hstack([standing.dtheta, standing.dvel]), atol=1e-15)


def test_mounting_turns_the_start_attitude_of_a_header_too(load: Load, lasergyro: Path) -> None:
    path = lasergyro / "lasergyro.imu"
    plain, mounted = load(path), load(path, mounting={"yaw": "30 deg"})
    force_n = [r.initial["C_bn"] @ r.streams["imu"].values[0, 3:] for r in (plain, mounted)]
    assert force_n[0] == pytest.approx(force_n[1])
    assert not np.allclose(plain.initial["C_bn"], mounted.initial["C_bn"])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"first_sample": 10, "last_sample": 5}, "`last_sample` 5 comes before `first_sample` 10"),
        ({"start": "5 s", "stop": "5 s"}, "`stop` 5 s comes before `start` 5 s"),
        ({"separator": ",", "decimal": ","}, "`separator` and `decimal` are both ','"),
    ],
)
def test_limits_that_exclude_each_other_are_refused(settings: dict[str, object], message: str) -> None:
    config = ImuLogConfig.model_validate({"kind": "inertial.imu_log", "file": "a.npz", **settings})
    with pytest.raises(ConfigError, match=message):
        build_imu_log(config, None, InitialNominal(values={}))
