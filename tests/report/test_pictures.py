"""Pictures say what they show: titles, units, legends, ticks that can be read; the same result makes the same file."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, pairwise
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

from estimfw.report.charts import charts_of
from estimfw.report.panel import Chart, Curve, Panel
from estimfw.report.pictures import STYLE, draw, save_picture

Results = Callable[..., xr.Dataset]


def drawn(chart: Chart) -> Figure:
    with matplotlib.rc_context(STYLE):
        figure = draw(chart)
        FigureCanvasAgg(figure).draw()
    return figure


def title_box(axes: Axes) -> Bbox:
    texts = [child for child in axes.get_children() if isinstance(child, Text)]
    (title,) = (text for text in texts if text.get_text() == axes.get_title(loc="left"))
    return title.get_window_extent()


def shown_ticks(axes: Axes) -> list[tuple[str, Bbox]]:
    low, high = sorted(axes.get_ylim())
    ticks = zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)
    return [(label.get_text(), label.get_window_extent()) for at, label in ticks if low <= at <= high]


def one_panel(values: np.ndarray, *, logarithmic: bool = False, title: str = "pitch") -> Chart:
    curve = Curve("estimate", np.arange(values.size, dtype=float), values, "#0072b2")
    return Chart("key", "outputs", "Attitude", "s", (Panel(title, "deg", (curve,), logarithmic=logarithmic),))


@pytest.fixture(scope="module")
def charts(make_result: Results) -> tuple[Chart, ...]:
    return charts_of(make_result(measurements=("zero_velocity", "odometer")), 4000)


def test_every_quantity_has_its_picture(charts: tuple[Chart, ...]) -> None:
    keys = {chart.key for chart in charts}
    for group in ("velocity_error", "attitude_error", "gyro_bias"):
        assert {f"states_{group}", f"state_errors_{group}"} <= keys
    assert {"outputs_attitude", "output_errors_attitude", "sigmas"} <= keys
    for name in ("zero_velocity", "odometer"):
        assert {f"innovations_{name}", f"nis_{name}"} <= keys
    assert len(keys) == len(charts)


def test_each_picture_has_a_title_and_each_axes_a_title_and_a_unit(charts: tuple[Chart, ...]) -> None:
    for chart in charts:
        figure = drawn(chart)
        assert figure.get_suptitle() == chart.title
        assert figure.axes[-1].get_xlabel() == "time, s"
        assert [axes.get_title(loc="left") for axes in figure.axes] == [panel.title for panel in chart.panels]
        assert all(axes.get_ylabel() for axes in figure.axes)
        assert figure.axes[0].get_legend() is not None


def test_units_and_bounds_are_those_of_the_result(charts: tuple[Chart, ...]) -> None:
    by_key = {chart.key: drawn(chart) for chart in charts}
    assert [axes.get_ylabel() for axes in by_key["outputs_attitude"].axes] == ["deg"] * 4
    assert [axes.get_ylabel() for axes in by_key["innovations_zero_velocity"].axes] == ["m/s"] * 2
    assert {axes.get_ylabel() for axes in by_key["sigmas"].axes} == {"deg", "m/s", "deg/h"}
    legend = by_key["outputs_attitude"].axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["±3σ", "estimate", "truth"]
    (first, *_) = by_key["innovations_zero_velocity"].axes
    assert first.get_title(loc="left") == "zero_velocity[E]"


def test_nothing_overlaps_and_nothing_leaves_the_picture(charts: tuple[Chart, ...]) -> None:
    for chart in charts:
        figure = drawn(chart)
        width, height = figure.bbox.width, figure.bbox.height
        for axes in figure.axes:
            ticks = shown_ticks(axes)
            assert len({text for text, _ in ticks}) == len(ticks) >= 2, (chart.key, ticks)
            assert not any(a.overlaps(b) for (_, a), (_, b) in combinations(ticks, 2)), chart.key
            label = axes.yaxis.label.get_window_extent()
            assert not any(label.overlaps(box) for _, box in ticks)
            title, legend = title_box(axes), axes.get_legend()
            boxes = [label, title, *(box for _, box in ticks), *([legend.get_window_extent()] if legend else [])]
            assert all(b.x0 >= 0 and b.y0 >= 0 and b.x1 <= width and b.y1 <= height for b in boxes), chart.key
            assert legend is None or not legend.get_window_extent().overlaps(title)
        for above, below in pairwise(figure.axes):
            assert above.get_position().y0 > below.get_position().y1


@pytest.mark.parametrize(
    "values",
    [4.5e6 + np.linspace(0, 1e-3, 50), np.linspace(-1e-9, 2e-9, 50), np.linspace(0, 3e12, 50), np.full(50, 0.25),
     -359.9 + np.linspace(0, 1e-5, 50)],
)  # fmt: skip
def test_odd_ranges_keep_distinct_ticks_beside_their_label(values: np.ndarray) -> None:
    (axes,) = drawn(one_panel(values)).axes
    ticks = shown_ticks(axes)
    assert len({text for text, _ in ticks}) == len(ticks) >= 2
    label = axes.yaxis.label.get_window_extent()
    assert label.x0 >= 0
    assert not any(label.overlaps(box) for _, box in ticks)


@pytest.mark.parametrize(("low", "high"), [(0.023, 0.03), (0.01, 0.1), (0.005, 0.9), (1e-6, 30.0), (2e-15, 5e9)])
def test_logarithmic_ticks_are_few_and_written_in_full(low: float, high: float) -> None:
    (axes,) = drawn(one_panel(np.geomspace(low, high, 60), logarithmic=True)).axes
    texts = [text for text, _ in shown_ticks(axes)]
    assert 2 <= len(set(texts)) == len(texts) <= 9
    assert not any("e" in text for text in texts)


def test_notes_stand_in_the_picture_below_the_title_and_above_all_axes(charts: tuple[Chart, ...]) -> None:
    noted = [chart for chart in charts if chart.note]
    assert noted
    for chart in noted:
        figure = drawn(chart)
        (note,) = [text for text in figure.texts if text.get_text().startswith(chart.note[:20])]
        assert " ".join(note.get_text().split()) == chart.note
        box = note.get_window_extent()
        assert box.x1 <= figure.bbox.width
        tops = [title_box(figure.axes[0]).y1]
        legend = figure.axes[0].get_legend()
        tops += [legend.get_window_extent().y1] if legend else []
        assert box.y0 >= max(tops), chart.key


def test_a_dollar_in_a_label_begins_no_formula() -> None:
    figure = drawn(one_panel(np.arange(3.0), title="cost $ and $x"))
    assert figure.axes[0].get_title(loc="left") == r"cost \$ and \$x"


def test_the_same_chart_makes_the_same_file(charts: tuple[Chart, ...], tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        save_picture(charts[0], tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size[0] == 1350
        colours = picture.getcolors(1 << 24)
    assert colours is not None and len(colours) > 20


def test_drawing_leaves_the_settings_of_matplotlib_alone(charts: tuple[Chart, ...], tmp_path: Path) -> None:
    before = dict(matplotlib.rcParams)
    save_picture(charts[0], tmp_path / "a.png")
    assert dict(matplotlib.rcParams) == before


def test_dashes_lie_above_the_lines_of_equal_sigmas(charts: tuple[Chart, ...]) -> None:
    (sigmas,) = (one for one in charts if one.key == "sigmas")
    levels: dict[str, set[float]] = {}
    for axes in drawn(sigmas).axes:
        for line in axes.get_lines():
            levels.setdefault(str(line.get_linestyle()), set()).add(line.get_zorder())
    assert min(levels["--"]) > max(levels["-"])
