"""``estimfw compare``: what each of several filters costs, and what it gives."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from estimfw.cli.opening import console, say
from estimfw.cli.page_option import refuse_page
from estimfw.errors import UsageError

if TYPE_CHECKING:
    from estimfw.report.price_values import Given
    from estimfw.run.compare import Comparison
    from estimfw.run.contenders import Contender
    from estimfw.run.published import Published

__all__ = ["command"]

PICTURE_POINTS = 4000


@click.command("compare")
@click.argument("configs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--set", "overrides", multiple=True, metavar="PATH=VALUE", help="Override a value in every config.")
@click.option(
    "--policies-one-by-one", "stepwise", is_flag=True, help="One CONFIG: its full model, then policy by policy."
)
@click.option("--at", "times", multiple=True, type=float, metavar="TIME", help="Also or instead at an instant (s).")
@click.option(
    "--vary", "varied", multiple=True, metavar="PATH=[V1,V2,...]", help="Run at each value; several: all combinations."
)
@click.option(
    "--published", type=click.Path(path_type=Path), metavar="CSV",
    help="Figures to stand beside ours: columns filter,value,output,published,unit.",
)  # fmt: skip
@click.option("--repeats", type=click.IntRange(1, 1000), default=15, show_default=True, help="Of the timing.")
@click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON on standard output.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page, and pictures beside it."
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(
    configs: tuple[Path, ...], overrides: tuple[str, ...], stepwise: bool, times: tuple[float, ...],
    varied: tuple[str, ...], published: Path | None, repeats: int, as_json: bool, output: Path | None, force: bool,
) -> None:  # fmt: skip
    """Compare filters on one record with one noise: states, non-zeros, multiplications, time a step, errors and sigmas.

    The record is the one that the first config's source makes; site, source and aiding of the others have to be the same. A
    list of equal values given to --vary is named by one of them ("5 deg"), in tables and in the column value of --published.
    Without --at, the values are those at the end of the run.
    """
    from estimfw.cli.progress import progress
    from estimfw.config.generic.components import core_components
    from estimfw.registry.load import load_plugins
    from estimfw.report.price_values import unmatched, values_of
    from estimfw.run.compare import compare
    from estimfw.run.contenders import grid
    from estimfw.run.published import read_published

    refuse_page(output, force=force)
    figures = read_published(published) if published is not None else ()
    contenders, points = _contenders(configs, overrides, stepwise), grid(varied)
    with progress(as_json) as shown:
        found = compare(contenders, points, load_plugins(core_components()), repeats, times, shown)
    values = values_of(found, sorted(set(times)), figures)
    remarks = _remarks(figures, unmatched(figures, values))
    if as_json:
        from estimfw.report.price_json import price_json

        click.echo(json.dumps(price_json(found, values), allow_nan=False))
    else:
        _print(found, values, remarks)
    if output is not None:
        say(f"wrote {', '.join(str(p) for p in _write(found, values, remarks, output, force))}")


def _contenders(configs: Sequence[Path], overrides: Sequence[str], stepwise: bool) -> tuple[Contender, ...]:
    from estimfw.run.contenders import from_configs, one_by_one

    if not stepwise:
        return from_configs(configs, overrides)
    if len(configs) > 1:
        raise UsageError("--policies-one-by-one takes one config", hint="or leave it out, to compare several")
    return one_by_one(configs[0], overrides)


def _remarks(figures: Sequence[Published], lost: Sequence[Published]) -> list[str]:
    if not lost:
        return []
    if len(lost) == len(figures):
        one = lost[0]
        raise UsageError(
            f"no published figure belongs to a filter here, such as {one.filter!r}, {one.value!r}, {one.output!r}",
            hint="filter is the name in the table, value that of the point (empty without --vary), output as in the table",
        )
    return [f"{len(lost)} published figures belong to no filter, point and output of this comparison"]


def _print(found: Comparison, values: Sequence[Given], remarks: Sequence[str]) -> None:
    from rich.text import Text

    from estimfw.report.cost_tables import form_table
    from estimfw.report.price_apart import apart_table
    from estimfw.report.price_tables import price_notes, price_table, value_table
    from estimfw.report.terminal import print_table

    out = console()
    out.print(Text(found.title, style="bold"))
    print_table(out, "What each costs", price_table(found))
    for line in price_notes(found):
        out.print(Text(line, style="dim"))
    for work in (one.work for one in found.filters if one.work is not None):
        print_table(out, "Multiplications of a step", form_table(work))
        break
    print_table(out, "What each gives", value_table(values))
    apart = apart_table(found)
    if apart is not None:
        print_table(out, "How far apart they are", apart)
    for line in remarks:
        out.print(Text(line, style="yellow"))


def _write(found: Comparison, values: Sequence[Given], remarks: Sequence[str], output: Path, force: bool) -> list[Path]:
    from estimfw.report.pictures import save_picture
    from estimfw.report.price_charts import price_charts
    from estimfw.report.price_overlays import overlay_charts
    from estimfw.report.price_page import price_page
    from estimfw.run.files import output_files, write_atomically, write_text

    charts = (*price_charts(found, PICTURE_POINTS), *overlay_charts(found, PICTURE_POINTS))
    pictures = {f"{output.stem}_{c.key}.png": c for c in charts}
    with output_files(output.parent, (output.name, *pictures), force=force) as folder:
        written = [write_text(output, price_page(found, values, remarks), force=force)]
        for name, chart in pictures.items():
            written.append(write_atomically(folder / name, partial(save_picture, chart), force=force))
    return written
