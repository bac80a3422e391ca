"""``estimfw schema``: the JSON Schema of configs, over the installed components."""

from __future__ import annotations

import json
from pathlib import Path

import click

__all__ = ["FILE_NAME", "command"]

FILE_NAME = "filter.schema.json"


@click.command("schema")
@click.option(
    "--write", "folder", type=click.Path(path_type=Path, file_okay=False), help="Write the schema into a folder."
)
@click.option(
    "--check", "checked", type=click.Path(path_type=Path, file_okay=False), is_flag=False, flag_value=Path("schemas"),
    help="Compare with the file in a folder (schemas/ if none is named); exit 3 where it is stale.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print what was done as JSON; the schema itself is JSON anyway.")
def command(folder: Path | None, checked: Path | None, as_json: bool) -> None:
    """Print the JSON Schema of configs; editors use it to complete and check."""
    text = _schema_text()
    if folder is None and checked is None:
        click.echo(text, nl=False)
        return
    told = [f"{_check(checked / FILE_NAME, text)} is up to date"] if checked is not None else []
    told += [f"wrote {_write(folder, text)}"] if folder is not None else []
    if as_json:
        files = [str(place / FILE_NAME) for place in (checked, folder) if place is not None]
        click.echo(json.dumps({"ok": True, "files": files}))
        return
    for line in told:
        click.echo(line, err=True)


def _write(folder: Path, text: str) -> Path:
    from estimfw.errors import DataError, Location
    from estimfw.run.files import write_text

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as cause:
        raise DataError(f"cannot write: {cause.strerror}", location=Location(str(folder))) from cause
    return write_text(folder / FILE_NAME, text, force=True)


def _schema_text() -> str:
    from estimfw.config.installed import installed_components
    from estimfw.config.json_schema import filter_schema

    return json.dumps(filter_schema(installed_components()), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


def _check(path: Path, text: str) -> Path:
    from estimfw.errors import ConfigError, Location

    try:
        written = path.read_text(encoding="utf-8")
    except OSError as cause:
        raise ConfigError(f"cannot read the schema: {cause.strerror}", location=Location(str(path))) from None
    if written != text:
        raise ConfigError(
            "the schema is stale: it differs from what the installed components say",
            location=Location(str(path)),
            hint=f"run 'estimfw schema --write {path.parent}'",
        )
    return path
