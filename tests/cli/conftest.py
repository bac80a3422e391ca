"""Short runs of the examples, as somebody at a terminal makes them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from estimfw.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
SHORT = ("--set", "source.duration=20 s")


@dataclass(frozen=True)
class Told:
    """Exit code, and what went to standard output and to standard error."""

    code: int
    out: str
    err: str


@pytest.fixture
def estimfw(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., Told]:
    """The command line with ``example`` for the path of an example, in an empty working directory."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, width: int = 120) -> Told:
        monkeypatch.setenv("COLUMNS", str(width))
        code = main([str(ROOT / one) if one.startswith("examples/") else one for one in arguments])
        told = capsys.readouterr()
        return Told(code, told.out, told.err)

    return run


@pytest.fixture
def at_a_terminal(tmp_path: Path) -> Callable[..., Told]:
    """The same in a process of its own whose standard error is a terminal; standard output is a pipe."""
    pty = pytest.importorskip("pty")

    def run(*arguments: str) -> Told:
        ours, theirs = pty.openpty()
        words = [str(ROOT / one) if one.startswith("examples/") else one for one in arguments]
        program = [sys.executable, "-m", "estimfw.cli.main", *words]
        environment = {**os.environ, "TERM": "xterm", "COLUMNS": "80"}
        with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=theirs, cwd=tmp_path, env=environment) as process:
            os.close(theirs)
            seen = b""
            while chunk := _read(ours):
                seen += chunk
            out = process.stdout.read() if process.stdout else b""
        os.close(ours)
        return Told(process.returncode, out.decode(), seen.decode())

    return run


def _read(terminal: int) -> bytes:
    """What there is; a terminal that was closed at the other side raises on Linux."""
    try:
        return os.read(terminal, 4096)
    except OSError:
        return b""
