"""The filter in two nodes is the filter: what a comparison tells of them, and the paper's count of multiplications."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.config.generic.components import core_components
from estimfw.errors import ConfigError
from estimfw.registry.load import load_plugins
from estimfw.report.price_apart import apart_from_first, apart_table
from estimfw.report.price_overlays import overlay_charts
from estimfw.report.price_page import price_page
from estimfw.run.compare import Comparison, compare
from estimfw.run.contenders import from_configs, grid
from estimfw.run.run import run_problem

Open = Callable[..., Problem]

EXAMPLES = Path(__file__).parents[3] / "examples"
PAIR = (EXAMPLES / "gravimeter.yaml", EXAMPLES / "gravimeter_decentralised.yaml")


@pytest.fixture(scope="module")
def pair() -> Comparison:
    return compare(from_configs(PAIR, ()), grid(()), load_plugins(core_components()), repeats=1)


def test_over_20_minutes_both_are_one_filter(pair: Comparison) -> None:
    (apart,) = apart_from_first(pair)
    assert apart.states == 10 and apart.same
    assert apart.estimate < 1e-9 and apart.sigma < 1e-9


def test_the_count_of_the_paper(pair: Comparison) -> None:
    """2162 multiplications against 3628 of the textbook filter, 60 %; against a filter that keeps P symmetric more, not less."""
    work = pair.filters[1].work
    assert work is not None and work.cut is not None and pair.filters[0].work is None
    nodes = work.cut.products("decentralised")
    assert (nodes, work.products("textbook"), work.products("symmetric")) == (2162, 3628, 2040)
    assert f"{100.0 * nodes / work.products('textbook'):.1f}" == "59.6"
    assert pair.filters[1].cost.as_run == nodes
    assert all(form.counted in (None, form.products) for form in work.forms)


def test_the_page_shows_both_on_top_of_each_other(pair: Comparison) -> None:
    charts = overlay_charts(pair, 200)
    assert [c.key for c in charts] == ["estimates", "estimates_2", "sigmas", "sigmas_2"]
    panels = [panel for chart in charts for panel in chart.panels]
    assert len(panels) == 20
    first = panels[2]
    assert first.title == "attitude_error[E]" and first.unit == "arcmin"
    assert [(c.name, c.style) for c in first.curves] == [
        ("gravimeter", "line"), ("gravimeter_decentralised", "dashed"), ("truth", "dotted"),
    ]  # fmt: skip
    assert "are one filter" in charts[0].note
    page = price_page(pair, ())
    assert "On top of each other" in page and "the same filter" in page and "59.6 %" in page


def test_neglecting_what_is_between_the_nodes_is_another_filter() -> None:
    """A short run: sigmas that fall below the true ones, which stand beside them."""
    words = ("source.duration=300 s",)
    both = from_configs(PAIR, words)
    lossy = replace(both[1], overrides=(*words, "estimator.cross_covariance=drop"))
    found = compare((both[0], lossy), grid(()), load_plugins(core_components()), repeats=1)
    (apart,) = apart_from_first(found)
    assert not apart.same and apart.estimate > 1.0
    table = apart_table(found)
    assert table is not None and table.rows[0][-1].text == ""
    assert overlay_charts(found, 100)[0].note.count("one filter") == 0


def test_two_positions_in_two_nodes(opened: Open) -> None:
    """A transition that changes at 600 s goes through the nodes as through the one filter."""
    turned = "nominal={kind: platform_gravimeter.platform, positions: [{alpha: 30 deg}, {time: 600 s, alpha: 120 deg}]}"
    whole = run_problem(opened("gravimeter_two_positions"))
    nodes = run_problem(opened("gravimeter_decentralised", turned, "nominal.alpha=null"), record=whole.prepared.record)
    assert np.max(np.abs(nodes.estimate - whole.estimate) / whole.sigma) < 1e-9
    np.testing.assert_allclose(nodes.sigma, whole.sigma, rtol=1e-9)


def test_filters_of_platforms_that_are_turned_otherwise_share_no_record() -> None:
    """The record is that of a platform which stands as the first one says."""
    both = from_configs((PAIR[0], EXAMPLES / "gravimeter_two_positions.yaml"), ())
    with pytest.raises(ConfigError, match="'nominal' of gravimeter_two_positions is not that of gravimeter"):
        compare(both, grid(()), load_plugins(core_components()), repeats=1)
