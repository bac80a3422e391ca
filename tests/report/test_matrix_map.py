"""A matrix over states shows its numbers, its groups and what they are."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle
from PIL import Image

from estimfw.report.matrix_map import MOST, MatrixMap, matrix_map_figure, matrix_map_height, written
from estimfw.report.matrix_picture import draw_matrix, save_matrix
from estimfw.report.shell import chart_block, document


def a_matrix(n: int, *ends: int) -> MatrixMap:
    values = np.abs(np.corrcoef(np.random.default_rng(n).normal(size=(n, 3 * n))))
    return MatrixMap("rho", "Correlations", tuple(f"x[{i}]" for i in range(n)), values, ends or (n,), "|ρ|")


def test_groups_have_borders_and_cells_their_numbers() -> None:
    figure = matrix_map_figure(a_matrix(5, 2, 5))
    assert [(s["x0"], s["x1"]) for s in figure["layout"]["shapes"]] == [(-0.5, 1.5), (1.5, 4.5)]
    assert figure["data"][0]["text"][0][0] == "1" and figure["layout"]["yaxis"]["autorange"] == "reversed"
    json.dumps(figure, allow_nan=False)


def test_many_states_are_not_numbered_and_fit_a_page() -> None:
    matrix = a_matrix(60, 30, 60)
    assert "text" not in matrix_map_figure(matrix)["data"][0]
    assert matrix_map_height(matrix) < MOST + 200


def test_the_page_carries_it_and_escapes_its_names() -> None:
    matrix = MatrixMap("rho", "t", ("north<east", "c"), np.eye(2), (1, 2), "|ρ|")
    text = document("t", "", (), [matrix], "1") + chart_block(matrix, "")
    assert 'id="figure-rho"' in text and "north<east" not in text and 'data-figure="figure-rho"' in text


@pytest.mark.parametrize("n", [2, 10, 100])
def test_the_picture_shows_names_groups_and_scale(n: int, tmp_path: Path) -> None:
    matrix = a_matrix(n, n // 2, n)
    figure = draw_matrix(matrix)
    axes, bar = figure.axes
    assert sum(isinstance(p, Rectangle) for p in axes.patches) == 2
    assert axes.get_yticklabels()[0].get_text() == "x[0]" and len(axes.get_yticks()) <= 60
    assert bar.get_ylabel() == "|ρ|" and figure.get_suptitle() == "Correlations"
    save_matrix(matrix, tmp_path / "m.png")
    with Image.open(tmp_path / "m.png") as image:
        assert min(image.size) > 300


def test_numbers_of_cells_are_short() -> None:
    assert [written(v) for v in (0.0, 0.004, 0.126, 0.9951, 1.0)] == ["", "", ".13", "1", "1"]
