"""Fifty drives, six filters on each: the bounds that a right implementation keeps, and what of the paper's claims it shows.

Of twenty, a single drive whose wheel slips in the first seconds can decide: its first speed is in every measurement.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from estimfw.config.generic.components import core_components
from estimfw.montecarlo.claims import judge, read_claims
from estimfw.montecarlo.trial import run_trial
from estimfw.registry.load import load_plugins
from estimfw.run.contenders import from_configs

EXAMPLES = Path(__file__).parents[3] / "examples"
METHODS = ("adba_raw", "aeba_raw", "adba", "aeba", "aeba_raw_plain", "aeba_plain")
#: What the paper claims and these drives may or may not show.
OPEN = ("2. ... nor by 600 s", "4. On filtered speed estimation is better than determination, at 100 s")


@pytest.mark.slow
def test_estimation_and_determination_over_fifty_drives() -> None:
    configs = [EXAMPLES / f"odometer_{name}.yaml" for name in METHODS]
    claims = read_claims(EXAMPLES / "claims" / "odometer.yaml")
    trial = run_trial(
        from_configs(configs, ()),
        load_plugins(core_components()),
        runs=50,
        seed=1,
        workers=2,
        times=(100.0, 300.0, 600.0),
    )
    verdicts = judge(claims, trial)
    assert len(verdicts) >= 16
    failed = [f"{v.claim.text}: {v.figure:.3g}" for v in verdicts if not v.holds and v.claim.text not in OPEN]
    assert not failed
