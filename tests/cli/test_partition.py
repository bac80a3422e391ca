"""``estimfw partition``, as somebody at a terminal calls it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from ruamel.yaml import YAML

from tests.cli.conftest import Told
from tests.run.gravimeter_text import gravimeter

TRACKER = ("examples/tracker.yaml", "--set", "source.duration=20 s")


def test_groups_prices_and_nodes_are_printed(estimfw: Callable[..., Told]) -> None:
    Path("g.yaml").write_text(gravimeter(30))
    told = estimfw("partition", "g.yaml", "--into", "2")
    assert told.code == 0, told.err
    assert "J = 5.83243" in told.out and "next best J = 5.79442" in told.out
    assert "velocity_error[x] and velocity_error[y]" in told.out
    line = next(row for row in told.out.splitlines() if row.startswith("drop"))
    assert "58.6" in line and "1.15" in line
    assert "take the groups by physical coupling" in told.out
    pasted = told.out[told.out.index("estimator:") : told.out.index("# groups by physical coupling")]
    nodes = YAML(typ="safe").load(pasted)["estimator"]["nodes"]
    assert nodes[0] == {
        "name": "node_1", "blocks": ["velocity_error[x]", "tilt", "accel_bias"], "measurements": ["velocity[x]"]
    }  # fmt: skip


def test_the_answer_in_json_has_both_cuts(estimfw: Callable[..., Told]) -> None:
    answer = json.loads(estimfw("partition", *TRACKER, "--into", "2", "--json").out)
    assert [p["measure"] for p in answer["partitions"]] == ["correlation", "coupling"]
    for one in answer["partitions"]:
        assert sorted(s for g in one["groups"] for s in g) == sorted(answer["states"])
        assert one["true_over_optimal_sigma"]["drop"]["largest"] >= 1.0
        rows = [r for n in one["nodes"] for r in n["rows"]]
        assert sorted(rows) == ["fix[x]", "fix[y]", "speed[x]"]


def test_a_page_and_pictures_are_written_once(estimfw: Callable[..., Told]) -> None:
    assert estimfw("partition", *TRACKER, "--sizes", "2,2", "-o", "page.html").code == 0
    page = Path("page.html").read_text()
    assert "kind: decentralised" in page and '"type":"heatmap"' in page
    assert Path("page_correlation.png").read_bytes().startswith(b"\x89PNG")
    again = estimfw("partition", *TRACKER, "--into", "2", "-o", "page.html")
    assert again.code == 5 and "page.html" in again.err
    assert estimfw("partition", *TRACKER, "--into", "2", "-o", "page.html", "--force").code == 0


def test_a_short_run_is_warned_of(estimfw: Callable[..., Told]) -> None:
    Path("g.yaml").write_text(gravimeter(30, 60))
    told = estimfw("partition", "g.yaml", "--into", "2", "--no-price")
    assert told.code == 0 and "has not converged" in told.out and "Nothing priced" in told.out


def test_faults_of_usage_say_what_to_write(estimfw: Callable[..., Told]) -> None:
    for arguments, what in (
        ((), "--into 2"),
        (("--into", "1"), "--into 2, or more"),
        (("--into", "5"), "--into 4 is the most"),
        (("--sizes", "3,2"), "--sizes 2,2"),
        (("--sizes", "3,two"), "--sizes 6,4"),
        (("--into", "2", "-o", "page.pdf"), "page.html"),
    ):
        told = estimfw("partition", *TRACKER, *arguments)
        assert told.code == 2 and what in told.err


def test_pasted_nodes_are_the_global_filter(estimfw: Callable[..., Told]) -> None:
    text = gravimeter(30, 120)
    Path("g.yaml").write_text(text)
    told = estimfw("partition", "g.yaml", "--into", "2", "--no-price").out
    pasted = told[told.index("estimator:") : told.index("# groups by physical coupling")]
    Path("nodes.yaml").write_text(text.replace("estimator: {kind: kalman}\n", pasted))
    ends = []
    for name in ("g", "nodes"):
        assert estimfw("run", f"{name}.yaml", "-o", name, "--no-report").code == 0
        with xr.open_dataset(Path(name) / "result.nc", engine="h5netcdf") as result:
            ends.append((result["estimate"].to_numpy(), result["sigma"].to_numpy()))
    (one, sigma), (several, own) = ends
    assert np.abs((one - several) / sigma).max() < 1e-9 and np.abs(own / sigma - 1.0).max() < 1e-9


def test_the_covariance_of_a_form_that_drops_some_is_not_taken(estimfw: Callable[..., Told]) -> None:
    config = ("examples/tracker_decentralised.yaml", "--set", "source.duration=20 s")
    assert estimfw("partition", *config, "--into", "2").code == 0
    told = estimfw("partition", *config, "--into", "2", "--set", "estimator.cross_covariance=drop")
    assert told.code == 3 and "cross_covariance=exact" in told.err
