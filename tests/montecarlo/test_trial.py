"""Several filters over the same draws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.config.generic.components import core_components
from estimfw.errors import ConfigError, UsageError
from estimfw.montecarlo.claims import Claim, judge, read_claims
from estimfw.montecarlo.draw import drawn_record
from estimfw.montecarlo.trial import Trial, run_trial
from estimfw.registry.load import load_plugins
from estimfw.run.contenders import Contender
from estimfw.run.run import run_problem

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = ("source.duration=20 s", "estimator.gate=null")
WHOLE = Contender("whole", EXAMPLES / "tracker.yaml", SHORT)
#: Believes its fixes to be a third as noisy as they are.
TRUSTING = Contender("trusting", EXAMPLES / "tracker.yaml", (*SHORT, "measurements.fix.noise=0.01 m"))


@pytest.fixture(scope="module")
def trial() -> Trial:
    return run_trial([WHOLE, TRUSTING], load_plugins(core_components()), 12, 5, times=[7.25])


def test_each_filter_runs_on_the_record_that_a_monte_carlo_would_draw_for_it(
    trial: Trial, example: Callable[..., Any]
) -> None:
    problem = example("tracker", *SHORT)
    for run in (0, 7):
        done = run_problem(problem, record=drawn_record(problem, 5, run))
        assert done.truth is not None
        np.testing.assert_array_equal(trial.error[0, run, -1], done.estimate[-1] - done.truth[-1])


def test_no_number_depends_on_the_workers(trial: Trial) -> None:
    again = run_trial([WHOLE, TRUSTING], load_plugins(core_components()), 12, 5, workers=2, times=[7.25])
    np.testing.assert_array_equal(again.error, trial.error)


def test_what_is_asked_for_is_an_instant_of_its_own(trial: Trial) -> None:
    assert trial.time[trial.at(7.25)] == 7.25
    with pytest.raises(UsageError, match="outside"):
        trial.at(21.0)


def claim(**more: Any) -> Claim:
    return Claim.model_validate({"text": "so", "of": ("whole",), "output": "position[x]", "below": 1e9, **more})


def test_figures_of_claims_are_what_numpy_says(trial: Trial) -> None:
    x = trial.error[:, :, -1, trial.quantity("position[x]")]
    rms, median = np.sqrt(np.mean(x**2, axis=1)), np.median(np.abs(x), axis=1)
    claims = (
        claim(),
        claim(of=("trusting", "whole"), below=None, above=1.0),
        claim(statistic="median", above=1e9, below=None),
        claim(statistic="closer", of=("whole", "trusting"), above=0.0),
    )
    verdicts = judge(claims, trial)
    figures = [rms[0], rms[1] / rms[0], median[0], np.mean(np.abs(x[0]) < np.abs(x[1]))]
    np.testing.assert_allclose([v.figure for v in verdicts], figures, rtol=1e-12)
    assert [v.holds for v in verdicts] == [True, figures[1] > 1.0, False, True]
    assert [v.unit for v in verdicts] == ["m", "", "m", ""]


def test_claims_about_what_is_not_there_are_refused_with_what_is(trial: Trial) -> None:
    with pytest.raises(UsageError, match="no filter here is called 'hole'"):
        judge((claim(of=("hole",)),), trial)
    with pytest.raises(UsageError, match=r"position\[z\]"):
        judge((claim(output="position[z]"),), trial)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("claims: [{text: a, of: [b], output: c}]", "above, below"),
        ("claims: [{text: a, of: [b], output: c, statistic: closer, below: 1}]", "two filters"),
        ("claims: [{text: a, of: [b], output: c, statistic: settled, below: 1}]", "within"),
        ("claims: [{text: a, of: [b], output: c, below: 1, at: 3}]", "unit"),
        ("claims: []", "claims"),
    ],
)
def test_a_claim_that_says_nothing_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "claims.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message) as told:
        read_claims(path)
    assert "claims.yaml" in str(told.value)


def test_filters_of_other_records_are_refused() -> None:
    longer = Contender("longer", EXAMPLES / "tracker.yaml", ("source.duration=30 s",))
    with pytest.raises(ConfigError, match="'source' of longer"):
        run_trial([WHOLE, longer], load_plugins(core_components()), 3, 1)
