"""A discretisation study as sentences and tables, for the terminal and for the page alike, and as JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimfw.report.numbers import UNKNOWN, instant, plain
from estimfw.report.tables import Cell, Table
from estimfw.run.discretisation import StudiedFilter

__all__ = [
    "EIGENVALUES",
    "ERRORS",
    "ORDERS",
    "SIGMAS",
    "eigenvalue_table",
    "error_table",
    "headline",
    "order_table",
    "sigma_table",
    "study_json",
]

ORDERS, ERRORS, EIGENVALUES = "Orders of convergence", "Error of Q", "Smallest eigenvalue of Q"
SIGMAS = "What it does to the filter's sigmas"

NOTHING = 1e-9
"""A change of sigma or an eigenvalue below this is rounding."""

WRONG, RIGHT = 0.1, 1e-3
"""Errors of Q above and below which a table says so in colour."""


def headline(found: StudiedFilter) -> list[str]:
    """What to know: at which operating point, which formulas are no covariance where, and what the config uses."""
    told = [f"process noise of a step, at {found.where}; the config uses: {found.own}"]
    for one in found.study.formulas:
        bad = [
            f"{plain(t)} s"
            for t, wrong in zip(found.study.steps.tolist(), one.indefinite.tolist(), strict=True)
            if wrong
        ]
        if bad:
            told.append(f"no covariance (a negative eigenvalue): {one.formula.text}, at steps of {', '.join(bad)}")
    return told


def order_table(found: StudiedFilter) -> Table:
    """With which power of the step each formula gets better."""
    rows = tuple(
        (Cell(one.formula.text), Cell(_order(one.order)), Cell(_order(one.held_order))) for one in found.study.formulas
    )
    note = (
        "the power of the step with which the largest error of Q falls, measured between a step and half of it; "
        f"{UNKNOWN}: nothing but rounding is left"
    )
    return Table(("formula", "against white noise", "against held noise"), rows, frozenset({1, 2}), note)


def error_table(found: StudiedFilter) -> Table:
    """How large the error of Q is beside Q itself."""
    rows = tuple((Cell(one.formula.text), *map(_error, one.own_error.tolist())) for one in found.study.formulas)
    note = "largest error of an entry against white noise, in units of the exact sigmas of the step: 1 is as large as Q itself"
    return Table(("formula", *_steps(found)), rows, _numeric(found), note)


def eigenvalue_table(found: StudiedFilter) -> Table:
    """Whether Q is a covariance."""
    rows = tuple(
        (
            Cell(one.formula.text),
            *(_eigenvalue(v, bad) for v, bad in zip(one.eigenvalue.tolist(), one.indefinite.tolist(), strict=True)),
        )
        for one in found.study.formulas
    )
    note = "in units of the exact sigmas of the step; a negative one: Q is no covariance. States without noise are left out"
    return Table(("formula", *_steps(found)), rows, _numeric(found), note)


def sigma_table(found: StudiedFilter) -> Table:
    """What the choice does to the filter's sigmas along its record."""
    names = {one.formula.key: one.formula.text for one in found.study.formulas}
    rows = tuple(
        (
            Cell(names[one.key]),
            Cell(_change(one.largest)),
            Cell(one.state if one.largest > NOTHING else UNKNOWN),
            Cell(instant(one.time) if one.largest > NOTHING else UNKNOWN),
            Cell(_change(one.end)),
        )
        for one in found.sigmas
    )
    head = ("formula", "largest change of a sigma", "of", "at, s", "largest at the end")
    note = "relative, against Van Loan, over the record that the config has; Phi is exact in all of them"
    return Table(head, rows, frozenset({1, 3, 4}), note if rows else "")


def study_json(found: StudiedFilter) -> dict[str, Any]:
    """The answer for machines; what is unknown is null."""
    study = found.study
    return {
        "name": found.name,
        "at": found.where,
        "configured": found.own,
        "states": list(study.states),
        "steps": study.steps.tolist(),
        "sigma": study.sigma.tolist(),
        "formulas": [
            {
                "key": one.formula.key,
                "text": one.formula.text,
                "order": _known(one.order),
                "held_order": _known(one.held_order),
                "error": one.error.tolist(),
                "held_error": one.held_error.tolist(),
                "own_error": one.own_error.tolist(),
                "eigenvalue": one.eigenvalue.tolist(),
                "indefinite": one.indefinite.tolist(),
            }
            for one in study.formulas
        ],
        "sigmas": [
            {
                "key": one.key,
                "largest": _known(one.largest),
                "state": one.state,
                "time": one.time,
                "end": _known(one.end),
            }
            for one in found.sigmas
        ],
    }


def _steps(found: StudiedFilter) -> list[str]:
    return [f"{plain(t)} s" for t in found.study.steps.tolist()]


def _numeric(found: StudiedFilter) -> frozenset[int]:
    return frozenset(range(1, 1 + found.study.steps.size))


def _order(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else UNKNOWN


def _error(value: float) -> Cell:
    return Cell(f"{value:.2g}", "bad" if value > WRONG else "good" if value < RIGHT else "")


def _eigenvalue(value: float, bad: bool) -> Cell:
    return Cell("0" if abs(value) < NOTHING else f"{value:.3g}", "bad" if bad else "")


def _change(value: float) -> str:
    return "none" if value <= NOTHING else f"{value:.1e}" if np.isfinite(value) else UNKNOWN


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
