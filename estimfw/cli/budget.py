"""``estimfw budget``: what the errors of a filter come from."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, console, open_problem, say
from estimfw.cli.page_option import refuse_page

__all__ = ["command"]


@click.command("budget")
@config_arguments
@click.option(
    "--truth",
    type=click.Path(path_type=Path),
    metavar="FULL",
    help="A config whose model, before its policies, is the truth (default: the own unreduced model); --set is not for it.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE.html",
    help="Write a page, and a picture beside it.",
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, truth: Path | None, output: Path | None, force: bool
) -> None:
    """Tell what the errors of the filter CONFIG come from, along its record.

    Initial errors, each noise, and each removed or mismodelled state: the contribution of each to the sigma of every output, on
    the unreduced model with the structure that the mechanization runs. The squares add up.
    """
    from estimfw.cli.progress import progress
    from estimfw.run.budget import error_budget

    refuse_page(output, force=force)
    problem = open_problem(config, overrides)
    real = open_problem(truth, ()) if truth is not None else None
    with progress(as_json) as shown:
        budget = error_budget(problem, real, shown)
    if as_json:
        from estimfw.report.budget_tables import budget_json

        click.echo(json.dumps(budget_json(budget), allow_nan=False))
    else:
        from estimfw.report.budget_text import print_budget

        print_budget(budget, console())
    if output is not None:
        from estimfw.report.budget_page import write_budget

        say(f"wrote {', '.join(str(path) for path in write_budget(budget, output, force=force))}")
