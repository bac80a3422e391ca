"""``estimfw explain``: what a composed filter is."""

from __future__ import annotations

import json
from pathlib import Path

import click

from estimfw.cli.opening import config_arguments, open_problem

__all__ = ["command"]


@click.command("explain")
@config_arguments
@click.option("--latex", is_flag=True, help="Print the equations as LaTeX.")
def command(config: Path, overrides: tuple[str, ...], as_json: bool, latex: bool) -> None:
    """Print the labelled model of CONFIG, what each policy removed and why, equivalence, ranks, time invariance."""
    problem = open_problem(config, overrides)
    if latex:
        from estimfw.report.latex import model_latex

        click.echo(model_latex(problem.model, problem.plan.layout))
    elif as_json:
        from estimfw.report.explain import explain_json

        click.echo(json.dumps(explain_json(problem)))
    else:
        from estimfw.cli.opening import console
        from estimfw.report.explain_text import explanation

        out = console()
        for part in explanation(problem):
            out.print(part)
