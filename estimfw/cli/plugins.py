"""``estimfw plugins list`` and ``estimfw plugins show``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from estimfw.errors import UsageError
from estimfw.spelling import did_you_mean

if TYPE_CHECKING:
    from estimfw.registry.plugin import Plugin

__all__ = ["command"]


@click.group("plugins")
def command() -> None:
    """List plugins and their components."""


@command.command("list")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def list_plugins(as_json: bool) -> None:
    """Every plugin that was found, and what became of it."""
    from estimfw.config.installed import installed_components

    plugins = installed_components().plugins
    if as_json:
        click.echo(json.dumps({"plugins": [_facts(p) for p in plugins]}, indent=2))
        return
    rows = [(p.name, p.distribution, p.version, p.status, str(len(p.components)), p.reason) for p in plugins]
    _print_table(("plugin", "distribution", "version", "status", "components", "reason"), rows)


@command.command("show")
@click.argument("name")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def show_plugin(name: str, as_json: bool) -> None:
    """The components of one plugin ('estimfw' is the framework itself), or why it is not loaded."""
    from estimfw.config.installed import installed_components

    plugins = installed_components().plugins
    named = [p for p in plugins if p.name == name]
    if not named:
        raise UsageError(f"no plugin {name!r}", hint=did_you_mean(name, (p.name for p in plugins)))
    if as_json:
        click.echo(json.dumps({"plugins": [_details(p) for p in named]}, indent=2))
        return
    for plugin in named:
        _print_plugin(plugin)


def _print_plugin(plugin: Plugin) -> None:
    click.echo(f"{plugin.name} from {plugin.origin}: {plugin.status}")
    if plugin.status == "loaded":
        rows = [(c.role, plugin.id_of(c), c.summary) for c in plugin.components]
        _print_table(("role", "kind", "what it is"), rows)
        return
    click.echo(f"  {plugin.reason}")
    if plugin.traceback:
        click.echo(plugin.traceback.rstrip())


def _facts(plugin: Plugin) -> dict[str, object]:
    return {
        "name": plugin.name, "distribution": plugin.distribution, "version": plugin.version,
        "status": plugin.status, "components": len(plugin.components), "reason": plugin.reason or None,
    }  # fmt: skip


def _details(plugin: Plugin) -> dict[str, object]:
    components = [{"role": c.role, "kind": plugin.id_of(c), "summary": c.summary} for c in plugin.components]
    return _facts(plugin) | {"components": components, "traceback": plugin.traceback or None}


def _print_table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    from rich.table import Table
    from rich.text import Text

    from estimfw.cli.opening import console

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for position, column in enumerate(columns):
        table.add_column(column, no_wrap=position < len(columns) - 1, overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    console().print(table)
