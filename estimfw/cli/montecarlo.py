"""``estimfw montecarlo``: the filter many times, and whether it is as good as it says."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from estimfw.cli.opening import config_arguments, console, open_problem, say
from estimfw.errors import CheckError

if TYPE_CHECKING:
    import xarray as xr

    from estimfw.config.compose import Problem
    from estimfw.montecarlo.campaign import Campaign

__all__ = ["command"]


@click.command("montecarlo")
@config_arguments
@click.option("--runs", type=click.IntRange(min=2), default=200, show_default=True, help="Runs.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of all that is drawn.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes (default: one a processor); no number depends on it."
)
@click.option("--dask", metavar="ADDRESS", help="Compute on the dask scheduler at ADDRESS instead.")
@click.option(
    "--chunk", type=click.IntRange(min=1), help="Runs of a chunk (default: by the numbers of runs and steps)."
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Default: results/CONFIG/montecarlo.nc.")
@click.option(
    "--confidence", type=click.FloatRange(0.5, 0.9999), default=0.95, show_default=True, help="Of the bounds."
)
@click.option("--check", is_flag=True, help="Exit with code 8 when a bound is left.")
@click.option("--report/--no-report", default=True, help="Page and pictures (default: yes).")
@click.option("--force", is_flag=True, help="Replace a result that is there.")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, runs: int, seed: int, workers: int | None, dask: str | None,
    chunk: int | None, output: Path | None, confidence: float, check: bool, report: bool, force: bool,
) -> None:  # fmt: skip
    """Run the filter of CONFIG many times, each run with its own draw of start, biases and noises.

    Writes RESULT.nc (statistics over the runs), RESULT.html and pictures. Finished chunks are kept in RESULT.nc.chunks/ until
    then: the same command goes on where it was killed, to the same result. With --json and without --output nothing is
    written. The source has to simulate: simulate_model, sins_static.simulate.
    """
    from estimfw.montecarlo.campaign import Workers
    from estimfw.montecarlo.filtering import set_aside

    problem = open_problem(config, overrides)
    for told in set_aside(problem):
        say(f"warning: {told}", style="yellow")
    pool = Workers(workers or _processors(), dask)
    result = output if output is not None or as_json else Path("results") / config.stem / "montecarlo.nc"
    run = _runner(problem, seed, runs, pool, chunk, as_json, force)
    dataset, written = _in_memory(run, confidence) if result is None else _kept(run, result, confidence, report, force)
    if as_json:
        click.echo(json.dumps(_answer(dataset), allow_nan=False))
    else:
        _show(dataset, written)
    if check:
        _check(dataset)


def _runner(
    problem: Problem, seed: int, runs: int, pool: Any, chunk: int | None, quiet: bool, force: bool
) -> Callable[[Path | None], Campaign]:
    def run(folder: Path | None) -> Campaign:
        from estimfw.montecarlo.campaign import run_campaign

        with _progress(quiet) as progress:
            return run_campaign(problem, seed, runs, pool, chunk, folder, progress, force=force)

    return run


def _in_memory(run: Callable[[Path | None], Campaign], confidence: float) -> tuple[xr.Dataset, list[Path]]:
    from estimfw.montecarlo.dataset import campaign_dataset

    return campaign_dataset(run(None), confidence), []


def _kept(
    run: Callable[[Path | None], Campaign], result: Path, confidence: float, report: bool, force: bool
) -> tuple[xr.Dataset, list[Path]]:
    from estimfw.montecarlo.dataset import campaign_dataset
    from estimfw.montecarlo.parts_on_disk import chunks_beside
    from estimfw.montecarlo.result_file import write_campaign
    from estimfw.run.files import output_files

    with output_files(result.parent, [result.name, *([f"{result.stem}.html"] if report else [])], force=force):
        chunks = chunks_beside(result)
        dataset = campaign_dataset(run(chunks), confidence)
        written = [write_campaign(dataset, result, force=force)]
        if report:
            from estimfw.report.montecarlo_page import write_campaign_report

            written += write_campaign_report(dataset, result, force=force)
        _remove(chunks)
    return dataset, written


def _remove(chunks: Path) -> None:
    from estimfw.montecarlo.parts_on_disk import PartFolder

    PartFolder(chunks).remove()


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _show(dataset: xr.Dataset, written: list[Path]) -> None:
    from estimfw.report.montecarlo_tables import error_table, rule, verdict_table
    from estimfw.report.numbers import instant
    from estimfw.report.terminal import print_table

    out = console()
    runs, time = dataset.sizes["run"], instant(float(dataset["time"][-1]))
    out.print(f"[bold]{dataset.attrs['title']}[/bold]: {runs} runs")
    print_table(out, f"Errors at the end, {time} s", error_table(dataset))
    print_table(out, "Is the filter as good as it says?", verdict_table(dataset, brief=True))
    out.print(rule(dataset), style="dim")
    pictures = sum(path.suffix == ".png" for path in written)
    names = [str(path) for path in written if path.suffix != ".png"]
    say(f"wrote {', '.join(names)}" + (f" and {pictures} pictures" if pictures else ""))


def _answer(dataset: xr.Dataset) -> dict[str, Any]:
    from estimfw.montecarlo.answer import campaign_answer

    return campaign_answer(dataset)


def _check(dataset: xr.Dataset) -> None:
    entries = [e for e in json.loads(dataset.attrs["judged"]) if e["checked"] and not e["consistent"]]
    if not entries:
        return
    told = [
        f"{e['figure']} of {e['quantity']} {e['over_time']['mean']:.4g} for {e['degrees_of_freedom']:g}"
        for e in entries
    ]
    more = f" and {len(told) - 4} more" if len(told) > 4 else ""
    raise CheckError(
        f"the filter is not as good as it says: {'; '.join(told[:4])}{more}",
        hint="too large: the errors are larger than the filter's sigmas say; too small: R, Q or P0 is larger than need be",
    )


@contextmanager
def _progress(quiet: bool) -> Iterator[Callable[[int, int], None] | None]:
    """A rich bar on standard error where that is a terminal."""
    from rich.console import Console

    made = Console(stderr=True)
    if quiet or not made.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=made, transient=True) as bar:
        task = bar.add_task("runs", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
