"""The page about smoothing does what it says."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from estimfw.cli.main import main

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "smoother.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (found,) = re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    return str(found)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(ROOT / "examples" / "tracker.yaml", tmp_path)
    (tmp_path / "smoothed.yaml").write_text(block("yaml"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_config_runs_and_has_the_variables(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import xarray as xr

    assert main(["run", "smoothed.yaml", "--set", "source.duration=20 s", "--output", "out", "--no-report"]) == 0
    assert "smoothed σ" in capsys.readouterr().out
    with xr.open_dataset(folder / "out" / "result.nc", engine="h5netcdf") as result:
        told = [
            name for row in re.findall(r"^\| `.*?\|", PAGE, flags=re.MULTILINE) for name in re.findall(r"`(\w+)`", row)
        ]
        assert len(told) == 7
        assert {name for name in told if "output" not in name} <= set(result.variables)  # a tracker has no outputs


def test_the_session_prints_what_the_page_shows(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(block("python"), "docs/smoother.md", "exec"), {})
    assert capsys.readouterr().out == block("text")
