"""From Python: a config to a result in two calls, the same as on the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import estimfw
from estimfw.cli.main import main

STATIC = Path(__file__).parents[2] / "examples" / "static_7.yaml"
SHORT = ["source.duration=30 s"]


def test_run_from_python_is_the_run_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    result = estimfw.run_filter(estimfw.open_filter(STATIC, SHORT))
    assert main(["run", str(STATIC), "--json", "--set", SHORT[0]]) == 0
    answer = json.loads(capsys.readouterr().out)
    for label, state in answer["states"].items():
        assert float(result["estimate"].sel(state=label)[-1]) == state["value"]
        assert float(result["sigma"].sel(state=label)[-1]) == state["sigma"]


def test_run_twice_is_equal_bit_for_bit() -> None:
    first, second = (estimfw.run_filter(estimfw.open_filter(STATIC, SHORT)) for _ in range(2))
    assert first.identical(second)


def test_seed_changes_the_run() -> None:
    one, two = (estimfw.run_filter(estimfw.open_filter(STATIC, [*SHORT, f"source.seed={s}"])) for s in (1, 2))
    assert not np.array_equal(one["estimate"], two["estimate"])


def test_progress_ends_with_all_steps() -> None:
    seen: list[tuple[int, int]] = []
    estimfw.run_filter(estimfw.open_filter(STATIC, SHORT), progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (30, 30)


def test_import_of_the_package_is_light() -> None:
    code = "import sys, estimfw; print(sorted({'numpy', 'pydantic', 'xarray'} & set(sys.modules)))"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'run_fitler'"):
        estimfw.run_fitler  # noqa: B018
