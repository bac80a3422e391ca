"""A model on logged measurements: what `simulate` writes, `log` reads, in other units and from other columns too."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main

EXAMPLE = Path(__file__).parents[3] / "examples" / "tracker.yaml"


@pytest.fixture
def answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """The answer of the example tracker, 10 s of it, on a source (None: its own simulation)."""
    monkeypatch.chdir(tmp_path)
    text = EXAMPLE.read_text().replace("duration: 120 s", "duration: 10 s")
    (tmp_path / "tracker.yaml").write_text(text)
    for kind in ("npz", "csv"):
        assert main(["simulate", "tracker.yaml", "-o", kind, "--format", kind]) == 0

    def run(streams: str | None, *more: str) -> Any:
        capsys.readouterr()
        source = ["--set", f"source={{kind: log, streams: {streams}}}"] if streams is not None else []
        code = main(["run", "tracker.yaml", "--json", *source, *more])
        told = capsys.readouterr()
        assert code == 0, told.out
        return json.loads(told.out)

    return run


def values(done: Any) -> dict[str, tuple[float, float]]:
    return {label: (s["value"], s["sigma"]) for label, s in done["states"].items()}


def close(a: Any, b: Any, rel: float = 1e-9) -> bool:
    return all(values(a)[label] == pytest.approx(values(b)[label], rel=rel) for label in values(a))


@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_what_was_simulated_and_written_gives_the_same_estimates_when_read(
    answer: Callable[..., Any], kind: str
) -> None:
    whole = answer(None)
    read = answer(f"{{fix: {{file: {kind}/fix.{kind}}}, speed: {{file: {kind}/speed.{kind}}}}}")
    assert read["steps"] == whole["steps"]
    assert read["dispositions"] == whole["dispositions"]
    assert "truth" not in read["states"]["position[x]"]
    # A log does not say when the filter started, so its prior holds at the first row; 10 s later little is left of that.
    assert close(read, whole, rel=0.02)
    assert read["provenance"]["record"]["files"]["fix"]["rows"] == 20


def test_units_names_of_columns_and_separators_are_the_users_own(answer: Callable[..., Any], tmp_path: Path) -> None:
    table = np.loadtxt(tmp_path / "csv" / "fix.csv", delimiter=",", skiprows=1)
    rows = "\n".join(f"{1e3 * t!r};good;{y / 1e3!r};{x * 100.0!r}" for t, x, y in table.tolist())
    (tmp_path / "own.txt").write_text(f"# of my receiver\nms;quality;north_km;east_cm\n{rows}\n")
    speed = "speed: {file: csv/speed.csv}"
    own = "{file: own.txt, time: ms, time_unit: ms, separator: ';', units: {east_cm: cm, north_km: km}, rate: 2 Hz}"
    plain = answer(f"{{fix: {{file: csv/fix.csv}}, {speed}}}")
    other = answer(f"{{fix: {own}, {speed}}}", "--set", "measurements.fix.columns=[east_cm, north_km]")
    assert close(plain, other, rel=1e-6)


def test_start_and_stop_cut_by_time(answer: Callable[..., Any]) -> None:
    done = answer(
        "{fix: {file: csv/fix.csv, start: 2 s, stop: 6 s}, speed: {file: csv/speed.csv, start: 2 s, stop: 6 s}}"
    )
    assert done["time"] == 6.0
    assert done["measurements"]["fix"]["fused"] == 8
    assert done["provenance"]["record"]["files"]["fix"]["rows_used"] == 8


def test_a_stream_may_come_from_an_aiding_source(answer: Callable[..., Any]) -> None:
    both = answer("{fix: {file: csv/fix.csv}, speed: {file: csv/speed.csv}}")
    aided = answer(
        "{fix: {file: csv/fix.csv}}", "--set", "aiding.radar={kind: log, streams: {speed: {file: npz/speed.npz}}}"
    )
    assert close(both, aided)


def test_a_stream_that_no_measurement_reads_is_told(answer: Callable[..., Any]) -> None:
    done = answer("{fix: {file: csv/fix.csv}, speed: {file: csv/speed.csv}, spare: {file: nothing.csv}}")
    assert [(e["source"], e["kind"]) for e in done["events"]] == [("spare", "unused")]
