"""`explain` for people: rich tables of the labelled model and of everything that was done to it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from estimfw.config.compose import Problem
from estimfw.model.model import Model
from estimfw.model.parts import NoiseInput, StateBlock
from estimfw.plan.plan import Plan
from estimfw.report.brief_labels import brief_labels
from estimfw.report.equations import dynamics, observations
from estimfw.report.explain import stages
from estimfw.report.numbers import measured
from estimfw.report.segments import segments_of, segments_text
from estimfw.units.display import display_unit
from estimfw.units.unit_text import parse_unit

__all__ = ["density_unit", "explanation"]

TITLE = "bold cyan"
KINDS = {"exact": "green", "mirrored": "green", "approximate": "yellow"}
"""Colours of the kinds of a change."""


def explanation(problem: Problem) -> Iterator[RenderableType]:
    """What to print, in order."""
    model = problem.model
    yield Text(problem.config.name or "filter", style="bold")
    yield _states(problem)
    if model.quotient is not None:
        yield _meanings(model)
    yield _equations("equations", "d/dt", dynamics(model))
    yield _equations("measurements", "", observations(model))
    yield _measurements(model)
    yield _terms(model)
    yield _noises(model)
    if problem.changes:
        yield _policies(problem)
    if problem.checks:
        yield _equivalence(problem)
    if problem.plan.subsystems is not None:
        yield _nodes(problem.plan)
    if problem.plan.stages:
        yield _estimation_stages(problem.plan)
    yield _ranks(problem)
    yield _verdicts(problem)


def _verdicts(problem: Problem) -> RenderableType:
    """What the measurements cannot tell, and whether matrices are computed once."""
    lines = [Text(f"  {direction}") for direction in problem.undetermined]
    if lines:
        told = "not determined by the measurements, whatever the time, here with what goes together:"
        lines.insert(0, Text(told, style="yellow"))
    segments = segments_of(problem)
    in_segments = "time-invariant in segments" if len(segments) > 1 else "time-varying"
    word = "time-invariant" if problem.plan.time_invariant else in_segments
    lines.append(Text.assemble((f"{word}: ", "bold"), problem.plan.reason))
    if len(segments) > 1:
        lines.append(Text(f"  {segments_text(segments)}"))
    lines.append(Text.assemble(("discretisation: ", "bold"), problem.plan.discretisation.describe()))
    return Group("", *lines)


def _table(title: str, *columns: str, whole: int = 1) -> Table:
    """A table without lines; the first ``whole`` columns are never broken."""
    table = Table(
        title=Text(f"\n{title}", style=TITLE), title_justify="left", header_style="dim", box=None, padding=(0, 2, 0, 0)
    )
    for position, column in enumerate(columns):
        table.add_column(column, no_wrap=position < whole, overflow="fold")
    return table


def _add(table: Table, *cells: str | Text) -> None:
    """A row of texts as they are: in a plain string, rich takes ``[x]`` for markup and drops it."""
    table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in cells))


def _equations(title: str, prefix: str, lines: list[tuple[str, str]]) -> RenderableType:
    """One line for each equation; a long one goes on below its right side."""
    grid = Table.grid(padding=(0, 1, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_column()
    for left, right in lines:
        grid.add_row(Text(f"{prefix} {left}".strip()), "=", Text(right))
    return Group(Text(f"\n{title}", style=TITLE), grid)


def _states(problem: Problem) -> Table:
    model = problem.model
    sigma = np.sqrt(np.maximum(np.diag(model.prior.evaluate(problem.reference)[1]), 0.0))
    table = _table(f"{len(model.states)} states", "state", "frame", "prior sigma", "driven by the terms", whole=3)
    for block in model.blocks:
        scale = _scale(block)
        for label in block.labels:
            i = model.states.index(label)
            shown = f"{sigma[i] * scale:.4g} {block.display_unit or block.unit}"
            equation = ", ".join(_driving(model, i))
            _add(table, label, block.frame or "", shown, equation or "constant")
    return table


def _estimation_stages(plan: Plan) -> Table:
    table = _table("stages of the estimation", "stage", "until", "estimated", "considered", "held", "measured", whole=2)
    names = [m.name for m in plan.measurements]
    for stage in plan.stages:
        other = [a or b for a, b in zip(stage.held, stage.considered, strict=True)]
        flags = ([not one for one in other], stage.considered, stage.held)
        told = (", ".join(s for s, own in zip(plan.states, one, strict=True) if own) for one in flags)
        until = f"{stage.until:g} s" if stage.until is not None else "the end"
        measured = ", ".join(name for name, own in zip(names, stage.measured, strict=True) if own)
        _add(table, stage.name, until, *told, measured)
    return table


def _meanings(model: Model) -> Table:
    table = _table("what states stand for, factors in SI units", "state", "stands for")
    for label, meaning in zip(model.states, model.state_meanings, strict=True):
        if label != meaning:
            _add(table, label, meaning)
    return table


def _scale(block: StateBlock) -> float:
    shown = block.display_unit or block.unit
    return float(parse_unit(block.unit).scale) / float(parse_unit(shown).scale)


def _driving(model: Model, row: int) -> list[str]:
    """The terms that drive a state, those that couple states first, white noise and known inputs after them."""
    names = {b.name for b in model.blocks}
    found: tuple[list[str], list[str]] = ([], [])
    for term in model.terms:
        at = row - model.offsets[term.target]
        matrix = model.term_matrix(term)
        if 0 <= at < matrix.shape[0] and any(i == at for i, _, _ in matrix.entries):
            found[term.source not in names].append(term.label)
    return [*found[0], *found[1]]


def _terms(model: Model) -> Table:
    table = _table("process terms", "label", "acts on", "from", "equation", "needs", whole=3)
    for term in model.terms:
        needs = ", ".join(sorted(model.term_matrix(term).needs)) or "constants"
        _add(table, term.label, term.target, term.source, term.text, needs)
    return table


def _noises(model: Model) -> Table:
    table = _table("noise inputs", "input", "frame", "density")
    for noise in (model.settled(n) for n in model.noises):
        _add(table, ", ".join(noise.labels), noise.frame or "", ", ".join(_density(noise)))
    return table


def _density(noise: NoiseInput) -> list[str]:
    """Of each axis, once where they are equal, as a config writes it."""
    text, scale = density_unit(noise)
    return list(dict.fromkeys(f"{np.sqrt(noise.psd[i]) * scale:.4g} {text}" for i in noise.live))


def density_unit(noise: NoiseInput) -> tuple[str, float]:
    """Unit of the root of a PSD, which a config takes, and the factor to it from SI.

    White noise in ``m/s`` is the rate of something in ``m``: ``m/sqrt(s)``, the same as ``m/s/sqrt(Hz)``.
    """
    unit = f"({noise.unit})*sqrt(s)"
    shown = display_unit(unit, noise.name)
    if shown.text != unit:
        return shown.text, shown.scale
    return (f"{noise.unit[:-2]}/sqrt(s)" if noise.unit.endswith("/s") else f"{noise.unit}/sqrt(Hz)"), 1.0


def _measurements(model: Model) -> Table:
    table = _table("measurement noise", "measurement", "rows", "reads", "noise", "kind")
    for m in model.measurements:
        sigma = np.sqrt(np.diag(model.R(m.name)))
        unit = m.unit + ("/sqrt(Hz)" if m.noise == "density" else "")
        kind = "density" if m.noise == "density" else "per measurement"
        noise = ", ".join(dict.fromkeys(f"{s:.4g} {unit}" for s in sigma))
        _add(table, m.name, ", ".join(m.rows), ", ".join(t.block for t in m.terms), noise, kind)
    return table


def _policies(problem: Problem) -> RenderableType:
    """A paragraph for each policy, since what it says does not fit into a cell."""
    parts: list[RenderableType] = [Text("\npolicies, in order", style=TITLE)]
    for number, change in enumerate(problem.changes, start=1):
        head = Text.assemble(f"{number}. ", (change.policy, "bold"), "  ", (change.kind, KINDS[change.kind]))
        parts.append(head.append(f"  {len(change.before)} -> {len(change.after)} states"))
        removed = [*change.removed_states, *change.removed_terms, *change.removed_rows, *change.removed_noises]
        told = [f"removes {', '.join(removed)}"] if removed else []
        told += [change.condition, *(measured(m.name, m.value, m.unit) for m in change.measures)]
        parts += [Padding(Text(line), (0, 0, 0, 3)) for line in told]
    return Group(*parts)


def _equivalence(problem: Problem) -> Table:
    table = _table(
        "equivalence of model and nominal", "operation", "mirrored by", "in model", "computed", "setting", ""
    )
    for c in problem.checks:
        verdict = Text("equivalent", style="green") if c.equivalent else Text("MISMATCH", style="bold red")
        _add(table, c.operation, c.mirror, _yes(c.in_model), _yes(c.computed), c.setting, verdict)
    return table


def _nodes(plan: Plan) -> Table:
    form = "exact" if plan.separation is None else plan.separation.form
    table = _table(f"nodes (cross_covariance: {form})", "node", "states", "measurements")
    for node in plan.subsystems.nodes if plan.subsystems is not None else ():
        measured_by = ", ".join(plan.measurements[j].name for j in node.measurements) or "none"
        _add(table, node.name, brief_labels([plan.states[i] for i in node.states], plan.states), measured_by)
    return table


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _ranks(problem: Problem) -> Table:
    table = _table("observability", "model", "states", "rank at the initial nominal")
    for stage in stages(problem):
        _add(table, stage.name, str(stage.states), str(stage.rank))
    return table
