"""The page stands alone, stays small, and says everything that the result knows."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from estimfw.report.page import page

Results = Callable[..., xr.Dataset]
DEG = np.pi / 180
LIMIT = 10_000_000


class Read(HTMLParser):
    """Tags with attributes, texts by the heading of their section, and the JSON blocks."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.sections: dict[str, str] = {}
        self.data: dict[str, Any] = {}
        self._inside, self._heading = [""], ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in ("meta", "br"):
            self._inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        self._inside.pop()

    def handle_data(self, data: str) -> None:
        _, attributes = self.tags[-1] if self.tags else ("", {})
        if self._inside[-1] == "h2":
            self._heading = data
        elif self._inside[-1] == "script" and attributes.get("type") == "application/json":
            self.data[str(attributes["id"])] = json.loads(data)
        elif self._inside[-1] not in ("script", "style"):
            self.sections[self._heading] = self.sections.get(self._heading, "") + data


def unpacked(array: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype={"f4": "<f4", "f8": "<f8"}[array["dtype"]])


@pytest.fixture(scope="module")
def result(make_result: Results) -> xr.Dataset:
    return make_result()


@pytest.fixture(scope="module")
def html(result: xr.Dataset) -> str:
    return page(result)


@pytest.fixture(scope="module")
def read(html: str) -> Read:
    return Read(html)


def test_nothing_is_loaded_from_anywhere(html: str, read: Read) -> None:
    for tag, attributes in read.tags:
        assert tag not in ("link", "img", "iframe", "object", "embed", "base", "form")
        assert "src" not in attributes and "srcset" not in attributes
        assert (attributes.get("href") or "#").startswith("#")
    (style,) = re.findall(r"<style>(.*?)</style>", html, re.S)
    assert "url(" not in style and "@import" not in style


def test_the_browser_is_told_to_fetch_nothing_whatever_the_scripts_try(read: Read) -> None:
    (rule,) = (a["content"] or "" for tag, a in read.tags if a.get("http-equiv") == "Content-Security-Policy")
    allowed = dict(part.strip().split(" ", 1) for part in rule.split(";"))
    assert allowed["default-src"] == "'none'"
    assert "connect-src" not in allowed
    assert not re.search(r"https?:|\*", rule)


def test_every_part_of_the_result_has_its_section(read: Read) -> None:
    for title in (
        "At the end", "Convergence of the outputs", "Errors of the outputs", "States", "Errors of the states",
        "Standard deviations", "Innovations", "Consistency (NIS)", "What became of the measurements", "Events", "Policies",
        "Equivalence of model and mechanization", "Provenance",
    ):  # fmt: skip
        assert title in read.sections
    links = {a["href"] for tag, a in read.tags if tag == "a"}
    assert links == {f"#{a['id']}" for tag, a in read.tags if tag == "section"}


def test_tables_say_what_the_result_says(read: Read, result: xr.Dataset) -> None:
    end = read.sections["At the end"]
    for label in (*result["state"].to_numpy(), *result["output"].to_numpy()):
        assert str(label) in end
    measurements = read.sections["What became of the measurements"]
    assert all(word in measurements for word in ("fused", "gated", "late", "missing", "invalid", "verdict"))
    events = read.sections["Events"]
    assert "NIS 31.2 over 13.8 (99.9 %)" in events and "gap of 4.0 s" in events
    policies = read.sections["Policies"]
    assert "sins_static.prune_unobservable" in policies and "10 → 7" in policies and "accel_bias[E]" in policies
    assert "heading changes by 0.0004 deg" in policies
    equivalence = read.sections["Equivalence of model and mechanization"]
    assert "coriolis" in equivalence and "mismatch" in equivalence and "allow_mismatch" in equivalence


def test_provenance_is_enough_to_run_it_again(read: Read) -> None:
    provenance = read.sections["Provenance"]
    for fact in ("9f" * 32, "ab" * 32, "cd" * 32, "ef" * 32, "2.4.6", "numpy", "ud", "34 deg", "filter.yaml"):
        assert fact in provenance
    assert re.search(r"seed\s*7", provenance)


def test_a_mismatch_and_the_limits_of_the_sigmas_stand_on_top(read: Read) -> None:
    top = read.sections[""]
    assert "Model and mechanization do not match" in top
    assert "sigmas are the reduced filter's own: sins_static.prune_unobservable approximates the model" in top
    assert "accel_bias[E], accel_bias[N], gyro_bias[E]" in top


def test_an_exact_model_needs_no_caveat(result: xr.Dataset) -> None:
    exact = result.assign_attrs(policies="[]", equivalence="[]")
    top = Read(page(exact)).sections[""]
    assert "reduced filter" not in top and "do not match" not in top


@pytest.mark.parametrize(
    ("scale", "says"),
    [(5.0, "Its sigmas are too small"), (0.2, "R is set larger than the innov"), (1.0, "as the filter expects")],
)
def test_the_page_says_whether_nis_believes_the_sigmas(result: xr.Dataset, scale: float, says: str) -> None:
    scaled = result.copy()
    scaled["zero_velocity_nis"] = result["zero_velocity_nis"] * scale
    assert says in Read(page(scaled)).sections["Consistency (NIS)"]


def test_curves_on_the_page_are_those_of_the_result(read: Read, result: xr.Dataset) -> None:
    data = read.data["figure-outputs_attitude"]["data"]
    pitch = next(t for t in data if t["name"] == "estimate" and t["yaxis"] == "y2")
    np.testing.assert_allclose(unpacked(pitch["y"]), result["output_value"].to_numpy()[:, 1] / DEG, rtol=1e-6)
    lower, upper = (unpacked(t["y"]) for t in data if t["name"] == "±3σ" and t["yaxis"] == "y2")
    np.testing.assert_allclose(upper - lower, 6 * result["output_sigma"].to_numpy()[:, 1] / DEG, rtol=1e-4)


def test_each_figure_is_on_the_page_with_titles_and_units(read: Read) -> None:
    places = {a["data-figure"] for _, a in read.tags if a.get("class") == "chart"}
    figures = {name: figure for name, figure in read.data.items() if name.startswith("figure-")}
    assert places == set(figures)
    for figure in figures.values():
        layout = figure["layout"]
        axes = [axis for name, axis in layout.items() if name.startswith("yaxis")]
        assert all(axis["title"]["text"] for axis in axes)
        assert len([a for a in layout["annotations"] if a["text"]]) == len(axes)
        assert layout["xaxis"]["title"]["text"] == "time, s"


def test_texts_of_a_result_are_never_markup(result: xr.Dataset) -> None:
    odd = result.assign_attrs(title="</script><script>alert(1)</script> & <b>")
    odd = odd.assign_coords(state=["<i>x</i>[E]", *result["state"].to_numpy()[1:]])
    read = Read(page(odd))
    assert not [tag for tag, _ in read.tags if tag in ("b", "i")]
    assert "alert(1)" in read.sections[""]
    assert "<b>not</b> & bold" in read.sections["Events"]
    assert len([1 for tag, _ in read.tags if tag == "script"]) == 3 + len(read.data) - 1


@pytest.mark.parametrize(("steps", "measurements"), [(14_950, ("zero_velocity",)), (92_350, ("a", "b", "c"))])
def test_a_long_record_stays_below_ten_megabytes_and_keeps_its_extremes(
    make_result: Results, steps: int, measurements: tuple[str, ...]
) -> None:
    long = make_result(steps, rate=50.0, measurements=measurements)
    long["output_error"][steps // 3, 0] = 40 * DEG
    html = page(long)
    assert len(html.encode()) < LIMIT
    data = Read(html).data["figure-output_errors_attitude"]["data"]
    error = next(t for t in data if t["name"].startswith("estimate") and t["yaxis"] == "y")
    assert np.isclose(unpacked(error["y"]).max(), 40, rtol=1e-6)


def test_hundreds_of_states_fit_too(make_result: Results) -> None:
    small = make_result(20_000)
    of_states = small[["estimate", "sigma", "truth", "error"]]
    wide = xr.concat([of_states] * 30, dim="state").assign_coords(state=[f"clock{k // 5}[{k}]" for k in range(210)])
    for name, value in (("unit", "m"), ("display_unit", "m"), ("display_scale", 1.0)):
        wide[f"state_{name}"] = ("state", [value] * 210)
    assert len(page(wide).encode()) < LIMIT


def test_a_result_of_nothing_but_outputs_is_a_page_too(make_result: Results) -> None:
    bare = make_result(truth=False, states=False, sigma=False, events=False, measurements=())
    read = Read(page(bare.assign_attrs({})))
    assert "attitude.yaw" in read.sections["At the end"]
    assert "Innovations" not in read.sections


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_a_browser_draws_every_chart_without_an_error(html: str, tmp_path: Path) -> None:
    place = tmp_path / "report.html"
    place.write_text(html, encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
               "--disable-component-update", "--disable-sync", f"--user-data-dir={tmp_path / 'profile'}",
               "--window-size=1400,12000", "--virtual-time-budget=15000", "--enable-logging=stderr", "--dump-dom"]  # fmt: skip
    done = subprocess.run(
        ["chromium", *options, place.as_uri()], capture_output=True, text=True, check=True, timeout=120
    )
    drawn = re.findall(r'data-figure="[^"]*"[^>]*data-drawn="yes"', done.stdout)
    assert len(drawn) == len(re.findall(r'class="chart', html))
    assert not re.search(r"CONSOLE.*(Uncaught|Refused)", done.stderr)
