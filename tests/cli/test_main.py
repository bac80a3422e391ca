"""The command line: quick to start, faults as exit codes, errors for people and for machines."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import click
import pytest

from estimfw import __version__
from estimfw.cli.main import COMMANDS, cli, main
from estimfw.errors import (
    ConfigError,
    DataError,
    EstimfwError,
    Location,
    NumericalError,
    PluginError,
    SweepError,
    UsageError,
)


def raising(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make the command ``check`` raise."""

    @click.command("check")
    @click.option("--json", "as_json", is_flag=True)
    def command(as_json: bool) -> None:
        raise error

    monkeypatch.setattr(cli, "get_command", lambda ctx, name: command if name == "check" else None)


def test_help_imports_neither_numpy_nor_pydantic() -> None:
    program = (
        "import sys; from estimfw.cli.main import main; code = main(['--help']); "
        "heavy = {'numpy', 'pydantic', 'scipy', 'xarray', 'pandas', 'numba', 'rich', 'ruamel'} & set(sys.modules); "
        "sys.exit(f'{code} {heavy}' if code or heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name in COMMANDS:
        assert name in done.stdout


def test_every_command_of_the_table_exists_under_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    for name in COMMANDS:
        assert main([name, "--help"]) == 0
        assert f"Usage: estimfw {name}" in capsys.readouterr().out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert __version__ in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code"),
    [(UsageError("x"), 2), (ConfigError("x"), 3), (PluginError("x"), 4), (DataError("x"), 5), (NumericalError("x"), 6),
     (SweepError("x"), 7), (KeyboardInterrupt(), 130), (click.Abort(), 130), (RuntimeError("x"), 1), (click.FileError("x"), 2)],
)  # fmt: skip
def test_every_kind_of_fault_has_its_exit_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, error)
    assert main(["check"]) == code
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err
    assert "Traceback" not in told.err


def test_an_error_says_where_what_and_what_to_do_on_stderr(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, ConfigError("odd [red]key[/]", location=Location("a.yaml", 3, 4), hint="did you mean 'even'?"))
    assert main(["check"]) == 3
    assert capsys.readouterr().err == "error: a.yaml:3:4: odd [red]key[/]\n  did you mean 'even'?\n"


def test_json_puts_the_same_facts_on_stdout_and_the_text_stays_on_stderr(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, ConfigError("odd", location=Location("a.yaml", 3, 4), hint="even"))
    assert main(["check", "--json"]) == 3
    told = capsys.readouterr()
    assert json.loads(told.out) == {
        "error": {
            "kind": "config",
            "exit_code": 3,
            "message": "odd",
            "file": "a.yaml",
            "line": 3,
            "column": 4,
            "hint": "even",
        }
    }
    assert told.err == "error: a.yaml:3:4: odd\n  even\n"


def test_our_own_bug_is_owned_and_shows_its_traceback_only_under_debug(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, ZeroDivisionError("oops"))
    assert main(["check"]) == 1
    told = capsys.readouterr().err
    assert "our bug" in told
    assert "--debug" in told
    assert "Traceback" not in told
    assert main(["check", "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err
    assert main(["check", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["error"]["kind"] == "bug"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [(["chekc"], "did you mean 'check'"), (["plugins", "lst"], "list"), (["--nonsense"], "nonsense"),
     (["plugins", "show"], "NAME"), (["plugins", "show", "kalmann"], "valid:"),
     (["schema", "--nonsense"], "estimfw schema --help")],
)  # fmt: skip
def test_a_wrong_command_line_exits_with_2_and_says_what_is_right(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert says in capsys.readouterr().err


def test_a_reader_that_goes_away_leaves_no_traceback() -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "estimfw.cli.main", "plugins", "list", "--json"],
        stdout=write,
        stderr=subprocess.PIPE,
        check=False,
    )
    os.close(write)
    assert done.stderr == b""


def test_a_command_that_returns_a_number_exits_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    @click.command("check")
    def command() -> int:
        return 7

    monkeypatch.setattr(cli, "get_command", lambda ctx, name: command)
    assert main(["check"]) == 7


def test_the_default_arguments_are_those_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["estimfw", "--version"])
    assert main() == 0


def test_errors_are_all_of_one_family() -> None:
    assert {e.exit_code for e in EstimfwError.__subclasses__()} == {2, 3, 4, 5, 6, 7, 8}


def test_the_schema_is_written_found_fresh_and_found_stale(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--write", str(tmp_path)]) == 0
    assert main(["schema", "--check", str(tmp_path)]) == 0
    capsys.readouterr()
    assert main(["schema"]) == 0
    assert (tmp_path / "filter.schema.json").read_text(encoding="utf-8") == capsys.readouterr().out
    (tmp_path / "filter.schema.json").write_text("{}", encoding="utf-8")
    assert main(["schema", "--check", str(tmp_path)]) == 3
    assert "estimfw schema --write" in capsys.readouterr().err
    assert main(["schema", "--check", str(tmp_path / "none")]) == 3


def test_plugins_are_listed_and_shown_for_people_and_machines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plugins", "list"]) == 0
    assert "loaded" in capsys.readouterr().out
    assert main(["plugins", "list", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["plugins"][0]["name"] == "estimfw"
    assert main(["plugins", "show", "estimfw"]) == 0
    assert "kalman" in capsys.readouterr().out
    assert main(["plugins", "show", "estimfw", "--json"]) == 0
    (shown,) = json.loads(capsys.readouterr().out)["plugins"]
    estimators = {one["kind"] for one in shown["components"] if one["role"] == "estimator"}
    assert estimators == {"kalman", "decentralised", "unscented", "bank", "determination"}
