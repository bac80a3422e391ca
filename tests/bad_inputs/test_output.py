"""Runs that are interrupted, full disks, outputs that are there (56, 57, 58, 60): nothing written before is lost or damaged."""

from __future__ import annotations

import functools
import hashlib
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from estimfw.run.files import output_folder

Check = Callable[..., Any]
Tracker = Callable[..., str]


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir() if p.is_file()}


@pytest.fixture
def result(check: Check, tracker: Tracker, folder: Path) -> Path:
    """A result that is there."""
    assert check(tracker(), "-o", "out", "--no-report", command="run").code == 0
    assert {"result.nc", "summary.json"} <= set(digests(folder / "out"))
    return folder / "out"


LONG = ("duration: 10 s", "duration: 20000 s")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["56-ctrl-c", "56-sigterm"])
def test_56_an_interrupted_run_exits_with_130_and_leaves_the_old_result_whole(
    tracker: Tracker, result: Path, number: signal.Signals
) -> None:
    before = digests(result)
    (result.parent / "long.yaml").write_text(tracker(*LONG))
    command = [sys.executable, "-m", "estimfw.cli.main", "run", "long.yaml", "-o", "out", "--no-report", "--force"]
    heard = functools.partial(
        signal.signal, number, signal.SIG_DFL
    )  # a shell in the background hands SIGINT on as ignored
    with subprocess.Popen(command, cwd=result.parent, stderr=subprocess.PIPE, text=True, preexec_fn=heard) as process:
        deadline = time.monotonic() + 60.0
        while not (result / ".estimfw.lock").exists():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        time.sleep(0.2)
        process.send_signal(number)
        _, told = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert told.strip() == "interrupted"
    assert digests(result) == before


def test_57_a_full_disk_leaves_the_old_result_whole(tracker: Tracker, result: Path) -> None:
    """The operating system itself refuses to let the file grow (works for root too)."""
    before = digests(result)
    (result.parent / "longer.yaml").write_text(tracker("duration: 10 s", "duration: 300 s"))
    program = """
        import resource, sys
        from estimfw.cli.main import main
        resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))
        sys.exit(main(["run", "longer.yaml", "-o", "out", "--no-report", "--force"]))
        """
    command = [sys.executable, "-c", textwrap.dedent(program)]
    done = subprocess.run(command, cwd=result.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 5, done.stderr
    assert "error: out/result.nc: cannot write: File too large" in done.stderr
    assert "what was there before is unchanged" in done.stderr
    assert "Traceback" not in done.stderr
    assert digests(result) == before


@pytest.mark.skipif(not Path("/proc/version").exists(), reason="needs a folder that nobody can write, such as /proc")
def test_57_a_read_only_output_is_refused_before_the_run(check: Check, tracker: Tracker) -> None:
    told = check(tracker(*LONG), "-o", "/proc/result", command="run")
    assert told.code == 5
    told.says("error: /proc/result: cannot write: ")


def test_57_a_file_in_place_of_the_folder_is_refused(check: Check, tracker: Tracker, folder: Path) -> None:
    (folder / "out").write_text("precious")
    told = check(tracker(), "-o", "out", command="run")
    assert told.code == 5
    told.says("out: cannot write: ")
    assert (folder / "out").read_text() == "precious"


def test_58_an_output_that_exists_is_refused_before_the_run(check: Check, tracker: Tracker, result: Path) -> None:
    before = digests(result)
    begin = time.monotonic()
    told = check(tracker(*LONG), "-o", "out", command="run")
    assert time.monotonic() - begin < 5.0
    assert told.code == 5
    told.says("error: out/result.nc: the file exists and is not overwritten", "use --force to replace it")
    assert digests(result) == before
    assert check(tracker("seed: 7", "seed: 8"), "-o", "out", "--no-report", "--force", command="run").code == 0
    assert digests(result)["result.nc"] != before["result.nc"]


def test_58_simulated_logs_are_not_overwritten_either(check: Check, tracker: Tracker, folder: Path) -> None:
    assert check(tracker(), "-o", "log", command="simulate").code == 0
    before = digests(folder / "log")
    told = check(tracker("seed: 7", "seed: 8"), "-o", "log", command="simulate")
    assert told.code == 5
    told.says("log/fix.npz: the file exists and is not overwritten")
    assert digests(folder / "log") == before


def test_60_a_second_writer_is_refused(check: Check, tracker: Tracker, folder: Path) -> None:
    with output_folder(folder / "out"):
        told = check(tracker(), "-o", "out", "--no-report", "--force", command="run")
    assert told.code == 5
    told.says("error: out: another run is writing into this folder", "name another output folder")
    assert check(tracker(), "-o", "out", "--no-report", command="run").code == 0
    assert (folder / "out" / "result.nc").exists()
