"""`explain` for people: rich tables of the labelled model and of everything that was done to it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from estimfw.analysis.directions import undetectable_directions
from estimfw.config.compose import Problem
from estimfw.model.model import Model
from estimfw.model.parts import NoiseInput, StateBlock
from estimfw.report.explain import stages
from estimfw.units.display import display_unit
from estimfw.units.unit_text import parse_unit

__all__ = ["explanation"]


def explanation(problem: Problem) -> Iterator[RenderableType]:
    """What to print, in order."""
    model = problem.model
    yield Text(problem.config.name or "filter", style="bold")
    yield _states(problem)
    yield _terms(model)
    yield _noises(model)
    yield _measurements(model)
    if problem.changes:
        yield _policies(problem)
    if problem.checks:
        yield _equivalence(problem)
    yield _ranks(problem)
    directions = undetectable_directions(model, problem.reference)
    if directions:
        yield Text("not determined by the measurements, whatever the time:", style="yellow")
        yield from (Text(f"  {d}") for d in directions)
    word = "time-invariant" if problem.plan.time_invariant else "time-varying"
    yield Text.assemble((f"{word}: ", "bold"), problem.plan.reason)
    yield Text(f"discretisation: {problem.plan.discretisation.describe()}")


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold cyan", header_style="bold", expand=False)
    for position, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=position == 0)
    return table


def _states(problem: Problem) -> Table:
    model = problem.model
    sigma = np.sqrt(np.maximum(np.diag(model.prior.evaluate(problem.reference)[1]), 0.0))
    table = _table(f"{len(model.states)} states", "state", "frame", "prior sigma", "equation")
    for block in model.blocks:
        scale = _scale(block)
        for label in block.labels:
            i = model.states.index(label)
            shown = f"{sigma[i] * scale:.4g} {block.display_unit or block.unit}"
            equation = ", ".join(_couplings(model, i))
            table.add_row(label, block.frame or "", shown, equation or "constant")
    return table


def _scale(block: StateBlock) -> float:
    shown = block.display_unit or block.unit
    return float(parse_unit(block.unit).scale) / float(parse_unit(shown).scale)


def _couplings(model: Model, row: int) -> list[str]:
    names = {b.name for b in model.blocks}
    found = []
    for term in model.terms:
        at = row - model.offsets[term.target]
        matrix = model.term_matrix(term)
        if 0 <= at < matrix.shape[0] and term.source in names and any(i == at for i, _, _ in matrix.entries):
            found.append(term.label)
    return found


def _terms(model: Model) -> Table:
    table = _table("process terms", "label", "acts on", "from", "equation", "needs")
    for term in model.terms:
        needs = ", ".join(sorted(model.term_matrix(term).needs)) or "constants"
        table.add_row(term.label, term.target, term.source, term.text, needs)
    return table


def _noises(model: Model) -> Table:
    table = _table("noise inputs", "input", "frame", "density")
    for noise in (model.settled(n) for n in model.noises):
        table.add_row(", ".join(noise.labels), noise.frame or "", ", ".join(_density(noise)))
    return table


def _density(noise: NoiseInput) -> list[str]:
    unit = f"({noise.unit})*sqrt(s)"
    shown = display_unit(unit, noise.name)
    text = shown.text if shown.text != unit else f"{noise.unit}/sqrt(Hz)"
    return list(dict.fromkeys(f"{np.sqrt(noise.psd[i]) * shown.scale:.4g} {text}" for i in noise.live))


def _measurements(model: Model) -> Table:
    table = _table("measurements", "measurement", "rows", "reads", "noise", "kind")
    for m in model.measurements:
        sigma = np.sqrt(np.diag(model.R(m.name)))
        unit = m.unit + ("/sqrt(Hz)" if m.noise == "density" else "")
        kind = "density" if m.noise == "density" else "per measurement"
        noise = ", ".join(dict.fromkeys(f"{s:.4g} {unit}" for s in sigma))
        table.add_row(m.name, ", ".join(m.rows), ", ".join(t.block for t in m.terms), noise, kind)
    return table


def _policies(problem: Problem) -> Table:
    table = _table("policies, in order", "policy", "kind", "states", "removed", "why it holds")
    for change in problem.changes:
        removed = [*change.removed_states, *change.removed_terms, *change.removed_rows, *change.removed_noises]
        numbers = "".join(f"\n{m}" for m in change.measures)
        counts = f"{len(change.before)} -> {len(change.after)}"
        table.add_row(change.policy, change.kind, counts, ", ".join(removed) or "-", change.condition + numbers)
    return table


def _equivalence(problem: Problem) -> Table:
    table = _table("equivalence of model and nominal", "operation", "mirror", "in model", "setting", "computed", "")
    for c in problem.checks:
        verdict = Text("equivalent", style="green") if c.equivalent else Text("MISMATCH", style="bold red")
        table.add_row(c.operation, c.mirror, _yes(c.in_model), c.setting, _yes(c.computed), verdict)
    return table


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _ranks(problem: Problem) -> Table:
    table = _table("observability at the initial nominal", "model", "states", "rank")
    for stage in stages(problem):
        table.add_row(stage.name, str(stage.states), str(stage.rank))
    return table
