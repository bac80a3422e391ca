"""The result of a Monte Carlo: not of who computed it, in what order, or how often it was begun."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.cli.main import main
from estimfw.errors import ConfigError, DataError, UsageError
from estimfw.montecarlo.campaign import Workers, chunk_of, run_campaign
from estimfw.montecarlo.dataset import campaign_dataset
from estimfw.montecarlo.parts_on_disk import PartFolder
from estimfw.montecarlo.result_file import read_campaign, write_campaign

ROOT = Path(__file__).resolve().parents[2]
SHORT = ("source.duration=20 s", "estimator.covariance_samples=10")


def content(problem: Any, path: Path, **more: Any) -> bytes:
    """The bytes of the result file."""
    write_campaign(campaign_dataset(run_campaign(problem, 3, 40, **more)), path)
    return path.read_bytes()


def test_the_file_does_not_depend_on_the_number_of_workers(example: Callable[..., Any], tmp_path: Path) -> None:
    problem = example("static_7", *SHORT)
    one, two = (content(problem, tmp_path / f"{n}.nc", workers=Workers(n)) for n in (1, 2))
    assert one == two


def test_the_runs_do_not_depend_on_the_chunks(example: Callable[..., Any]) -> None:
    problem = example("static_7", *SHORT)
    few, many = (campaign_dataset(run_campaign(problem, 3, 40, chunk=size)) for size in (40, 7))
    np.testing.assert_array_equal(few["end_error"], many["end_error"])
    np.testing.assert_array_equal(few["run_nis"], many["run_nis"])
    np.testing.assert_allclose(few["rms"], many["rms"], rtol=1e-12)


def test_fewer_runs_of_a_seed_are_the_first_of_more(example: Callable[..., Any]) -> None:
    problem = example("tracker", *SHORT, "estimator.kernel=numba")
    few, many = (campaign_dataset(run_campaign(problem, 3, runs)) for runs in (5, 20))
    np.testing.assert_array_equal(few["end_error"], many["end_error"][:5])
    assert len(np.unique(many["end_error"].to_numpy())) == many["end_error"].size


def test_a_chunk_holds_less_of_longer_runs_and_there_are_enough_of_them() -> None:
    assert chunk_of(10_000, 600) == 128
    assert chunk_of(200, 600) == 13
    assert chunk_of(10_000, 100_000) == 2
    assert chunk_of(3, 10**9) == 1


def test_a_file_is_read_as_it_was_written(example: Callable[..., Any], tmp_path: Path) -> None:
    dataset = campaign_dataset(run_campaign(example("tracker", *SHORT), 3, 4))
    read = read_campaign(write_campaign(dataset, tmp_path / "mc.nc"))
    np.testing.assert_array_equal(read["nees"], dataset["nees"])
    with pytest.raises(DataError, match="exists"):
        write_campaign(dataset, tmp_path / "mc.nc")


def test_parts_on_disk_are_used_and_damaged_ones_are_not(example: Callable[..., Any], tmp_path: Path) -> None:
    problem = example("tracker", *SHORT)
    whole = content(problem, tmp_path / "whole.nc", folder=tmp_path / "chunks")
    paths = sorted((tmp_path / "chunks").glob("*.npz"))
    assert len(paths) == 14
    paths[0].write_bytes(paths[0].read_bytes()[:100])
    paths[5].unlink()
    seen: list[int] = []
    again = content(
        problem, tmp_path / "again.nc", folder=tmp_path / "chunks", progress=lambda done, total: seen.append(done)
    )
    assert seen == [34, 37, 40]
    assert again == whole


@pytest.mark.parametrize(
    ("seed", "runs", "overrides", "what"),
    [(4, 40, (), "other seed"), (3, 41, (), "number of runs"), (3, 40, ("blocks.velocity.sigma=6 m/s",), "config")],
)
def test_parts_of_another_monte_carlo_are_refused(
    example: Callable[..., Any], tmp_path: Path, seed: int, runs: int, overrides: tuple[str, ...], what: str
) -> None:
    run_campaign(example("tracker", *SHORT), 3, 40, folder=tmp_path / "chunks")
    other = example("tracker", *SHORT, *overrides)
    with pytest.raises(DataError, match=what):
        run_campaign(other, seed, runs, folder=tmp_path / "chunks")
    run_campaign(other, seed, runs, folder=tmp_path / "chunks", force=True)


def test_a_source_that_draws_nothing_is_named(example: Callable[..., Any], tmp_path: Path) -> None:
    logged = example("tracker", "source={kind: log, streams: {fix: {file: fix.csv}, speed: {file: speed.csv}}}")
    with pytest.raises(ConfigError, match="source log draws nothing") as caught:
        run_campaign(logged, 1, 10)
    assert caught.value.location is not None
    with pytest.raises(UsageError, match="two runs"):
        run_campaign(example("tracker", *SHORT), 1, 1)


def test_dask_that_is_not_installed_is_told(example: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match="--dask needs") as caught:
        run_campaign(example("tracker", *SHORT), 1, 10, workers=Workers(1, "tcp://127.0.0.1:1"))
    assert caught.value.hint is not None and "estimfw[dask]" in caught.value.hint


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
def test_killed_half_way_and_resumed_it_gives_the_same_file(tmp_path: Path) -> None:
    words = [
        sys.executable, "-m", "estimfw.cli.main", "montecarlo", str(ROOT / "examples" / "static_7.yaml"), "--runs", "400",
        "--workers", "2", "--seed", "8", "--no-report", "--chunk", "10", "--set", "source.duration=120 s", "-o",
    ]  # fmt: skip
    killed, whole = tmp_path / "killed.nc", tmp_path / "whole.nc"
    chunks = tmp_path / "killed.nc.chunks"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([*words, str(killed)], start_new_session=True, **quiet) as process:  # type: ignore[call-overload]
        until = time.monotonic() + 60.0
        while len(list(chunks.glob("*.npz"))) < 5 and time.monotonic() < until:
            time.sleep(0.005)
        os.killpg(process.pid, signal.SIGKILL)
    found = len(list(chunks.glob("*.npz")))
    assert 5 <= found < 40
    assert not killed.exists()
    subprocess.run([*words, str(killed)], check=True, **quiet)  # type: ignore[call-overload]
    assert main([*words[3:], str(whole), "--workers", "1"]) == 0
    assert killed.read_bytes() == whole.read_bytes()
    assert not chunks.exists()


def test_parts_know_nothing_of_a_folder_that_was_never_made(tmp_path: Path) -> None:
    assert PartFolder(tmp_path / "none").read(0) is None
