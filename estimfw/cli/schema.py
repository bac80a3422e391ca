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
def command(folder: Path | None, checked: Path | None) -> None:
    """Print the JSON Schema of configs; editors use it to complete and check."""
    text = _schema_text()
    if checked is not None:
        _check(checked / FILE_NAME, text)
    if folder is not None:
        from estimfw.run.files import write_text

        folder.mkdir(parents=True, exist_ok=True)
        click.echo(f"wrote {write_text(folder / FILE_NAME, text, force=True)}", err=True)
    if folder is None and checked is None:
        click.echo(text, nl=False)


def _schema_text() -> str:
    from estimfw.config.installed import installed_components
    from estimfw.config.json_schema import filter_schema

    return json.dumps(filter_schema(installed_components()), indent=2, sort_keys=True, ensure_ascii=False) + "\n"


def _check(path: Path, text: str) -> None:
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
    click.echo(f"{path} is up to date", err=True)
