"""``estimfw compare``: one record for all, what each filter costs and gives, published figures beside it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.config.generic.components import core_components
from estimfw.errors import ConfigError, DataError, UsageError
from estimfw.registry.load import load_plugins
from estimfw.run.contenders import from_configs, grid, one_by_one, refuse_other_records
from estimfw.run.published import read_published

Run = Callable[..., Any]
ROOT = Path(__file__).resolve().parents[2]
STATIC = ("examples/static_12.yaml", "examples/static_10.yaml", "examples/static_7.yaml")
SHORT = ("--set", "source.duration=20 s", "--repeats", "1")


def by_filter(values: list[dict[str, Any]], output: str, point: str = "") -> dict[str, dict[str, Any]]:
    return {v["filter"]: v for v in values if v["output"] == output and v["point"] == point}


def test_sizes_work_and_time_invariance_of_three_filters(estimfw: Run) -> None:
    told = estimfw("compare", *STATIC, *SHORT, "--json")
    assert told.code == 0 and told.err == ""
    full, ten, seven = json.loads(told.out)["filters"]
    assert [f["states"] for f in (full, ten, seven)] == [12, 10, 7]
    # Equation (16): g twice, the Earth's rate four times, two biases; H = [I2 0]. F of 12 states: 2 Omega (4), f_n x (2),
    # Omega (4), and twice the rotation from b to n, all nine of whose entries vary.
    assert seven["nonzeros"] == {"F": 8, "Phi": seven["nonzeros"]["Phi"], "H": 2}
    assert full["nonzeros"]["F"] == 4 + 2 + 4 + 9 + 9
    assert (seven["time_invariant"], full["time_invariant"]) == (True, False)
    assert "C_bn, which is varying" in full["reason"]
    work = [f["multiplications"] for f in (full, ten, seven)]
    assert work[0]["total"] > work[1]["total"] > work[2]["total"]
    assert work[2]["rebuild"] == 0 and work[2]["total"] == work[2]["predict"] + work[2]["update"]
    assert all(f["time_per_step"]["seconds"] > 0 for f in (full, ten, seven))
    assert full["time_per_step"]["ratio"] == 1.0


def test_every_filter_gives_what_it_gives_alone_on_that_record(estimfw: Run) -> None:
    values = json.loads(estimfw("compare", *STATIC, *SHORT, "--at", "10", "--at", "20", "--json").out)["values"]
    for time in (10.0, 20.0):
        for config in STATIC:
            alone = json.loads(estimfw("run", config, *SHORT[:2], "--at", str(time), "--json").out)["attitude"]
            ours = {v["output"]: v for v in values if v["filter"] == Path(config).stem and v["time"] == time}
            for angle in ("yaw", "pitch", "roll"):
                assert ours[f"attitude.{angle}"]["sigma"] == pytest.approx(alone[angle]["sigma"], rel=1e-12)
                assert ours[f"attitude.{angle}"]["error"] == pytest.approx(alone[angle]["error"], rel=1e-9)


def test_policies_one_by_one_end_with_the_config_itself(estimfw: Run) -> None:
    stepwise = json.loads(estimfw("compare", STATIC[2], "--policies-one-by-one", *SHORT, "--json").out)
    assert [f["states"] for f in stepwise["filters"]] == [12, 12, 12, 12, 10, 7]
    assert [f["time_invariant"] for f in stepwise["filters"]] == [False, False, False, True, True, True]
    assert stepwise["filters"][0]["policies"] == []
    last = by_filter(stepwise["values"], "attitude.yaw")["5 + prune_unobservable"]
    alone = by_filter(json.loads(estimfw("compare", STATIC[2], *SHORT, "--json").out)["values"], "attitude.yaw")
    assert last["error"] == alone["static_7"]["error"]


def test_every_combination_is_run_and_a_list_of_equal_values_is_named_by_one(estimfw: Run) -> None:
    misaligned = "source.misalignment=[[1 deg, 1 deg, 1 deg], [5 deg, 5 deg, 5 deg]]"
    varied = ("--vary", misaligned, "--vary", "source.seed=[1, 2]")
    found = json.loads(estimfw("compare", STATIC[2], *varied, *SHORT, "--json").out)
    labels = ["1 deg; 1", "1 deg; 2", "5 deg; 1", "5 deg; 2"]
    assert [p["label"] for p in found["points"]] == labels
    errors = [by_filter(found["values"], "attitude.yaw", label)["static_7"]["error"] for label in labels]
    assert len(set(errors)) == 4


def test_page_and_pictures_are_written_and_not_overwritten(estimfw: Run) -> None:
    words = ("compare", *STATIC, *SHORT, "-o", "here/prices.html")
    told = estimfw(*words)
    assert told.code == 0
    pictures = {f"prices_{name}.png" for name in ("errors", "estimates", "estimates_2", "sigmas", "sigmas_2")}
    assert {p.name for p in Path("here").iterdir()} == {"prices.html", *pictures}
    page = Path("here/prices.html").read_text()
    assert "What each costs" in page and "static_10" in page and 'data-figure="figure-errors"' in page
    before = Path("here/prices.html").read_bytes()
    refused = estimfw(*words)
    assert refused.code == 5 and "--force" in refused.err
    assert Path("here/prices.html").read_bytes() == before
    assert estimfw(*words, "--force").code == 0


def test_long_names_are_numbers_in_the_legend_and_told_below_the_title() -> None:
    from estimfw.report.price_charts import price_charts
    from estimfw.run.compare import compare

    words = ["source.duration=10 s"]
    registry = load_plugins(core_components())
    (chart,) = price_charts(compare(one_by_one(ROOT / STATIC[2], words), grid(()), registry, repeats=1), 100)
    assert [c.name for c in chart.panels[0].curves] == ["0", "1", "2", "3", "4", "5"]
    assert "3 + bias_in_navigation_frame" in chart.note


def test_published_figures_stand_beside_ours(estimfw: Run) -> None:
    Path("table.csv").write_text(
        "# from somewhere\nfilter,value,output,published,unit\nstatic_7,,attitude.yaw,6.0,arcmin\nstatic_7,,no.such,1,deg\n"
    )
    words = ("compare", *STATIC, *SHORT, "--published", "table.csv")
    found = by_filter(json.loads(estimfw(*words, "--json").out)["values"], "attitude.yaw")
    assert found["static_7"]["published"] == pytest.approx(0.1) and found["static_10"]["published"] is None
    told = estimfw(*words)
    assert "ours minus it" in told.out and "1 published figures belong to no filter" in told.out


def test_filters_without_outputs_are_compared_by_their_states(estimfw: Run) -> None:
    words = ("--set", "source.duration=5 s", "--repeats", "1", "--json")
    found = json.loads(estimfw("compare", "examples/tracker.yaml", *words).out)
    assert {v["output"] for v in found["values"]} >= {"position[x]", "velocity[y]"}
    assert all(v["honest"] == v["sigma"] for v in found["values"])


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ((*STATIC[:2], "--policies-one-by-one"), "takes one config"),
        ((STATIC[0], STATIC[0]), "named twice"),
        ((STATIC[0], "--policies-one-by-one", "--set", "policies=[]"), "no policies"),
        ((STATIC[0], "--vary", "source.seed"), "varies nothing"),
        ((STATIC[0], "--vary", "source.seed=3"), "is no list"),
        ((STATIC[0], "-o", "page.pdf"), "page.html"),
        ((STATIC[0], *SHORT, "--at", "21"), "outside the run"),
    ],
)
def test_what_cannot_be_compared_is_told(estimfw: Run, words: tuple[str, ...], hint: str) -> None:
    told = estimfw("compare", *words)
    assert told.code == 2
    assert hint in told.err


def test_an_instant_outside_of_the_run_is_refused_before_any_filter_runs(
    estimfw: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("estimfw.run.compare.run_problem", lambda *_, **__: pytest.fail("the filter ran for nothing"))
    told = estimfw("compare", STATIC[0], *SHORT, "--at", "0")
    assert told.code == 2 and "from 1 to 20 s" in told.err


def test_a_filter_with_a_record_of_its_own_is_refused_with_its_place(estimfw: Run) -> None:
    told = estimfw("compare", STATIC[0], "examples/lasergyro_12.yaml")
    assert told.code == 3
    assert "'site' of lasergyro_12 is not that of static_12" in told.err and "lasergyro_12.yaml:" in told.err


def test_records_are_judged_by_the_sections_that_make_them() -> None:
    registry = load_plugins(core_components())
    contenders = from_configs([ROOT / STATIC[0], ROOT / STATIC[2]], ())
    problems = [one.compose(registry) for one in contenders]
    refuse_other_records(contenders, problems)
    problems[1] = contenders[1].compose(registry, ["source.seed=2"])
    with pytest.raises(ConfigError, match="'source' of static_7"):
        refuse_other_records(contenders, problems)


def test_grid_of_nothing_is_one_point_and_of_two_axes_all_pairs() -> None:
    assert [p.overrides for p in grid(())] == [()]
    assert [p.label for p in grid(["a.b=[1, 2]", "c=[x, [y, z]]"])] == [
        "1; x",
        '1; ["y", "z"]',
        "2; x",
        '2; ["y", "z"]',
    ]
    alike = grid(["a=[[1, 1], 1]"])
    assert len({p.label for p in alike}) == 2
    assert grid(["a=[[1 deg, 1 deg]]"])[0].overrides == ('a=["1 deg", "1 deg"]',)


def test_one_by_one_counts_policies_and_names_them() -> None:
    names = [one.name for one in one_by_one(ROOT / STATIC[1], ())]
    assert names == ["0 full model", "1 + constant_specific_force", "2 + remove_vertical_channel"]
    with pytest.raises(UsageError):
        one_by_one(ROOT / "examples/tracker.yaml", ())


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("# nothing\n", None),
        ("filter,value,output,published\na,b,c,1\n", 1),
        ("filter,value,output,published,unit\n\na,b,c,one,deg\n", 3),
        ("# x\nfilter,value,output,published,unit\na,b,c,1,dog\n", 3),
    ],
)
def test_a_bad_table_of_figures_is_refused_with_its_line(tmp_path: Path, text: str, line: int | None) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(DataError) as told:
        read_published(path)
    assert told.value.location is not None and told.value.location.line == line


def test_a_missing_table_of_figures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot read"):
        read_published(tmp_path / "none.csv")


def test_figures_are_read_in_their_unit(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("filter, value, output, published, unit\na, 1 deg, attitude.yaw, -2.75, arcmin\n")
    (one,) = read_published(path)
    assert (one.filter, one.value, one.output) == ("a", "1 deg", "attitude.yaw")
    assert np.degrees(one.figure) * 60.0 == pytest.approx(-2.75)
