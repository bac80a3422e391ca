"""``estimfw simulate``: the record of a simulated source, as files."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, open_problem, say_undetermined

__all__ = ["command"]


@click.command("simulate")
@config_arguments
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder of the files.")
@click.option("--format", "kind", type=click.Choice(["npz", "csv"]), default="npz", help="Default: npz.")
@click.option("--force", is_flag=True, help="Replace files that are there.")
def command(config: Path, overrides: tuple[str, ...], as_json: bool, output: Path, kind: str, force: bool) -> None:
    """Write the streams of CONFIG's source, one file a stream, and the truth as truth.npz."""
    from estimfw.run.files import output_folder
    from estimfw.run.load import source_record
    from estimfw.run.record_file import write_record

    problem = open_problem(config, overrides)
    record = source_record(problem)
    with output_folder(output, force=force):
        written = write_record(record, output, kind, force=force)
    if as_json:
        click.echo(json.dumps({"files": [str(p) for p in written]}))
    else:
        for path in written:
            click.echo(str(path))
    say_undetermined(problem)
