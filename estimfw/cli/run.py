"""``estimfw run``: the filter over its record."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from estimfw.cli.opening import config_arguments, open_problem, say, say_undetermined
from estimfw.cli.progress import busy, progress
from estimfw.errors import UsageError

if TYPE_CHECKING:
    import xarray as xr

    from estimfw.config.compose import Problem
    from estimfw.run.run import Collected

__all__ = ["command"]


@click.command("run")
@config_arguments
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder of the result (default: results/CONFIG).")
@click.option("--force", is_flag=True, help="Replace a result that is there.")
@click.option("--at", type=float, help="Answer as if the run had ended at this instant (s).")
@click.option(
    "--csv", is_flag=True, help="Write the outputs over time as outputs.csv too (states where there are none)."
)
@click.option("--npz", is_flag=True, help="The same as outputs.npz, in SI units and to the last bit.")
@click.option("--report/--no-report", default=True, help="Pictures and page (default: yes).")
def command(
    config: Path, overrides: tuple[str, ...], as_json: bool, output: Path | None, force: bool, at: float | None, csv: bool,
    npz: bool, report: bool,
) -> None:  # fmt: skip
    """Run the filter of CONFIG over its record.

    Writes result.nc, summary.json, pictures and report.html into the output folder. With --json and without --output nothing
    is written: the answer goes to standard output alone. With --at, the answer, summary.json and outputs.csv are those of the
    run up to that instant; result.nc, pictures and page show the whole.

    Of a recorded trajectory (a log of an INS) the outputs over time are the corrected trajectory: corrected.csv is written
    without being asked for, with --npz corrected.npz too, and errors before and after the correction are told.
    """
    from estimfw.run.files import output_folder

    if (csv or npz) and as_json and output is None:
        option = "--csv" if csv else "--npz"
        raise UsageError(f"{option} with --json needs a folder for the file", hint="name it: -o FOLDER")
    problem = open_problem(config, overrides)
    tables = _tables(problem, csv=csv, npz=npz)
    folder = output if output is not None or as_json else Path("results") / config.stem
    if folder is None:
        done, _, shown = _run(problem, at, as_json)
        written: list[Path] = []
    else:
        with output_folder(folder, _names(tables, report=report), force=force):
            done, dataset, shown = _run(problem, at, as_json)
            with busy("writing the result", as_json):
                written = _write(dataset, shown, folder, force=force, tables=tables, report=report)
    if as_json:
        from estimfw.run.answer import answer

        click.echo(json.dumps(answer(shown) | {"timing": _timing(done)}, allow_nan=False))
    else:
        from estimfw.cli.opening import console
        from estimfw.report.terminal import print_result

        print_result(shown, console(), at_end=at is None)
        _say_done(done, folder, written)
        if folder is not None and report:
            _say_left_out(shown)
    say_undetermined(problem)


def _run(problem: Problem, at: float | None, quiet: bool) -> tuple[Collected, xr.Dataset, xr.Dataset]:
    """What was collected, the result of it, and the result up to ``at``."""
    from estimfw.run.dataset import result_dataset
    from estimfw.run.run import run_problem
    from estimfw.run.until import until

    with progress(quiet) as shown:
        done = run_problem(problem, shown)
    dataset = result_dataset(done)
    return done, dataset, dataset if at is None else until(dataset, at)


def _tables(problem: Problem, *, csv: bool, npz: bool) -> list[str]:
    """The files of outputs over time."""
    from estimfw.run.recorded import corrects_a_record
    from estimfw.run.values_file import CORRECTED, OUTPUTS

    corrected = corrects_a_record(problem)
    name = CORRECTED if corrected else OUTPUTS
    return [*([f"{name}.csv"] if csv or corrected else []), *([f"{name}.npz"] if npz else [])]


def _names(tables: Sequence[str], *, report: bool) -> list[str]:
    """What must not be there yet, before the filter runs for nothing."""
    return ["result.nc", "summary.json", *tables, *(["report.html"] if report else [])]


def _say_done(done: Collected, folder: Path | None, written: Sequence[Path]) -> None:
    say("")
    steps, kernel = len(done.prepared.steps), done.prepared.scan.name
    smoother = f", smoother {done.timing.smooth:.2f} s" if done.smoothed is not None else ""
    say(f"{steps} steps with the {kernel} kernel: {done.timing.filter:.2f} s{smoother}", style="dim")
    pictures = sum(path.suffix == ".png" for path in written)
    names = [path.name for path in written if path.suffix != ".png"]
    names += [f"{pictures} pictures in {Path('figures')}/"] if pictures else []
    if folder is not None:
        say(f"wrote {', '.join(names)} into {folder}")


def _say_left_out(dataset: xr.Dataset) -> None:
    from estimfw.report.write import PICTURED_STATES, states_only_on_page

    if states_only_on_page(dataset):
        say(f"more than {PICTURED_STATES} states: each is drawn on the page, not as a picture", style="dim")


def _write(
    dataset: xr.Dataset, shown: xr.Dataset, folder: Path, *, force: bool, tables: Sequence[str], report: bool
) -> list[Path]:
    from estimfw.run.answer import answer
    from estimfw.run.files import write_bytes, write_text
    from estimfw.run.result_file import write_result
    from estimfw.run.values_file import values_csv, values_npz

    written = [write_result(dataset, folder / "result.nc", force=force)]
    text = json.dumps(answer(shown), indent=2, allow_nan=False) + "\n"
    written.append(write_text(folder / "summary.json", text, force=force))
    for name in tables:
        if name.endswith(".csv"):
            written.append(write_text(folder / name, values_csv(shown), force=force))
        else:
            written.append(write_bytes(folder / name, values_npz(shown), force=force))
    if report:
        from estimfw.report.write import write_report

        written.extend(write_report(dataset, folder, force=force))
    return written


def _timing(done: Collected) -> dict[str, float]:
    t = done.timing
    smoother = {"smoother_s": t.smooth} if done.smoothed is not None else {}
    return {"load_s": t.load, "prepare_s": t.prepare, "filter_s": t.filter, **smoother}
