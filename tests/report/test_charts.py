"""What is drawn: the truth stays in view, angles have no jumps, and thinning loses no extreme."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from estimfw.report.angles import beside, unwrapped
from estimfw.report.charts import charts_of
from estimfw.report.interactive import plotly_figure
from estimfw.report.panel import Chart, focused
from estimfw.report.pictures import draw
from estimfw.report.write import PICTURED_STATES, write_report

Results = Callable[..., xr.Dataset]
DEG = np.pi / 180


def chart(dataset: xr.Dataset, key: str, limit: int = 4000) -> Chart:
    (found,) = (one for one in charts_of(dataset, limit) if one.key == key)
    return found


def test_a_yaw_that_crosses_the_cut_is_one_curve_beside_its_truth(make_result: Results) -> None:
    result = make_result()
    raw = result["output_value"].to_numpy()[:, 0]
    assert np.abs(np.diff(raw)).max() > np.pi, "the fixture is meant to jump"
    yaw = chart(result, "outputs_attitude").panels[0]
    estimate, truth = yaw.curves
    assert np.abs(np.diff(estimate.values)).max() < 180
    assert np.abs(estimate.values - truth.values).max() < 180
    assert np.isclose(estimate.values[-1], raw[-1] / DEG)
    turns = (estimate.values - raw / DEG) / 360
    assert np.allclose(turns, np.round(turns))
    assert "whole turn" in chart(result, "outputs_attitude").note


def test_angles_that_stay_in_their_range_need_no_note(make_result: Results) -> None:
    result = make_result().isel(output=[1, 2])
    assert "turn" not in chart(result, "outputs_attitude").note


def test_unwrapping_leaves_gaps_alone() -> None:
    angle = np.array([3.0, np.nan, -3.1, np.nan, -3.0])
    np.testing.assert_allclose(unwrapped(angle), [3.0 - 2 * np.pi, np.nan, -3.1, np.nan, -3.0])
    np.testing.assert_allclose(beside(np.array([3.1, 1.0]), np.array([-3.1, np.nan])), [3.1 - 2 * np.pi, 1.0])


def test_the_truth_is_in_view_even_far_outside_of_the_band(make_result: Results) -> None:
    result = make_result()
    result["output_truth"][:, 1] += 20 * DEG
    view = chart(result, "outputs_attitude").panels[1].view
    true = result["output_truth"].to_numpy()[-1, 1] / DEG
    assert view is None or view[0] < true < view[1]


def test_a_start_that_hides_the_end_is_left_out_of_view_and_said(make_result: Results) -> None:
    pitch = chart(make_result(), "output_errors_attitude")
    assert "leave out how the run starts" in pitch.note
    low, high = pitch.panels[1].view or (np.nan, np.nan)
    upper = pitch.panels[1].bands[0].upper
    assert upper[150:].max() < high < upper.max() / 2
    assert -upper.max() / 2 < low < -upper[150:].max()


def test_a_signal_that_only_moves_is_shown_whole() -> None:
    time = np.linspace(0, 100, 200)
    assert focused((time, 0.44 * time), (time, 0.44 * time + 1)) is None
    assert focused((time, np.zeros(200)), (time, np.full(200, 3.0))) is None


def test_thinned_charts_keep_extremes_and_ends_of_a_long_record(make_result: Results) -> None:
    result = make_result(92_000, rate=50.0)
    result["error"][41_234, 0] = 77.0
    result["zero_velocity_innovation"][60_001, 1] = -55.0
    errors = chart(result, "state_errors_velocity_error", 400).panels[0].curves[0]
    assert errors.time.size <= 400
    assert errors.values.max() == 77.0
    assert errors.time[0] == result["time"][0] and errors.time[-1] == result["time"][-1]
    row = chart(result, "innovations_zero_velocity", 400).panels[1]
    assert min(curve.values.min() for curve in row.curves) == -55.0


def test_long_records_count_in_hours(make_result: Results) -> None:
    result = make_result(8000, rate=1.0)
    assert {one.time_unit for one in charts_of(result, 100)} == {"h"}
    assert np.isclose(chart(result, "sigmas", 100).panels[0].curves[0].time[-1], 8000 / 3600)


def test_time_axes_of_all_charts_are_one(make_result: Results) -> None:
    """NIS starts with the first measurement, its windowed mean later still: the axes do not."""
    assert {one.span for one in charts_of(make_result(), 4000)} == {(-5.99, 605.99)}
    late = make_result().assign_coords(time=make_result()["time"] + 1000.0)
    assert {one.span for one in charts_of(late, 4000)} == {(1001.0 - 5.99, 1600.0 + 5.99)}


def test_bands_of_95_and_of_99_percent_have_the_colours_of_their_bounds(make_result: Results) -> None:
    each, mean = chart(make_result(), "nis_zero_velocity").panels
    bounds = {curve.name[:4]: curve.colour for curve in each.curves if "bound" in curve.name}
    bands = {band.name[:4]: band.colour[:7] for band in mean.bands}
    assert bands == bounds and len(set(bands.values())) == 2


def test_what_the_result_lacks_is_not_drawn(make_result: Results) -> None:
    bare = make_result(truth=False, outputs=False, sigma=False, measurements=())
    assert {one.section for one in charts_of(bare, 4000)} == {"states"}
    assert (
        charts_of(make_result(states=False, outputs=True, truth=False, measurements=()), 4000)[0].section == "outputs"
    )


def test_every_disposition_has_its_own_mark(make_result: Results) -> None:
    row = chart(make_result(), "innovations_zero_velocity").panels[0]
    styles = {curve.name: curve.style for curve in row.curves}
    assert styles == {"fused": "dots", "gated": "crosses", "late": "crosses"}
    assert len({curve.colour for curve in row.curves}) == 3


def test_largest_sets_of_states_are_split_into_readable_charts(make_result: Results) -> None:
    many = make_result()
    wide = xr.concat([many.drop_vars([v for v in many.variables if "state" not in many[v].dims])] * 4, dim="state")
    wide = wide.assign_coords(state=[f"clock[{k}]" for k in range(28)], time=many["time"])
    wide["state_display_unit"] = ("state", ["m"] * 28)
    wide["state_display_scale"] = ("state", np.ones(28))
    charts = charts_of(wide, 500)
    assert max(len(one.panels) for one in charts) <= 6
    assert sum(len(one.panels) for one in charts if one.section == "states") == 28
    assert len({one.key for one in charts}) == len(charts)


def test_east_and_north_are_drawn_as_a_map_to_one_scale(make_result: Results) -> None:
    result = make_result().isel(output=[1, 2]).assign_coords(output=["track.east", "track.north"])
    drawn = chart(result, "map_track")
    assert drawn.horizontal == "east, deg" and drawn.panels[0].unit == "north, deg" and drawn.span is None
    estimate, truth = drawn.panels[0].curves
    east, north = result["output_value"].to_numpy()[-1] / DEG
    assert np.isclose(estimate.time[-1], east) and np.isclose(estimate.values[-1], north)
    assert np.isfinite(truth.values).all()
    (axes,) = draw(drawn).axes
    assert axes.get_aspect() == 1.0 and axes.get_xlabel() == "east, deg"
    layout = plotly_figure(drawn)["layout"]
    assert layout["yaxis"]["scaleanchor"] == "x" and layout["xaxis"]["title"]["text"] == "east, deg"


def test_a_smoother_is_drawn_beside_the_filter(make_result: Results) -> None:
    plain = make_result()
    both = plain.assign(
        {
            f"smoothed{part}": plain[name] * 0.5
            for part, name in (("", "estimate"), ("_sigma", "sigma"), ("_error", "error"))
        }
    )
    values, errors = (chart(both, key).panels[0] for key in ("states_attitude_error", "state_errors_attitude_error"))
    assert [curve.name for curve in values.curves] == ["estimate", "smoothed", "truth"]
    assert [curve.name for curve in errors.curves] == ["estimate − truth", "smoothed − truth"]
    assert [band.name for band in errors.bands][-1] == "±3σ smoothed"
    np.testing.assert_allclose(errors.bands[-1].upper, 0.5 * errors.bands[-2].upper)
    (sigmas,) = (one for one in charts_of(both, 4000) if one.key == "sigmas")
    assert "Dashed: the smoothed ones" in sigmas.note
    panel = next(one for one in sigmas.panels if "attitude_error" in one.title)
    assert {curve.style for curve in panel.curves if curve.name.endswith("smoothed")} == {"dashed"}
    outputs = chart(both, "outputs_attitude").panels[0]
    assert [curve.name for curve in outputs.curves] == ["estimate", "truth"]
    assert not [c for one in charts_of(plain, 4000) for p in one.panels for c in p.curves if "smoothed" in c.name]


def many(make_result: Results, copies: int) -> xr.Dataset:
    """The first state, ``copies`` times, as the axes of one block."""
    result = make_result(outputs=False)
    wide = result.isel(state=[0] * copies)
    return wide.assign_coords(state=[f"velocity_error[m{i + 1}]" for i in range(copies)])


def test_a_block_of_ten_has_one_panel_of_sigmas_and_no_two_curves_alike(make_result: Results) -> None:
    (panel,) = chart(many(make_result, 10), "sigmas").panels
    assert len(panel.curves) == len({(curve.colour, curve.style) for curve in panel.curves}) == 10


def test_a_block_too_large_for_a_panel_is_cut_evenly_and_says_where(make_result: Results) -> None:
    panels = chart(many(make_result, 14), "sigmas").panels
    assert [len(panel.curves) for panel in panels] == [7, 7]
    assert [panel.title for panel in panels] == ["σ of velocity_error: m1 to m7", "σ of velocity_error: m8 to m14"]


def test_pictures_of_very_many_states_are_left_to_the_page(make_result: Results, tmp_path: Path) -> None:
    few, lots = (write_report(many(make_result, n), tmp_path / str(n)) for n in (PICTURED_STATES, PICTURED_STATES + 1))
    assert any(path.name.startswith("states_") for path in few)
    names = {path.name for path in lots}
    assert "sigmas.png" in names and not any(name.startswith("state") for name in names)
    assert "velocity_error[m49]" in (tmp_path / str(PICTURED_STATES + 1) / "report.html").read_text()
