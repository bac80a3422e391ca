"""``estimfw check``: everything but the run."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, open_problem, say_undetermined

__all__ = ["command"]


@click.command("check")
@config_arguments
@click.option("--data/--no-data", default=True, help="Read the record and check it too (default: yes).")
def command(config: Path, overrides: tuple[str, ...], as_json: bool, data: bool) -> None:
    """Check CONFIG: the config, the model, the policies, the plan, the record; everything but the run."""
    from estimfw.run.load import load_record
    from estimfw.run.prepare import prepare

    problem = open_problem(config, overrides)
    notes: list[str] = []
    steps, kernel = None, None
    if data and problem.source is not None:
        prepared = prepare(problem, load_record(problem))
        steps, kernel = len(prepared.steps), prepared.scan.name
        notes.extend(f"{e.source}: {e.kind}, {e.text}" for e in prepared.events)
    elif problem.source is None:
        notes.append("the config has no source: there is nothing to run it on")
    found = {
        "ok": True,
        "states": list(problem.model.states),
        "time_invariant": problem.plan.time_invariant,
        "steps": steps,
        "kernel": kernel,
        "notes": notes,
        "undetermined": list(problem.undetermined),
        "warnings": list(problem.warnings),
    }
    say_undetermined(problem, listed=True)
    if as_json:
        click.echo(json.dumps(found))
        return
    click.echo(f"ok: {len(problem.model.states)} states" + (f", {steps} steps, {kernel} kernel" if steps else ""))
    for note in notes:
        click.echo(f"note: {note}")
