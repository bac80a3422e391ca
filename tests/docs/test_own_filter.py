"""The worked page for a filter of one's own does what it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import estimfw
from estimfw.cli.main import main

PAGE = (Path(__file__).parents[2] / "docs" / "own_filter.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The reader's folder, with tanks.yaml in it."""
    (tmp_path / "tanks.yaml").write_text(blocks("yaml")[0])
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_logs(folder: Path, second: str, clock: float, length: float) -> None:
    """The simulated readings as CSV; the second gauge with its own clock and unit."""
    from estimfw.run.load import load_record

    streams = load_record(estimfw.open_filter("tanks.yaml")).streams
    for file, stream, header, t, x in (
        ("first.csv", streams["first_gauge"], "time,first", 1.0, 1.0),
        ("second.csv", streams["second_gauge"], second, clock, length),
    ):
        rows = zip(stream.time * t, stream.values[:, 0] * x, strict=True)
        (folder / file).write_text(
            "\n".join([header, *(f"{a!r},{b!r}" for a, b in (map(float, r) for r in rows))]) + "\n"
        )


def end(folder: str) -> xr.Dataset:
    return xr.load_dataset(Path(folder) / "result.nc", engine="h5netcdf").isel(time=-1)


def test_simulated_run_is_consistent(folder: Path) -> None:
    assert main(["run", "tanks.yaml", "-o", "results/tanks", "--no-report"]) == 0
    result = end("results/tanks")
    assert list(result["state"].to_numpy()) == ["level[first]", "level[second]", "gauge_error"]
    assert np.all(np.abs(result["error"]) < 4.0 * result["sigma"])


def test_many_runs_are_consistent(folder: Path) -> None:
    assert main(["montecarlo", "tanks.yaml", "--runs", "100", "--workers", "1", "--check", "--no-report"]) == 0
    assert (folder / "results/tanks/montecarlo.nc").is_file()


def test_own_log_with_another_clock_and_unit_gives_what_the_simulation_did(folder: Path) -> None:
    write_logs(folder, "clock,second", 1000.0, 100.0)
    logged = blocks("yaml")[1]
    text = blocks("yaml")[0]
    (folder / "mine.yaml").write_text(text[: text.index("\nsource:") + 1] + logged[logged.index("source:") :])
    assert main(["run", "tanks.yaml", "-o", "results/tanks", "--no-report"]) == 0
    assert main(["run", "mine.yaml", "-o", "results/mine", "--no-report"]) == 0
    simulated, own = end("results/tanks"), end("results/mine")
    # The log says nothing of the instant 0 s, at which the simulation starts: it begins a reading later.
    assert np.allclose(own["estimate"], simulated["estimate"], rtol=0, atol=0.05 * simulated["sigma"].to_numpy())


def test_log_from_the_command_line(folder: Path) -> None:
    write_logs(folder, "time,second", 1.0, 1.0)
    (command,) = re.findall(r"^    estimfw (run tanks.yaml -o results/mine) --set '(.*)'$", PAGE, flags=re.MULTILINE)
    assert main([*command[0].split(), "--no-report", "--set", command[1]]) == 0


def test_gauge_error_can_be_dropped(folder: Path) -> None:
    with (folder / "tanks.yaml").open("a") as file:
        file.write(blocks("yaml")[2])
    problem = estimfw.open_filter("tanks.yaml")
    assert problem.model.states == ("level[first]", "level[second]")
    assert problem.changes[0].kind == "approximate"


def test_session_prints_level_and_sigma(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks("python")[0], "own_filter.md", "exec"), {})
    assert re.fullmatch(r"0\.8\d\d m, sigma 0\.0\d\d m, \{'first_gauge': 'fused'.*\}\n", capsys.readouterr().out)
