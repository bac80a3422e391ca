"""From the words on the command line to a composed problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from rich.console import Console

    from estimfw.config.compose import Problem

__all__ = ["config_arguments", "console", "open_problem", "say", "say_undetermined"]

F = TypeVar("F", bound=Callable[..., Any])


def config_arguments(command: F) -> F:
    """CONFIG, ``--set`` and ``--json``, the same for every command."""
    for decorate in (
        click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON on standard output."),
        click.option(
            "--set", "overrides", multiple=True, metavar="PATH=VALUE", help="Override a value: --set a.b[0]=1."
        ),
        click.argument("config", type=click.Path(path_type=Path)),
    ):
        command = decorate(command)
    return command


def open_problem(config: Path, overrides: Sequence[str]) -> Problem:
    """Load the config and the plugins, and compose; warnings go to standard error."""
    from estimfw.run.from_python import open_filter

    problem = open_filter(config, overrides)
    for warning in problem.warnings:
        say(f"warning: {warning}", style="yellow")
    return problem


def console() -> Console:
    """For tables on standard output: as wide as the terminal, and wide enough for them in a file or a pipe."""
    from rich.console import Console

    made = Console()
    return made if made.is_terminal else Console(width=140)


def say(text: str, style: str = "") -> None:
    """For people, on standard error."""
    from rich.console import Console
    from rich.text import Text

    Console(stderr=True).print(Text(text, style=style), soft_wrap=True)


def say_undetermined(problem: Problem, *, listed: bool = False) -> None:
    """Combinations of states that the measurements do not determine: a sentence, or a warning with the list of them."""
    count = len(problem.undetermined)
    if not count:
        return
    many, keep = (
        ("combinations of states are", "keep their") if count > 1 else ("combination of states is", "keeps its")
    )
    told = f"{count} {many} not determined by the measurements and {keep} prior uncertainty"
    if listed:
        say("\n  ".join([f"warning: {told}, here with what goes together:", *problem.undetermined]), style="yellow")
        return
    them = "them" if count > 1 else "it"
    say(f"{told} (usual for a vehicle that stands or moves evenly); estimfw check lists {them}", style="dim")
