"""The command line: commands are imported when they are called, faults become exit codes."""

from __future__ import annotations

import json
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import FrameType

import click

from estimfw import __version__
from estimfw.errors import CheckError, EstimfwError, UsageError

__all__ = ["COMMANDS", "INTERRUPTED", "cli", "main"]

INTERRUPTED = 130

#: What click from 8.2 on raises where a group is called without a command.
NO_COMMAND: type[click.UsageError] | tuple[()] = getattr(click.exceptions, "NoArgsIsHelpError", ())

#: Each command: the module that has it as ``command``, and its line in the help.
COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("estimfw.cli.run", "Run a config; write the result and a report."),
    "check": ("estimfw.cli.check", "Check a config without running it."),
    "explain": ("estimfw.cli.explain", "Show model, policies, equivalence and plan of a config."),
    "compare": ("estimfw.cli.compare", "Price list of filters: cost, time, errors and sigmas on one record."),
    "budget": ("estimfw.cli.budget", "Tell what the errors of a config's filter come from."),
    "montecarlo": ("estimfw.cli.montecarlo", "Run a config many times; judge its errors and innovations."),
    "observe": ("estimfw.cli.observe", "Tell what the measurements of a config can determine."),
    "discretise": ("estimfw.cli.discretise", "Hold formulas for the process noise of a step against the exact one."),
    "partition": ("estimfw.cli.partition", "Cut the states of a config into the nodes of a decentralised filter."),
    "cost": ("estimfw.cli.cost", "Count the work of a step in each form; tell where several processors pay."),
    "simulate": ("estimfw.cli.simulate", "Write the record that a config's source simulates."),
    "trial": ("estimfw.cli.trial", "Run several filters over the same draws; judge claims about them."),
    "claims": ("estimfw.cli.claims", "Judge claims about sigmas and errors by a run of each filter; make the page."),
    "schema": ("estimfw.cli.schema", "Print or write the JSON Schema of configs."),
    "plugins": ("estimfw.cli.plugins", "List plugins and their components."),
}


class LazyGroup(click.Group):
    """A group that knows its commands by name and imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        found = import_module(COMMANDS[cmd_name][0]).command
        assert isinstance(found, click.Command)
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0] if args else ""
        if name and not name.startswith("-") and name not in COMMANDS:
            from estimfw.spelling import did_you_mean

            raise UsageError(f"no command {name!r}", hint=did_you_mean(name, COMMANDS))
        return super().resolve_command(ctx, args)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="estimfw")
@click.option("--debug", is_flag=True, help="Show the traceback of an error (may stand anywhere).")
def cli(debug: bool) -> None:
    """Kalman estimation in which a filter is data: configs in, results and reports out."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of ``sys.argv[1:]``.

    Returns
    -------
    int
        The exit code: 0 ok, 1 our bug, 2 usage, 3 config, 4 plugin, 5 data, 6 numerical, 7 sweep, 8 check, 130 interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug, as_json = "--debug" in given, "--json" in given
    try:
        with _terminated_as_interrupted():
            result = cli.main([a for a in given if a != "--debug"], prog_name="estimfw", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except CheckError as error:  # it comes after the answer: standard output has its JSON already
        return _report(error, as_json=False, debug=debug)
    except EstimfwError as error:
        return _report(error, as_json=as_json, debug=debug)
    except NO_COMMAND as error:
        click.echo(error.format_message(), err=True)
        return UsageError.exit_code
    except click.UsageError as error:
        return _report(_usage_error(error), as_json=as_json, debug=debug)
    except click.ClickException as error:
        return _report(UsageError(error.format_message()), as_json=as_json, debug=debug)
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except Exception as error:
        return _report_bug(error, as_json=as_json, debug=debug)


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """SIGTERM ends the program as Ctrl-C does: what was half written is taken away, locks are released."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _usage_error(error: click.UsageError) -> UsageError:
    command = error.ctx.command_path if error.ctx else "estimfw"
    return UsageError(error.format_message(), hint=f"see '{command} --help'")


def _report(error: EstimfwError, *, as_json: bool, debug: bool) -> int:
    from estimfw.cli.excerpt import excerpt

    place = f"{error.location}: " if error.location else ""
    hint = f"  {error.hint}" if error.hint else ""
    told = f"error: {place}{error.message}\n{excerpt(error.location)}{hint}".rstrip("\n")
    _print(error.as_json(), told, as_json=as_json, debug=debug)
    return error.exit_code


def _report_bug(error: Exception, *, as_json: bool, debug: bool) -> int:
    text = f"{type(error).__name__}: {error}"
    told = f"this is our bug, not yours: {text}\n  run again with --debug and send us what it prints"
    _print({"kind": "bug", "exit_code": 1, "message": text}, told, as_json=as_json, debug=debug)
    return 1


def _print(facts: dict[str, object], text: str, *, as_json: bool, debug: bool) -> None:
    """The error, for a person on stderr, and for a machine on stdout where it asked for JSON."""
    if debug:
        import traceback

        traceback.print_exc()
    if as_json:
        click.echo(json.dumps({"error": facts}))
    from rich.console import Console

    Console(stderr=True, soft_wrap=True).print(text, style="red", markup=False, highlight=False, emoji=False)


if __name__ == "__main__":
    sys.exit(main())
