"""``estimfw cost``: what a step costs in each form of the filter, and where a processor for each node pays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from estimfw.cli.opening import config_arguments, console, open_problem, say
from estimfw.cli.page_option import refuse_page
from estimfw.cli.partition import sizes_of
from estimfw.errors import ConfigError, UsageError

if TYPE_CHECKING:
    from estimfw.analysis.speed_up import Link
    from estimfw.config.compose import Problem
    from estimfw.run.cost import Costed, Nodes
    from estimfw.run.measured_cost import Measured

__all__ = ["command"]

LATENCY, BANDWIDTH, MULTIPLICATION = "50 us", "125 MB/s", "1 ns"


@click.command("cost")
@config_arguments
@click.option("--into", type=int, metavar="N", help="Cut into N nodes first, as estimfw partition does.")
@click.option("--sizes", metavar="N,N,...", help="Sizes of the nodes instead, such as 6,4.")
@click.option(
    "--latency",
    default=LATENCY,
    show_default=True,
    metavar="TIME",
    help="Of an exchange between processors; the default is typical of gigabit Ethernet.",
)
@click.option(
    "--bandwidth",
    default=BANDWIDTH,
    show_default=True,
    metavar="RATE",
    help="Of the link, in B/s, bit/s or words/s with k, M or G; a word has 8 bytes. The default is gigabit Ethernet.",
)
@click.option(
    "--multiply-time",
    default=MULTIPLICATION,
    show_default=True,
    metavar="TIME",
    help="Of a multiplication with what goes with it; the default is typical of plain compiled loops.",
)
@click.option("--count/--no-count", default=None, help="Run the forms on numbers that count (default: to 40 states).")
@click.option(
    "--measure", "timed", is_flag=True, help="Time the nodes over steps of the record, beside the prediction."
)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE.html", help="Write a page, and pictures beside it."
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, into: int | None, sizes: str | None, latency: str,
    bandwidth: str, multiply_time: str, count: bool | None, timed: bool, output: Path | None, force: bool,
) -> None:  # fmt: skip
    """Count the multiplications of a step of CONFIG: textbook, Joseph, symmetric, without zeros, and cut into nodes.

    Nodes are those of a decentralised filter, or those that --into makes. Beside the work stand the words that processors
    exchange, the predicted speed-up for a link, and from where on it pays.
    """
    from estimfw.run.cost import cost_of_filter

    link = _link(latency, bandwidth, multiply_time)
    wanted = sizes_of(sizes)
    refuse_page(output, force=force)
    problem = open_problem(config, overrides)
    nodes = _nodes(problem, into if into is not None else len(wanted), wanted, as_json)
    costed = cost_of_filter(problem, link, nodes, counted=count)
    measured = _measured(problem, costed, as_json) if timed else None
    if as_json:
        from estimfw.report.cost_tables import cost_json

        click.echo(json.dumps(cost_json(costed, measured), allow_nan=False))
    else:
        from estimfw.report.cost_text import print_cost

        print_cost(costed, console(), measured)
    if costed.cut is None:
        say("no nodes: --into 2 tells what the filter costs cut into two, and where that pays", style="dim")
    if output is not None:
        from estimfw.report.cost_page import write_cost

        say(f"wrote {', '.join(str(path) for path in write_cost(costed, output, measured, force=force))}")


def _nodes(problem: Problem, into: int, sizes: tuple[int, ...], quiet: bool) -> Nodes | None:
    from estimfw.cli.progress import progress
    from estimfw.run.cost import nodes_by_groups, nodes_of
    from estimfw.run.partition import partition_filter

    own = nodes_of(problem)
    if not into:
        return own
    if own is not None:
        raise UsageError("the filter has nodes already", hint="leave out --into and --sizes")
    with progress(quiet) as shown:
        return nodes_by_groups(problem, partition_filter(problem, into, sizes, price=False, progress=shown))


def _measured(problem: Problem, costed: Costed, quiet: bool) -> Measured:
    from estimfw.cli.progress import progress
    from estimfw.run.measured_cost import measure

    if costed.cut is None:
        raise UsageError("--measure times nodes, and the filter has none", hint="cut it: --into 2")
    with progress(quiet) as shown:
        return measure(problem, costed.cut, shown)


def _link(latency: str, bandwidth: str, multiply_time: str) -> Link:
    from estimfw.analysis.speed_up import Link
    from estimfw.units.data_rate import words_per_second

    try:
        word = 1.0 / words_per_second(bandwidth)
    except ConfigError as error:
        raise UsageError(f"--bandwidth: {error.message}", hint=error.hint) from error
    return Link(_seconds(latency, "--latency"), word, _seconds(multiply_time, "--multiply-time"))


def _seconds(text: str, option: str) -> float:
    from estimfw.units import parse_quantity

    hint = f"such as {option} '{LATENCY if option == '--latency' else MULTIPLICATION}'"
    try:
        found = parse_quantity(text)
    except ConfigError as error:
        raise UsageError(f"{option}: {error.message}", hint=hint) from error
    if found.unit.si_text != "s" or found.value < 0.0 or (found.value == 0.0 and option != "--latency"):
        raise UsageError(f"{option}: {text!r} is no time above zero", hint=hint)
    return found.value
