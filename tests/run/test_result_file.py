"""A result survives the disk, reads well without us, and a foreign or damaged file is named as such."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from estimfw.errors import DataError
from estimfw.run.result_file import check_result, read_result, write_result, write_summary_json
from estimfw.run.result_names import described, measurement_names
from estimfw.run.summary import end_outputs, end_states, events_of, measurement_summaries, summarise

HOUR = 3600 * 180 / np.pi


@pytest.fixture
def result() -> xr.Dataset:
    """Four steps, two states, one measurement with one component."""
    time = np.array([1.0, 2.0, 3.0, 4.0])
    estimate = np.array([[0.1, 1e-8], [0.2, 2e-8], [0.3, np.nan], [0.4, np.nan]])
    return xr.Dataset(
        {
            "state_unit": ("state", ["m/s", "rad/s"]),
            "state_display_unit": ("state", ["m/s", "deg/h"]),
            "state_display_scale": ("state", [1.0, HOUR]),
            "estimate": (("time", "state"), estimate),
            "sigma": (("time", "state"), np.full((4, 2), 1e-8)),
            "covariance": (("covariance_time", "state", "state_column"), np.ones((1, 2, 2)) * 1e-16),
            "odo_innovation": (("odo_time", "odo_row"), [[1.0], [np.nan], [9.0]], {"unit": "m/s", "threshold": 10.8}),
            "odo_innovation_sigma": (("odo_time", "odo_row"), [[1.0], [np.nan], [1.0]]),
            "odo_nis": ("odo_time", [1.5, np.nan, 81.0]),
            "odo_disposition": ("odo_time", np.array([0, 3, 1], dtype=np.int8)),
            "odo_used": ("odo_time", [1, 0, 0]),
            "event_time": ("event", [2.0, np.nan]),
            "event_source": ("event", ["odo", "odo"]),
            "event_kind": ("event", ["gap", "gap"]),
            "event_text": ("event", ["a gap", "ein Loch ±"]),
            "event_count": ("event", [1, 2]),
        },
        coords={
            "time": time,
            "state": ["velocity_error[E]", "gyro_bias[N]"],
            "state_column": ["velocity_error[E]", "gyro_bias[N]"],
            "covariance_time": [4.0],
            "odo_time": time[1:],
            "odo_row": ["along"],
        },
        attrs={"title": "a run", "provenance": json.dumps({"seed": 3}), "policies": "[]", "equivalence": "[]"},
    )


def test_a_result_comes_back_bit_for_bit(result: xr.Dataset, tmp_path: Path) -> None:
    back = read_result(write_result(result, tmp_path / "r.nc"))
    xr.testing.assert_equal(back, result)
    assert back["odo_disposition"].dtype == np.int8
    assert back.attrs["provenance"] == result.attrs["provenance"]


def test_the_file_reads_well_without_us(result: xr.Dataset, tmp_path: Path) -> None:
    path = write_result(result, tmp_path / "r.nc")
    with xr.open_dataset(path) as plain:
        assert plain["time"].dtype == np.float64
        assert plain["odo_innovation"].attrs["units"] == "m/s"
        assert plain["odo_disposition"].attrs["flag_meanings"] == "fused gated late missing invalid"
        np.testing.assert_array_equal(plain["odo_disposition"].attrs["flag_values"], range(5))
        for name, variable in plain.variables.items():
            assert variable.attrs["long_name"], name
            assert variable.dtype.kind not in "iuf" or variable.attrs["units"], name
    with h5py.File(path) as file:
        assert file["estimate"].compression == "gzip"
        assert list(file["state"].asstr()) == list(result["state"].values)


def test_describing_leaves_the_result_itself_and_its_own_words_alone(result: xr.Dataset) -> None:
    result["sigma"].attrs["long_name"] = "mine"
    complete = described(result)
    assert complete["sigma"].attrs["long_name"] == "mine"
    assert "long_name" not in result["estimate"].attrs
    assert complete["estimate"].to_numpy() is not None
    assert np.shares_memory(complete["estimate"].to_numpy(), result["estimate"].to_numpy())


def test_an_existing_result_is_refused_without_force(result: xr.Dataset, tmp_path: Path) -> None:
    path = write_result(result, tmp_path / "r.nc")
    before = path.read_bytes()
    with pytest.raises(DataError, match="exists"):
        write_result(result, path)
    assert path.read_bytes() == before
    write_result(result.isel(time=slice(2)), path, force=True)
    assert read_result(path).sizes["time"] == 2


def test_a_full_disk_leaves_the_old_result_readable(result: xr.Dataset, tmp_path: Path) -> None:
    path = write_result(result, tmp_path / "r.nc")
    program = f"""
        import resource
        from pathlib import Path
        import numpy as np
        import xarray as xr
        from estimfw.errors import DataError
        from estimfw.run.result_file import read_result, write_result
        old = read_result(Path({str(path)!r}))
        noise = np.random.default_rng(0).standard_normal((100_000, 2))
        big = old.drop_dims("time").assign_coords(time=np.arange(100_000.0))
        big["estimate"] = (("time", "state"), noise)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        try:
            write_result(big, Path({str(path)!r}), force=True)
        except DataError as fault:
            print(fault)
        """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "cannot write" in done.stdout
    xr.testing.assert_equal(read_result(path), result)
    assert {entry.name for entry in tmp_path.iterdir()} == {"r.nc"}


def test_a_missing_a_foreign_and_a_damaged_file_are_data_errors(result: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file"):
        read_result(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("time,value\n1,2\n")
    with pytest.raises(DataError, match=r"text\.nc: cannot be read as a result"):
        read_result(tmp_path / "text.nc")
    (tmp_path / "empty.nc").write_bytes(b"")
    with pytest.raises(DataError, match="cannot be read"):
        read_result(tmp_path / "empty.nc")
    whole = write_result(result, tmp_path / "r.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DataError, match="cannot be read"):
        read_result(tmp_path / "cut.nc")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(DataError, match="not a result of ours"):
        read_result(tmp_path / "other.nc")


def test_a_file_cut_at_any_place_is_a_data_error(result: xr.Dataset, tmp_path: Path) -> None:
    whole = write_result(result, tmp_path / "r.nc").read_bytes()
    cut = tmp_path / "cut.nc"
    for length in range(0, len(whole), max(1, len(whole) // 25)):
        cut.write_bytes(whole[:length])
        with pytest.raises(DataError):
            read_result(cut)


def test_a_result_of_a_newer_program_is_refused(result: xr.Dataset, tmp_path: Path) -> None:
    path = write_result(result, tmp_path / "r.nc")
    with h5py.File(path, "a") as file:
        file.attrs["estimfw_result"] = 2
    with pytest.raises(DataError, match="newer estimfw"):
        read_result(path)


@pytest.mark.parametrize(
    ("spoil", "match"),
    [
        (lambda r: r.drop_vars("estimate"), "estimate or output_value missing"),
        (lambda r: r.drop_vars("state_display_scale"), "state_display_scale missing"),
        (lambda r: r.drop_vars("time"), "time missing"),
        (lambda r: r.assign(estimate=r["estimate"].T), r"estimate\(time, state\) missing"),
        (lambda r: r.assign_attrs(provenance="{"), "no JSON"),
        (lambda r: r.assign_attrs(provenance="[]"), "wrong shape"),
        (lambda r: r.assign_attrs(policies="{}"), "wrong shape"),
        (lambda r: r.assign_attrs(equivalence="[1]"), "wrong shape"),
    ],
)
def test_what_a_result_lacks_is_named(result: xr.Dataset, spoil: object, match: str) -> None:
    check_result(result)
    assert callable(spoil)
    with pytest.raises(DataError, match=match):
        check_result(spoil(result))


def test_end_values_are_the_last_known_ones_in_both_units(result: xr.Dataset) -> None:
    velocity, gyro = end_states(result)
    assert (velocity.value, velocity.time) == (0.4, 4.0)
    assert (gyro.value, gyro.time) == (2e-8, 2.0)
    assert gyro.display()[0] == pytest.approx(2e-8 * HOUR)
    assert np.isnan(velocity.error)
    assert end_outputs(result) == ()


def test_measurements_are_counted_by_what_became_of_them(result: xr.Dataset) -> None:
    assert measurement_names(result) == ("odo",)
    (odo,) = measurement_summaries(result)
    assert odo.counts == {"fused": 1, "gated": 1, "late": 0, "missing": 1, "invalid": 0}
    assert (odo.nis_mean, odo.freedom, odo.unit, odo.components, odo.total) == (1.5, 1.0, "m/s", 1, 3)


def test_the_summary_is_strict_json(result: xr.Dataset, tmp_path: Path) -> None:
    path = write_summary_json(result, tmp_path / "summary.json")
    summary = json.loads(path.read_text(), parse_constant=pytest.fail)
    assert summary["states"][0]["error"] is None
    assert summary["states"][1]["display"]["unit"] == "deg/h"
    assert summary["events"] == [{"source": "odo", "kind": "gap", "count": 3}]
    assert summary["provenance"] == {"seed": 3}
    assert summary["measurements"][0]["fused"] == 1
    with pytest.raises(DataError, match="exists"):
        write_summary_json(result, path)


def test_a_result_without_rows_still_has_a_summary(result: xr.Dataset) -> None:
    empty = summarise(result.isel(time=slice(0), odo_time=slice(0)))
    assert empty["steps"] == 0
    assert empty["states"][0]["value"] is None
    assert empty["measurements"][0]["nis_mean"] is None


def test_events_come_back_as_events(result: xr.Dataset, tmp_path: Path) -> None:
    _first, second = events_of(read_result(write_result(result, tmp_path / "r.nc")))
    assert (second.source, second.text, second.count) == ("odo", "ein Loch ±", 2)
    assert np.isnan(second.time)
    assert events_of(result.drop_dims("event")) == ()
