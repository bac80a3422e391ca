"""Claims about single runs: the figures against closed forms, what a file may not say, and the page."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, UsageError
from estimfw.run.claim_figure import exponent, figure_of, turns, unit_of
from estimfw.run.claim_file import Part, read_claim_file
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem
from tests.cli.conftest import Told

CLAIMS = """\
title: what is claimed of a tracker
set: [source.duration=20 s]
filters:
  plain: {config: EXAMPLES/tracker.yaml}
  coarse: {config: EXAMPLES/tracker.yaml, about: a fix ten times as noisy, set: [measurements.fix.noise=50 m]}
figures:
  - {title: "Figure 1", of: [plain]}
claims:
  - text: a better fix gives a better place
    parts:
      - {text: much better, of: [plain, coarse], quantity: "position[x]", below: 0.5}
      - {text: the place is known to a mm, of: [plain], quantity: "position[x]", at: 10 s, below: 0.001}
  - text: nothing stays undetermined
    parts:
      - {text: no combination, of: [plain], statistic: undetermined, below: 1}
"""


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "[a list]\n"])
def test_a_file_without_claims_is_told_what_it_begins_with(estimfw: Callable[..., Told], text: str) -> None:
    Path("none.yaml").write_text(text)
    told = estimfw("claims", "none.yaml")
    assert told.code == 3 and "begin with 'title: " in told.err
    Path("none.yaml").write_text("title: What is claimed\n")  # as it was told
    assert "the key 'filters' is missing" in estimfw("claims", "none.yaml").err


def part(**settings: object) -> Part:
    return Part.model_validate({"text": "it", "of": ("one",), **settings})


@pytest.mark.parametrize("p", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("start", [0.0, 3.0])
def test_the_exponent_is_that_of_the_sigma_gained_since_the_start(p: float, start: float) -> None:
    t = np.linspace(10.0, 1000.0, 500)
    assert exponent(t, np.sqrt(start**2 + (0.1 * t**p) ** 2), start) == pytest.approx(p, rel=1e-9)


def test_turns_are_extremes_and_not_rounding() -> None:
    t = np.linspace(0.0, 4.0 * np.pi, 400)
    assert turns(np.sin(t)) == 4
    assert turns(1.0 + 1e-15 * np.random.default_rng(1).standard_normal(100)) == 0
    assert turns(np.sqrt(1.0 + t)) == 0


def test_figures_are_what_the_result_has_in_display_units(example: Callable[..., Problem]) -> None:
    dataset = result_dataset(run_problem(example("tracker", "source.duration=20 s")))
    results = {"one": dataset, "two": dataset}
    state = [str(x) for x in dataset["state"].to_numpy()].index("velocity[x]")
    time, scale = dataset["time"].to_numpy(), float(dataset["state_display_scale"][state])
    sigma = dataset["sigma"].to_numpy()[:, state] * scale
    row = int(np.argmin(np.abs(time - 10.0)))
    velocity = {"quantity": "velocity[x]", "below": 1.0}
    assert figure_of(part(**velocity, at="10 s"), results) == sigma[row]
    assert figure_of(part(**velocity), results) == sigma[-1]
    assert (
        figure_of(part(**velocity, statistic="error"), results) == abs(dataset["error"].to_numpy()[-1, state]) * scale
    )
    prior = float(dataset["prior_sigma"][state]) * scale
    assert figure_of(part(**velocity, since="0 s"), results) == pytest.approx(sigma[-1] / prior, rel=1e-15)
    assert figure_of(part(**velocity, since="10 s"), results) == sigma[-1] / sigma[row]
    assert figure_of(part(**velocity, of=("one", "two")), results) == 1.0
    assert figure_of(part(**velocity, statistic="overconfidence"), results) == 1.0
    assert unit_of(part(**velocity), results) == str(dataset["state_display_unit"].to_numpy()[state])
    assert unit_of(part(**velocity, since="0 s"), results) == ""
    with pytest.raises(UsageError, match="one has no 'velocity'"):
        figure_of(part(quantity="velocity", below=1.0), results)
    with pytest.raises(UsageError, match="outside the run"):
        figure_of(part(**velocity, at="1 h"), results)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (", below: 0.5}|}", "above, below, or both"),
        ("of: [plain, coarse]|of: [plane, coarse]", "did you mean 'plain'"),
        ("statistic: undetermined, below|statistic: undetermined, quantity: x, below", "of no quantity"),
        ("at: 10 s|statistic: turns", "needs since"),
        ("statistic: undetermined|statistic: nullity", "statistic"),
    ],
)
def test_a_file_that_cannot_be_judged_is_refused_with_its_place(tmp_path: Path, wrong: str, told: str) -> None:
    before, after = wrong.split("|")
    text = CLAIMS.replace(before, after, 1)
    assert text != CLAIMS
    (tmp_path / "claims.yaml").write_text(text)
    with pytest.raises(ConfigError) as fault:
        read_claim_file(tmp_path / "claims.yaml")
    assert told in f"{fault.value.message} {fault.value.hint}"
    assert fault.value.location is not None and fault.value.location.line is not None


def test_the_command_tells_verdicts_and_writes_a_page_with_figures(estimfw: Callable[..., Told]) -> None:
    examples = Path(__file__).resolve().parents[2] / "examples"
    Path("claims.yaml").write_text(CLAIMS.replace("EXAMPLES", str(examples)))
    told = estimfw("claims", "claims.yaml", "-o", "page.html", width=160)
    assert told.code == 0
    for text in (
        "a better fix gives a better place: holds partly",
        "1 of 2",
        "σ of position[x], the end: plain over coarse",
    ):
        assert text in told.out
    page = Path("page.html").read_text()
    assert "1 of 2 claims hold" in page and "a fix ten times as noisy" in page and 'id="figure-1"' in page
    assert any(Path().glob("page_figure_1_plain_states_*.png")) and Path("page_figure_1_plain_sigmas.png").exists()
    assert estimfw("claims", "claims.yaml", "-o", "page.html").code == 5
    checked = estimfw("claims", "claims.yaml", "--check", "--json")
    assert checked.code == 8 and "1 of 2 claims do not hold as they stand" in checked.err
    first, second = json.loads(checked.out)["claims"]
    assert (first["verdict"], [p["holds"] for p in first["parts"]]) == ("holds partly", [True, False])
    assert second == {**second, "verdict": "holds"} and second["parts"][0]["figure"] == 0.0


def test_a_fault_of_a_filter_names_it(estimfw: Callable[..., Told]) -> None:
    Path("claims.yaml").write_text(CLAIMS.replace("EXAMPLES", "nowhere"))
    told = estimfw("claims", "claims.yaml")
    assert told.code == 3 and "filter plain" in told.err
