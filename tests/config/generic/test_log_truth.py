"""The truth of a logged record: read back as it was written, from a table in the units of its maker, and interpolated."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main
from estimfw.config.generic.log_truth import LogTruthConfig, read_truth
from estimfw.data.record import Record, Truth
from estimfw.errors import ConfigError, DataError
from estimfw.run.outputs import truth_at
from estimfw.run.record_file import write_record

EXAMPLE = Path(__file__).parents[3] / "examples" / "tracker.yaml"
FILES = "source={{kind: log, streams: {{fix: {{file: d/fix.csv}}, speed: {{file: d/speed.csv}}}}, truth: {}}}"


@pytest.fixture
def answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """Code and answer of the example tracker, 10 s of it, on its files with this truth (None: on its own simulation)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tracker.yaml").write_text(EXAMPLE.read_text().replace("duration: 120 s", "duration: 10 s"))
    assert main(["simulate", "tracker.yaml", "-o", "d", "--format", "csv"]) == 0

    def run(truth: str | None) -> Any:
        capsys.readouterr()
        code = main(["run", "tracker.yaml", "--json", *(["--set", FILES.format(truth)] if truth else [])])
        told = capsys.readouterr()
        return json.loads(told.out) if code == 0 else (code, told.err)

    return run


def test_the_truth_of_a_simulation_is_read_back_to_the_last_bit(answer: Callable[..., Any]) -> None:
    simulated, read = answer(None), answer("d/truth.npz")
    for label, state in simulated["states"].items():
        assert read["states"][label]["truth"] == state["truth"]
        assert read["states"][label]["error"] == read["states"][label]["value"] - state["truth"]


def test_a_table_brings_columns_in_its_own_units(tmp_path: Path) -> None:
    (tmp_path / "rtk.csv").write_text("ms;lat;ve;vn\n0;45,0;1,0;2,0\n500;46,0;1,5;2,5\n")
    cfg = LogTruthConfig(
        file=str(tmp_path / "rtk.csv"), time="ms", time_unit="ms", separator=";", decimal=",",
        columns={"latitude": "lat", "velocity_t": ("ve", "vn")}, units={"lat": "deg", "ve": "km/h"},
    )  # fmt: skip
    truth, facts = read_truth(cfg)
    np.testing.assert_allclose(truth.time, [0.0, 0.5])
    np.testing.assert_allclose(truth.values["latitude"], np.radians([45.0, 46.0]))
    np.testing.assert_allclose(truth.values["velocity_t"], [[1.0 / 3.6, 2.0], [1.5 / 3.6, 2.5]])
    assert facts["file"] == str(tmp_path / "rtk.csv")


def test_between_its_instants_a_logged_truth_is_interpolated_the_shorter_way_round_and_unknown_outside() -> None:
    turn = 2.0 * np.pi
    truth = Truth(
        np.array([1.0, 2.0, 4.0]), {"heading": np.array([turn - 0.2, 0.2, 0.4]), "place": np.array([[0.0], [2.0], [6.0]])},
        "linear", frozenset({"heading"}),
    )  # fmt: skip
    found = truth_at(truth, np.array([0.5, 1.0, 1.25, 2.0, 3.0, 4.0, 4.5]))
    assert found is not None
    heading = [np.nan, turn - 0.2, turn - 0.1, 0.2, 0.3, 0.4, np.nan]
    np.testing.assert_allclose(found["heading"], heading, rtol=1e-14)
    np.testing.assert_allclose(found["place"][:, 0], [np.nan, 0.0, 0.5, 2.0, 4.0, 6.0, np.nan], rtol=1e-14)


def test_truths_of_states_keep_their_names_in_an_archive(tmp_path: Path) -> None:
    values = {"state:bias[x]": np.array([1.0 / 3.0, 0.1]), "C_bn": np.arange(18.0).reshape(2, 3, 3) / 7.0}
    write_record(Record({}, Truth(np.array([0.0, 1.0]), values)), tmp_path, "npz", force=False)
    truth, _ = read_truth(str(tmp_path / "truth.npz"))
    assert set(truth.values) == set(values)
    for name, value in values.items():
        np.testing.assert_array_equal(truth.values[name], value)


def test_what_is_wrong_with_a_truth_is_told(answer: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("time,x\n0,1\n0,2\n")
    code, told = answer("{file: t.csv}")
    assert code == 3 and "does not say which of its columns is which truth" in told
    code, told = answer("{file: t.csv, columns: {place: y}}")
    assert code == 5 and "no column 'y'" in told
    code, told = answer("{file: t.csv, columns: {place: x}}")
    assert code == 5 and "instants have to grow" in told
    code, told = answer("nowhere.npz")
    assert code == 5 and "nowhere.npz" in told
    code, told = answer("{file: t.csv, columns: {place: x}, units: {z: m}}")
    assert code == 3 and "no column 'z'" in told
    with pytest.raises(ConfigError, match="no truth 'heading'"):
        read_truth(LogTruthConfig(file=str(tmp_path / "d" / "truth.npz"), wraps=("heading",)))
    with pytest.raises(DataError, match="no array 'w'"):
        read_truth(LogTruthConfig(file=str(tmp_path / "d" / "truth.npz"), columns={"v": "w"}))
