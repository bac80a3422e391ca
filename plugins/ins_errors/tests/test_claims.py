"""The claims of the paper, judged by the example file, against figures of an independent computation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from estimfw.cli.main import main

CLAIMS = str(Path(__file__).resolve().parents[3] / "examples" / "claims" / "ins_errors.yaml")

#: By number of the claim: verdict, and figures (place among the parts, value, half a digit).
EXPECTED: dict[str, tuple[str, dict[int, tuple[float, float]]]] = {
    "1": (
        "holds partly",
        {0: (0.3394 / 2, 3e-5), 2: (6.084 / 6, 1e-4), 3: (0.188, 5e-4), 4: (0.016, 5e-4), 10: (4, 0)},
    ),
    "2": ("holds partly", {1: (0.5, 1e-3), 2: (0.0116, 5e-5), 3: (0, 0)}),
    "3": ("holds partly", {1: (1.975 / 6, 1e-4), 2: (1.372 / 0.5, 1e-3), 3: (7.54 / 6, 1e-3)}),
    "4": ("holds", {0: (0.73, 5e-3), 1: (0.99, 5e-3)}),
    "5": ("holds", {2: (0.389 / 6, 1e-4), 7: (0.90, 5e-3)}),
    "6": ("holds", dict.fromkeys(range(6), (0.499, 0.0045))),
    "7": ("holds", {}),
    "8": ("holds partly", {1: (12.3, 5e-2), 2: (12.3, 5e-2), 5: (3.9, 5e-2)}),
}


@pytest.fixture(scope="module")
def judged() -> dict[str, Any]:
    """By number of the claim."""
    import contextlib
    import io

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(["claims", CLAIMS, "--json"]) == 0
    return {claim["text"].partition(".")[0]: claim for claim in json.loads(out.getvalue())["claims"]}


@pytest.mark.slow
@pytest.mark.parametrize("number", EXPECTED)
def test_the_verdict_on_a_claim_and_its_figures(judged: dict[str, Any], number: str) -> None:
    verdict, figures = EXPECTED[number]
    assert judged[number]["verdict"] == verdict
    for place, (value, half_a_digit) in figures.items():
        assert judged[number]["parts"][place]["figure"] == pytest.approx(value, abs=half_a_digit), place
