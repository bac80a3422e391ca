"""What the terminal shows after a run fits it and hides nothing that matters."""

from __future__ import annotations

import json
from collections.abc import Callable
from io import StringIO

import numpy as np
import pytest
import xarray as xr
from rich.console import Console

from estimfw.report.terminal import print_result

Results = Callable[..., xr.Dataset]


def printed(dataset: xr.Dataset, width: int, *, at_end: bool = True) -> str:
    out = StringIO()
    print_result(dataset, Console(file=out, width=width), at_end=at_end)
    return out.getvalue()


@pytest.mark.parametrize("width", [80, 200])
def test_every_label_is_whole_at_any_usual_width(make_result: Results, width: int) -> None:
    dataset = make_result()
    text = printed(dataset, width)
    assert "…" not in text
    for label in (*dataset["state"].to_numpy(), *dataset["output"].to_numpy(), "zero_velocity", "expected", "verdict"):
        assert str(label) in text
    assert all(len(line) <= width for line in text.splitlines())


def test_the_attitude_comes_first_with_its_sigma_and_its_error(make_result: Results) -> None:
    lines = printed(make_result(), 100).splitlines()
    assert lines[0] == "static alignment, reduced to 7 states"
    assert any(line.split()[0] == "yaw" and "°" in line and "±" in line and "error" in line for line in lines[1:4])


def test_mismatch_and_approximation_are_told_before_the_numbers(make_result: Results) -> None:
    text = " ".join(printed(make_result(), 100).split())
    assert text.index("do not match") < text.index("At the end")
    assert text.index("The sigmas are the reduced filter's own") < text.index("At the end")


def test_what_contradicts_the_filter_stands_between_the_headline_and_the_numbers(make_result: Results) -> None:
    dataset = make_result()
    dataset["zero_velocity_nis"] = dataset["zero_velocity_nis"] * 10
    text = " ".join(printed(dataset, 100).split())
    assert text.index("heading") < text.index("caution: the mean NIS of zero_velocity") < text.index("At the end")


def test_a_start_that_was_found_is_told_with_the_attitude_of_the_first_step(make_result: Results) -> None:
    dataset = make_result()
    assert "start:" not in printed(dataset, 200)
    facts = {"start": "inertial-frame alignment over 120 s", "start_found": True}
    found = dataset.assign_attrs(provenance=json.dumps(facts))
    (line,) = [line for line in printed(found, 200).splitlines() if line.startswith("start: ")]
    assert line.startswith("start: inertial-frame alignment over 120 s: yaw ") and ", pitch " in line
    first = np.degrees(float(dataset["output_sigma"].sel(output="attitude.pitch")[0]))
    assert float(line.split("pitch ")[1].split("± ")[1].split("°")[0]) == pytest.approx(first, rel=0.05)


def test_dispositions_that_never_were_take_no_column(make_result: Results) -> None:
    text = printed(make_result(), 100)
    assert all(word in text for word in ("fused", "gated", "late", "missing"))
    assert "invalid" not in text
    dataset = make_result(50)
    assert "gated" not in printed(dataset.drop_vars([v for v in dataset if str(v).startswith("event")]), 100)


def test_the_heading_says_which_instant(make_result: Results) -> None:
    assert "At the end, 600 s" in printed(make_result(), 100)
    late = make_result()
    late = late.assign_coords(time=late["time"] + 13805.0)
    assert "At the end, 14\u2009405 s" in printed(late, 100)
    assert "At 300 s" in printed(make_result().isel(time=slice(None, 300)), 100, at_end=False)


def test_what_rounds_to_zero_has_no_sign(make_result: Results) -> None:
    dataset = make_result(truth=False)
    dataset["estimate"][-1, 0] = -1e-9
    line = next(one for one in printed(dataset, 100).splitlines() if one.startswith("velocity_error[E]"))
    assert float(line.split()[1]) == 0 and not line.split()[1].startswith("-")


def test_an_error_beyond_three_sigma_stands_out(make_result: Results) -> None:
    dataset = make_result()
    dataset["error"][-1, 0] = 5 * float(dataset["sigma"][-1, 0])
    out = StringIO()
    print_result(dataset, Console(file=out, width=120, force_terminal=True, color_system="standard"))
    line = next(one for one in out.getvalue().splitlines() if "velocity_error[E]" in one)
    assert "\x1b[1;31m5.0" in line.replace(" ", "")
    assert np.isfinite(dataset["sigma"][-1, 0])
