"""``estimfw discretise``: how right the process noise of a step is by each formula."""

from __future__ import annotations

import json
import math
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, console, open_problem, say
from estimfw.cli.page_option import refuse_page
from estimfw.errors import ConfigError, UsageError

__all__ = ["command"]


@click.command("discretise")
@config_arguments
@click.option(
    "--steps",
    default="1 s, 10 s, 60 s, 300 s",
    show_default=True,
    metavar="LIST",
    help="Lengths of a step, with units, separated by commas.",
)
@click.option(
    "--at", metavar="TIME", help="At this instant of the record, such as '600 s' (default: the reference nominal)."
)
@click.option(
    "--record/--no-record",
    default=True,
    help="Run the filter with each formula too (default: where there is a source).",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE.html", help="Write a page with a chart.")
@click.option("--force", is_flag=True, help="Replace a page that is there.")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, steps: str, at: str | None, record: bool, output: Path | None,
    force: bool,
) -> None:  # fmt: skip
    """Hold the formulas for the process noise Q of a step against the exact integral, for the dynamics of CONFIG.

    Truncated series, noise held over the step, and Van Loan: the error of each at several steps, the order with which it falls,
    whether Q is a covariance at all, and what the choice does to the filter's sigmas.
    """
    from estimfw.cli.progress import progress
    from estimfw.run.discretisation import study_filter
    from estimfw.run.files import write_text

    lengths = _lengths(steps)
    instant = None if at is None else _seconds(at, "--at", positive=False)
    refuse_page(output, force=force)
    problem = open_problem(config, overrides)
    with progress(as_json) as shown:
        found = study_filter(problem, lengths, at=instant, record=record, progress=shown)
    if as_json:
        from estimfw.report.discretisation_tables import study_json

        click.echo(json.dumps(study_json(found), allow_nan=False))
    else:
        from estimfw.report.discretisation_text import print_study

        print_study(found, console())
    if output is not None:
        from estimfw.report.discretisation_page import study_page

        say(f"wrote {write_text(output, study_page(found), force=force)}")


def _lengths(text: str) -> list[float]:
    """In s, in the order given; UsageError for one that is given twice, maybe in another unit."""
    parts = text.split(",")
    found = [_seconds(one, "--steps", positive=True) for one in parts]
    for i, one in enumerate(found):
        for j in range(i):
            if math.isclose(one, found[j], rel_tol=1e-9):
                raise UsageError(
                    f"--steps: {parts[j].strip()!r} and {parts[i].strip()!r} are the same step",
                    hint="give each step once",
                )
    return found


def _seconds(text: str, option: str, *, positive: bool) -> float:
    from estimfw.units import parse_quantity

    try:
        found = parse_quantity(text.strip())
    except ConfigError as error:
        raise UsageError(f"{option}: {error.message}", hint=f"such as {option} '10 s'") from error
    if found.unit.si_text != "s":
        raise UsageError(f"{option}: {text.strip()!r} is no time", hint=f"such as {option} '10 s'")
    if positive and not (found.value > 0.0 and math.isfinite(found.value)):
        raise UsageError(f"{option}: a step of {text.strip()!r} is none", hint=f"such as {option} '1 s, 10 s'")
    return found.value
