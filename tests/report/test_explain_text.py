"""What `explain` prints can be read, and what it prints of a noise can be copied back into a config."""

from __future__ import annotations

from collections.abc import Callable
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document, read_document
from estimfw.registry.load import load_plugins
from estimfw.report.explain_text import density_unit, explanation
from estimfw.units.table import UNITS

ROOT = Path(__file__).resolve().parents[2]
REGISTRY = load_plugins(core_components())
UNIT_TEXTS = st.builds(
    lambda first, tail: first + tail,
    st.sampled_from(sorted(name for name, unit in UNITS.items() if float(unit.scale) == 1.0)),
    st.sampled_from(["", "/s", "/s^2", "*m", "/sqrt(s)", "^2", "/(m*K)"]),
)
LEVELS = st.floats(1e-6, 1e6).map(lambda x: float(f"{x:.4g}"))


def walking(unit: str, noise: str, kind: str = "random_walk", name: str = "p") -> Problem:
    rate = f", rate_sigma: 1 ({unit})/s" if kind == "integrated_random_walk" else ""
    text = (
        f"estimfw: 1\nblocks: {{{name}: {{kind: {kind}, unit: '{unit}', sigma: 1 {unit}, noise: {noise}{rate}}}}}\n"
        f"measurements: {{z: {{kind: direct, of: [{{block: {name}}}], noise: 1 {unit}}}}}\n"
    )
    return compose(read_document(text), REGISTRY)


def told(problem: Problem) -> str:
    (noise,) = problem.model.noises
    text, scale = density_unit(noise)
    return f"{np.sqrt(noise.psd[0]) * scale:.17g} {text}"


@settings(max_examples=60, deadline=None)
@given(
    UNIT_TEXTS,
    LEVELS,
    st.sampled_from(["p", "accel_bias"]),
    st.sampled_from([("random_walk", "/sqrt(s)"), ("integrated_random_walk", "/s/sqrt(s)")]),
)
def test_the_density_shown_is_accepted_by_the_config_and_means_the_same(
    unit: str, level: float, name: str, form: tuple[str, str]
) -> None:
    kind, over = form
    problem = walking(unit, f"{level} {unit}{over}", kind, name)
    again = walking(unit, told(problem), kind, name)
    np.testing.assert_allclose(again.model.Q, problem.model.Q, rtol=1e-14)


@pytest.mark.parametrize(
    ("unit", "noise", "shown"),
    [
        ("m/s", "0.3 m/s/sqrt(s)", "0.3 m/s/sqrt(s)"),
        ("K", "0.005 K/sqrt(s)", "0.005 K/sqrt(s)"),
        ("rad", "0.001 deg/sqrt(h)", "0.001 deg/sqrt(h)"),
        ("1", "2 1/sqrt(s)", "2 1/sqrt(s)"),
    ],
)
def test_it_is_shown_as_it_is_written(unit: str, noise: str, shown: str) -> None:
    (source,) = (problem := walking(unit, noise)).model.noises
    text, scale = density_unit(source)
    assert f"{np.sqrt(problem.model.Q[0, 0]) * scale:.4g} {text}" == shown


@pytest.fixture(scope="module")
def printed() -> Callable[[str], str]:
    def show(name: str) -> str:
        out = StringIO()
        console = Console(file=out, width=160)
        for part in explanation(compose(load_document(ROOT / "examples" / f"{name}.yaml", ()), REGISTRY)):
            console.print(part)
        return out.getvalue()

    return show


def test_labels_are_whole_in_every_table(printed: Callable[[str], str]) -> None:
    lines = [" ".join(line.split()) for line in printed("tracker").splitlines()]
    assert "position[x] 50 m kinematics" in lines
    assert "velocity.noise[x], velocity.noise[y] 0.3 m/s/sqrt(s)" in lines


def test_a_random_walk_is_driven_by_its_noise_and_a_constant_by_nothing(printed: Callable[[str], str]) -> None:
    lines = [" ".join(line.split()) for line in printed("tracker").splitlines()]
    assert "velocity[x] 5 m/s velocity.driving_noise" in lines
    static = [" ".join(line.split()) for line in printed("static_12").splitlines()]
    assert "gyro_bias[U] b 0.01 deg/h constant" in static
