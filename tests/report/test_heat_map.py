"""The heat map says what it shows, and leaves out what is not known."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr

from estimfw.report.degree_map import degree_map
from estimfw.report.heat_map import COLUMNS, HeatMap, heat_map_figure, heat_map_height
from estimfw.report.page import page


def a_map(values: np.ndarray) -> HeatMap:
    steps, states = values.shape
    return HeatMap("degrees", "t", tuple(f"x[{i}]" for i in range(states)), np.arange(steps, dtype=float), "h", values)


def test_colours_are_logarithmic_and_numbers_are_the_ratios() -> None:
    trace = heat_map_figure(a_map(np.array([[1.0, 0.01], [0.1, 2.0]])))["data"][0]
    assert trace["z"] == [[0.0, -1.0], [-2.0, float(f"{math.log10(2.0):.3g}")]]
    assert trace["customdata"] == [[1.0, 0.1], [0.01, 2.0]]
    assert (trace["zmin"], trace["zmax"]) == (-2, 0)
    assert trace["colorbar"]["ticktext"] == ["0.01", "0.1", "1"]


def test_unknown_and_zero_are_gaps_that_json_can_carry() -> None:
    figure = heat_map_figure(a_map(np.array([[np.nan, 0.0], [0.5, np.inf]])))
    assert figure["data"][0]["z"][1] == [None, None]
    assert figure["data"][0]["z"][0][0] is None
    json.dumps(figure, allow_nan=False)


def test_axes_have_units_and_states_read_from_above() -> None:
    layout = heat_map_figure(a_map(np.ones((3, 2))))["layout"]
    assert layout["xaxis"]["title"]["text"] == "time, h"
    assert layout["yaxis"]["autorange"] == "reversed"


def test_a_long_record_is_thinned_and_keeps_its_ends() -> None:
    x = heat_map_figure(a_map(np.ones((5000, 1))))["data"][0]["x"]
    assert len(x) == COLUMNS and x[0] == 0.0 and x[-1] == 4999.0


def test_more_states_are_taller() -> None:
    assert heat_map_height(a_map(np.ones((2, 30)))) > heat_map_height(a_map(np.ones((2, 12))))


def result(with_prior: bool) -> xr.Dataset:
    state = ["x", "k"]
    made = xr.Dataset(
        {"estimate": (("time", "state"), np.zeros((3, 2))), "sigma": (("time", "state"), [[2.0, 0.0], [1.0, 0.0], [0.5, 0.0]])},
        {
            "time": [1.0, 2.0, 3.0], "state": state, "state_unit": ("state", ["m", "m"]),
            "state_display_unit": ("state", ["m", "m"]), "state_display_scale": ("state", [1.0, 1.0]),
        },
        {"title": "t"},
    )  # fmt: skip
    return made.assign(prior_sigma=("state", [4.0, 0.0])) if with_prior else made


def test_a_result_shows_sigma_over_prior_sigma() -> None:
    heat = degree_map(result(True))
    assert heat is not None
    assert heat.values[:, 0].tolist() == [0.5, 0.25, 0.125] and np.isnan(heat.values[:, 1]).all()
    assert '"type":"heatmap"' in page(result(True))


def test_an_older_result_without_prior_sigmas_has_none() -> None:
    assert degree_map(result(False)) is None
    assert '"type":"heatmap"' not in page(result(False))
