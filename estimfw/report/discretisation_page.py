"""A discretisation study as a page with a chart of the errors over the step."""

from __future__ import annotations

from html import escape

import numpy as np

from estimfw.report.discretisation_tables import (
    EIGENVALUES,
    ERRORS,
    ORDERS,
    SIGMAS,
    eigenvalue_table,
    error_table,
    headline,
    order_table,
    sigma_table,
)
from estimfw.report.markup import note, table
from estimfw.report.palette import SERIES
from estimfw.report.panel import Chart, Curve, Panel
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.discretisation import StudiedFilter
from estimfw.version import __version__

__all__ = ["error_chart", "study_page"]

LEAST = 1e-16
"""Errors below are rounding: they are not drawn."""


def study_page(found: StudiedFilter) -> str:
    """One HTML file, which fetches nothing."""
    chart = error_chart(found)
    first, *bad = headline(found)
    lines = "".join(f"<li>{escape(line)}</li>\n" for line in bad)
    sections = [
        Section("errors", ERRORS, chart_block(chart, "") + table(error_table(found))),
        Section("orders", ORDERS, table(order_table(found))),
        Section("eigenvalues", EIGENVALUES, (f"<ul>\n{lines}</ul>\n" if bad else "") + table(eigenvalue_table(found))),
        Section("sigmas", SIGMAS, table(sigma_table(found)) if found.sigmas else note("The filter was not run.")),
    ]
    title = f"Discretisation: {found.name}"
    header = f"<header>\n<h1>{escape(title)}</h1>\n<p>{escape(first)}</p>\n</header>\n"
    return document(title, header, sections, [chart], __version__)


def error_chart(found: StudiedFilter) -> Chart:
    """Errors over the step, against white noise and against held noise, on two logarithmic axes."""
    study = found.study
    panels = []
    for title, which in (("against white noise", "error"), ("against noise held over the step", "held_error")):
        curves = []
        for place, (one, colour) in enumerate(zip(study.formulas, SERIES, strict=True)):
            values = getattr(one, which)
            drawn = np.where(values > LEAST, values, np.nan)
            if np.isfinite(drawn).any():
                name = SHORT[one.formula.key]
                curves.append(Curve(name, study.steps, drawn, colour, "dashed" if place % 2 else "line"))
        panels.append(Panel(title, "", tuple(curves), logarithmic=True))
    told = "The largest error of an entry of Q, in units of the sigmas that the longest step gives its two states."
    return Chart("errors", "errors", "Error of Q over the step", "s", tuple(panels), told, over="step, s")


SHORT = {
    "first": "first",
    "second": "second",
    "third_printed": "4, 6, 4",
    "third": "4, 8, 4",
    "held_noise": "held noise",
    "van_loan": "Van Loan",
}
"""Names of the curves."""
