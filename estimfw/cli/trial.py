"""``estimfw trial``: several filters over many runs with the same draws."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from estimfw.cli.opening import console, say
from estimfw.cli.page_option import refuse_page
from estimfw.errors import CheckError, UsageError

if TYPE_CHECKING:
    from estimfw.montecarlo.claims import Verdict
    from estimfw.montecarlo.trial import Trial
    from estimfw.report.tables import Table

__all__ = ["command"]


@click.command("trial")
@click.argument("configs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--set", "overrides", multiple=True, metavar="PATH=VALUE", help="Override a value in every config.")
@click.option("--runs", type=click.IntRange(min=2), default=30, show_default=True, help="Runs.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of all that is drawn.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes (default: one a processor); no number depends on it."
)
@click.option(
    "--at", "times", multiple=True, type=float, metavar="TIME", help="Instants of the tables (s; default: the end)."
)
@click.option(
    "--settled", "settling", metavar="OUTPUT=B1,B2,...", help="From when on |error| of an output stays within bounds."
)
@click.option("--claims", type=click.Path(path_type=Path), metavar="FILE.yaml", help="Claims to be judged.")
@click.option("--check", is_flag=True, help="Exit with code 8 when a claim does not hold.")
@click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON on standard output.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page, and pictures beside it."
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(
    configs: tuple[Path, ...], overrides: tuple[str, ...], runs: int, seed: int, workers: int | None,
    times: tuple[float, ...], settling: str | None, claims: Path | None, check: bool, as_json: bool,
    output: Path | None, force: bool,
) -> None:  # fmt: skip
    """Run several filters over the same draws, and tell whose errors are smaller.

    Each run draws one record for all filters (their sources are the same). Tables of rms and median errors, of who is closer to
    the truth, of how long it takes to get there; verdicts on claims that a file makes, such as

    \b
    claims:
      - text: two are twice as good as one
        of: [two, one]                  # a ratio; one filter alone: its figure, in the unit of the output
        output: attitude.yaw
        statistic: rms                  # or median; closer: share of runs; settled: time within a bound
        at: 600 s
        below: 0.5

    Claims about sigmas, which need no draws, are those of estimfw claims.
    """
    from estimfw.cli.progress import progress
    from estimfw.config.generic.components import core_components
    from estimfw.montecarlo.claims import judge, read_claims
    from estimfw.montecarlo.trial import run_trial
    from estimfw.registry.load import load_plugins
    from estimfw.report.trial_tables import trial_json
    from estimfw.run.contenders import from_configs

    refuse_page(output, force=force)
    stated = read_claims(claims) if claims is not None else ()
    wanted = [*times, *(c.at for c in stated if c.at is not None)]
    with progress(as_json) as shown:
        trial = run_trial(
            from_configs(configs, overrides), load_plugins(core_components()), runs, seed, workers or _processors(),
            wanted, shown,
        )  # fmt: skip
    for told in trial.set_aside:
        say(f"warning: {told}", style="yellow")
    verdicts = judge(stated, trial)
    tables = _tables(trial, times, settling)
    if as_json:
        click.echo(json.dumps(trial_json(trial, verdicts), allow_nan=False))
    else:
        _print(trial, verdicts, tables)
    if output is not None:
        from estimfw.report.trial_page import write_trial

        say(f"wrote {', '.join(str(p) for p in write_trial(trial, verdicts, tables, output, force=force))}")
    lost = [v.claim.text for v in verdicts if not v.holds]
    if check and lost:
        raise CheckError(f"{len(lost)} of {len(verdicts)} claims do not hold: {'; '.join(lost)}")


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _tables(trial: Trial, times: Sequence[float], settling: str | None) -> list[tuple[str, Table]]:
    from estimfw.report.trial_tables import error_tables, settling_table

    tables = error_tables(trial, times)
    if settling is not None:
        output, equals, bounds = settling.partition("=")
        try:
            limits = [float(word) for word in bounds.split(",")]
        except ValueError:
            limits = []
        if not equals or not limits:
            raise UsageError(f"--settled {settling!r} names no bounds", hint="such as --settled attitude.yaw=1,0.5")
        tables.append(("How long it takes", settling_table(trial, output.strip(), limits)))
    return tables


def _print(trial: Trial, verdicts: Sequence[Verdict], tables: Sequence[tuple[str, Table]]) -> None:
    from rich.text import Text

    from estimfw.report.terminal import print_table
    from estimfw.report.trial_tables import claim_table

    out = console()
    out.print(Text(f"{trial.title}: {trial.runs} runs, {len(trial.names)} filters", style="bold"))
    for title, content in tables:
        print_table(out, title, content)
    if verdicts:
        print_table(out, "Claims", claim_table(verdicts))
