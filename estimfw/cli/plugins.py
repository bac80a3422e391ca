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
    from estimfw.registry.registry import Registry

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
    """The components of a plugin, or the settings of a kind.

    NAME is a plugin ('estimfw' is the framework itself; one that is not loaded says why), or a kind such as inertial.imu_log:
    its settings with unit, default and meaning.
    """
    from estimfw.config.installed import installed_components

    registry = installed_components()
    named = [p for p in registry.plugins if p.name == name]
    if named:
        if as_json:
            click.echo(json.dumps({"plugins": [_details(p) for p in named]}, indent=2))
            return
        for plugin in named:
            _print_plugin(plugin)
        return
    kinds = [(c.role, p.id_of(c), c.summary) for p in registry.plugins for c in p.components]
    found = [one for one in kinds if one[1] == name]
    if not found:
        hint = did_you_mean(name, [*(p.name for p in registry.plugins), *dict.fromkeys(kind for _, kind, _ in kinds)])
        raise UsageError(f"no plugin and no kind {name!r}", hint=hint)
    _show_kinds(registry, found, as_json=as_json)


def _show_kinds(registry: Registry, found: Sequence[tuple[str, str, str]], *, as_json: bool) -> None:
    """The settings of each role that has the kind."""
    from dataclasses import asdict

    from estimfw.config.json_schema import filter_schema
    from estimfw.config.settings_sheet import settings_sheet, settings_text

    definitions = filter_schema(registry)["$defs"]
    sheets = [
        (role, kind, summary, settings_text(definitions, role, kind), settings_sheet(definitions, role, kind))
        for role, kind, summary in found
    ]
    if as_json:
        facts = [
            {"role": role, "kind": kind, "summary": summary, "text": text, "settings": [asdict(one) for one in sheet]}
            for role, kind, summary, text, sheet in sheets
        ]
        click.echo(json.dumps({"components": facts}, indent=2, ensure_ascii=False))
        return
    for role, kind, summary, text, sheet in sheets:
        click.echo(f"{kind} ({role}): {summary}" + (f"\n  {text}" if text else ""))
        rows = [(one.name, one.unit, one.default, one.takes, one.meaning) for one in sheet]
        if rows:
            _print_table(("setting", "unit", "default", "takes", "meaning"), rows, whole=2)
        else:
            click.echo("  no settings but its kind")


def _print_plugin(plugin: Plugin) -> None:
    click.echo(f"{plugin.name} from {plugin.origin}: {plugin.status}")
    if plugin.status == "loaded":
        rows = [(c.role, plugin.id_of(c), c.summary) for c in plugin.components]
        _print_table(("role", "kind", "what it is"), rows)
        click.echo("'estimfw plugins show KIND' lists the settings of a kind.", err=True)
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


def _print_table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], *, whole: int | None = None) -> None:
    """The first ``whole`` columns (all but the last) are never broken."""
    from rich.table import Table
    from rich.text import Text

    from estimfw.cli.opening import console

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    unbroken = len(columns) - 1 if whole is None else whole
    for position, column in enumerate(columns):
        table.add_column(column, no_wrap=position < unbroken, overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    console().print(table)
