"""``estimfw partition``: cut the states of a filter into the nodes of a decentralised one."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, console, open_problem, say
from estimfw.cli.page_option import refuse_page
from estimfw.errors import UsageError

__all__ = ["command", "sizes_of"]


@click.command("partition")
@config_arguments
@click.option("--into", type=int, metavar="N", help="Number of groups, of balanced sizes.")
@click.option("--sizes", metavar="N,N,...", help="Sizes of the groups instead, such as 6,4.")
@click.option(
    "--price/--no-price", default=True, help="Also what the groups cost filters that neglect what is between."
)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE.html", help="Write a page, and pictures beside it."
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, into: int | None, sizes: str | None, price: bool,
    output: Path | None, force: bool,
) -> None:  # fmt: skip
    """Cut the states of CONFIG into groups that keep together what is correlated most, and print them as nodes.

    The filter runs over its record; the correlation of its covariance at the end counts. States that one row of a measurement
    reads stay together. Beside it stand the groups by physical coupling, and what both cost filters that neglect the
    covariances between groups. The exact decentralised filter does not depend on the groups.
    """
    from estimfw.cli.progress import progress
    from estimfw.run.partition import partition_filter

    wanted = sizes_of(sizes)
    if into is None and not wanted:
        raise UsageError("into how many groups?", hint="--into 2, or sizes: --sizes 5,5")
    refuse_page(output, force=force)
    problem = open_problem(config, overrides)
    with progress(as_json) as shown:
        count = into if into is not None else len(wanted)
        found = partition_filter(problem, count, wanted, price=price, progress=shown)
    if as_json:
        from estimfw.report.partition_tables import partition_json

        click.echo(json.dumps(partition_json(found), allow_nan=False))
    else:
        from estimfw.report.partition_text import print_partition

        print_partition(found, console())
    if output is not None:
        from estimfw.report.partition_page import write_partition

        say(f"wrote {', '.join(str(path) for path in write_partition(found, output, force=force))}")


def sizes_of(text: str | None) -> tuple[int, ...]:
    """Whole numbers between commas; none of nothing.

    Raises
    ------
    UsageError
        Something else.
    """
    if text is None:
        return ()
    try:
        return tuple(int(one) for one in text.split(","))
    except ValueError as error:
        raise UsageError(f"--sizes {text!r}: whole numbers are due", hint="such as --sizes 6,4") from error
