"""``estimfw observe``: what the measurements can determine."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, open_problem, say
from estimfw.cli.page_option import refuse_page

__all__ = ["command"]


@click.command("observe")
@config_arguments
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE.html", help="Write a page with heat maps."
)
@click.option("--force", is_flag=True, help="Replace a page that is there.")
@click.option(
    "--protect",
    multiple=True,
    metavar="NAME",
    help="A state or block that shall not be removed (default: what corrects the nominal, what outputs read; 'none': nothing).",
)
@click.option(
    "--segments",
    type=click.IntRange(1, 1000),
    default=10,
    show_default=True,
    help="Pieces that the record is cut into.",
)
@click.option(
    "--record/--no-record",
    default=True,
    help="Also along the record (default: where there is a source, and no stages).",
)
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, output: Path | None, force: bool, protect: tuple[str, ...],
    segments: int, record: bool,
) -> None:  # fmt: skip
    """Tell what the measurements of CONFIG can determine, what not, and what could be removed.

    At the frozen reference nominal: rank, directions that are not observable, every minimal set of states whose removal leaves
    an observable rest, and which set goes. Along the record that the source gives: piecewise-constant rank, Gramian, and what
    is left of the prior sigma of each state with time.
    """
    from estimfw.cli.progress import progress
    from estimfw.run.files import write_text
    from estimfw.run.observe import observe

    refuse_page(output, force=force)
    problem = open_problem(config, overrides)
    guarded = None if not protect else () if protect == ("none",) else protect
    with progress(as_json) as shown:
        found = observe(problem, protect=guarded, segments=segments, record=record, progress=shown)
    if as_json:
        from estimfw.report.observed_json import observed_json

        click.echo(json.dumps(observed_json(found), allow_nan=False))
    else:
        from estimfw.cli.opening import console
        from estimfw.report.observed_text import print_observed

        print_observed(found, console())
    if found.record is None:
        say(f"{found.record_left_out}: only the frozen analysis, nothing along a record", style="dim")
    if output is not None:
        from estimfw.report.observed_page import observed_page

        say(f"wrote {write_text(output, observed_page(found), force=force)}")
