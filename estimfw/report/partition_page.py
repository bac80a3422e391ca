"""A partition as a page, and its matrix as a picture."""

from __future__ import annotations

from functools import partial
from html import escape
from pathlib import Path

import numpy as np

from estimfw.report.markup import note, table
from estimfw.report.matrix_map import MatrixMap
from estimfw.report.partition_tables import (
    EXACT,
    MEASURES,
    advice,
    basis_texts,
    group_table,
    nodes_yaml,
    objective_text,
    price_table,
    same_cut,
    warning_texts,
)
from estimfw.report.shell import Section, chart_block, document
from estimfw.run.files import refuse_existing, write_atomically, write_text
from estimfw.run.partition import PartitionBy, Partitioned
from estimfw.version import __version__

__all__ = ["correlation_map", "partition_page", "write_partition"]


def correlation_map(found: Partitioned, by: PartitionBy) -> MatrixMap:
    """|rho| with the states in the order of the groups."""
    order = [i for group in by.cut.groups for i in group]
    return MatrixMap(
        key=f"correlation_by_{by.measure}",
        title=f"Correlations at {found.time:.10g} s, groups by {MEASURES[by.measure]}",
        labels=tuple(found.states[i] for i in order),
        values=np.abs(found.correlation[np.ix_(order, order)]),
        ends=tuple(int(e) for e in np.cumsum([len(g) for g in by.cut.groups])),
        scale="|ρ|",
    )


def _shown(found: Partitioned) -> list[PartitionBy]:
    return [found.by_correlation] if same_cut(found) else [found.by_correlation, found.by_coupling]


def partition_page(found: Partitioned) -> str:
    """One HTML file, which fetches nothing."""
    maps = [correlation_map(found, by) for by in _shown(found)]
    sections = []
    for by, matrix in zip(_shown(found), maps, strict=True):
        name = MEASURES[by.measure]
        body = table(group_table(by)) + note(objective_text(by, found.states)) + chart_block(matrix, "")
        sections.append(Section(by.measure, f"Groups by {name}", body))
    finding = table(price_table(found)) if found.by_correlation.prices else ""
    told = f"<p>{escape(EXACT)}</p>\n{finding}<p><strong>{escape(advice(found))}</strong></p>\n"
    sections.append(Section("price", "What neglecting the covariances between groups costs", told))
    pasted = "".join(
        f"{note(f'groups by {MEASURES[by.measure]}')}<pre><code>{escape(nodes_yaml(by))}</code></pre>\n"
        for by in _shown(found)
    )
    sections.append(Section("nodes", "To paste into the config", pasted))
    lines = "".join(f"<p>{escape(text)}</p>\n" for text in basis_texts(found))
    lines += "".join(f'<p class="tone warn">{escape(text)}</p>\n' for text in warning_texts(found))
    title = f"Partition: {found.name}"
    header = f"<header>\n<h1>{escape(title)}</h1>\n{lines}</header>\n"
    return document(title, header, sections, maps, __version__)


def write_partition(found: Partitioned, page: Path, *, force: bool = False) -> list[Path]:
    """Write the page and, beside it, a picture ``PAGE_correlation.png`` (and ``PAGE_coupling.png``) of |rho| in each order.

    Raises
    ------
    DataError
        A file exists, or cannot be written.
    """
    from estimfw.report.matrix_picture import save_matrix

    pictures = {page.with_name(f"{page.stem}_{by.measure}.png"): correlation_map(found, by) for by in _shown(found)}
    for path in (page, *pictures):
        refuse_existing(path, force=force)
    written = [write_text(page, partition_page(found), force=force)]
    for path, matrix in pictures.items():
        written.append(write_atomically(path, partial(save_matrix, matrix), force=force))
    return written
