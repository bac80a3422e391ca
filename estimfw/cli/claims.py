"""``estimfw claims``: claims about the sigmas and errors of filters, judged by a run of each."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import console, say
from estimfw.cli.page_option import refuse_page
from estimfw.errors import CheckError

__all__ = ["command"]


@click.command("claims")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--check", is_flag=True, help="Exit with code 8 when a claim does not hold, or only partly.")
@click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON on standard output.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page, and pictures beside it."
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(file: Path, check: bool, as_json: bool, output: Path | None, force: bool) -> None:
    """Run the filters of FILE, once each, and judge what is claimed of their sigmas and errors.

    A claim has parts, each a figure with bounds; it holds where all of them hold. FILE is such as

    \b
    title: What a paper claims
    set: [source.seed=1]              # in all filters, as --set
    filters:
      nine: {config: ../nine.yaml}    # from the folder of FILE
      six: {config: ../nine.yaml, set: [policies=[my.reduction]]}
    figures:
      - {title: "Figure 1", of: [nine]}
    claims:
      - text: The bias converges fast
        parts:
          - text: to a tenth of what it was, in an hour
            of: [nine]                # two filters: the first over the second
            quantity: gyro_bias[E]    # a state or an output
            statistic: sigma          # honest_sigma, error, overconfidence,
            at: 1 h                   #   exponent, turns, undetermined
            since: 0 s                # a ratio: at over since
            below: 0.1

    Claims that need many runs (rms, who is closer) are those of estimfw trial.
    """
    from estimfw.cli.progress import progress
    from estimfw.config.generic.components import core_components
    from estimfw.registry.load import load_plugins
    from estimfw.report.claims_tables import claims_json, part_table, verdict_table
    from estimfw.report.terminal import print_table
    from estimfw.run.claim_file import read_claim_file
    from estimfw.run.claims import judge_claims, run_filters

    refuse_page(output, force=force)
    stated = read_claim_file(file)
    with progress(as_json) as shown:
        results = run_filters(stated, file.parent, load_plugins(core_components()), shown)
    judged = judge_claims(stated, results)
    if as_json:
        click.echo(json.dumps({"title": stated.title, "claims": claims_json(judged)}, allow_nan=False))
    else:
        out = console()
        for one in judged:
            print_table(out, f"{one.claim.text}: {one.verdict}", part_table(one))
        print_table(out, "Verdicts", verdict_table(judged))
    if output is not None:
        from estimfw.report.claims_page import write_claims

        page, *pictures = write_claims(stated, judged, results, output, force=force)
        say(f"wrote {page}" + (f" and {len(pictures)} pictures beside it" if pictures else ""))
    lost = [one.claim.text for one in judged if one.verdict != "holds"]
    if check and lost:
        raise CheckError(f"{len(lost)} of {len(judged)} claims do not hold as they stand: {'; '.join(lost)}")
