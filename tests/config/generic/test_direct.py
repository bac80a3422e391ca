"""The direct measurement: which states its rows read, with which noise, from which columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

Composed = Callable[[str], Problem]
BLOCKS = (
    "estimfw: 1\nblocks:\n  p: {kind: random_constant, unit: m, axes: [x, y, z], sigma: 5 m}\n"
    "  b: {kind: random_constant, unit: m, sigma: 2 m}\nmeasurements:\n  m: "
)


def test_a_measurement_over_two_blocks_reads_both(composed: Composed) -> None:
    text = (
        "{kind: direct, rows: [u, v], of: [{block: p, axes: [z, x]}, {block: b, coefficient: [[1], [-2]]}], noise: 1 m}"
    )
    m = composed(BLOCKS + text).plan.measurements[0]
    np.testing.assert_array_equal(m.H.evaluate(np.zeros(0)), [[0, 0, 1, 1], [1, 0, 0, -2]])
    assert (m.labels, m.columns, m.stream) == (("m[u]", "m[v]"), ("u", "v"), "m")


def test_the_unit_of_the_noise_says_whether_it_is_a_density(composed: Composed) -> None:
    each = composed(BLOCKS + "{kind: direct, of: [{block: b}], noise: 0.3 m}").plan.measurements[0]
    density = composed(BLOCKS + "{kind: direct, of: [{block: b}], noise: 0.3 m/sqrt(Hz)}").plan.measurements[0]
    assert (each.density, density.density) == (False, True)
    np.testing.assert_allclose(each.R, [[0.09]], rtol=1e-15)
    assert each.R == density.R


@pytest.mark.parametrize("kernel", ["numpy", "numba"])
@pytest.mark.parametrize("interval", [0.1, 1.0, 4.0])
def test_a_density_gives_the_same_sigma_after_the_same_time_at_any_rate(
    composed: Composed, interval: float, kernel: str
) -> None:
    text = (
        BLOCKS
        + "{kind: direct, of: [{block: b}], noise: 3 m/sqrt(Hz)}"
        + f"\nestimator: {{kind: kalman, kernel: {kernel}}}"
    )
    time = interval * np.arange(1, round(20 / interval) + 1, dtype=np.float64)
    stream = Stream("m", time, np.zeros((time.size, 1)), ("m",), "sample", interval)
    run = run_problem(composed(text), record=Record({"m": stream}, initial={"time": np.array(0.0)}))
    assert run.sigma[-1, 3] == pytest.approx(np.sqrt(1.0 / (1.0 / 4.0 + 20.0 / 9.0)), rel=1e-9)


def test_correlated_rows_have_a_full_r(composed: Composed) -> None:
    text = "{kind: direct, of: [{block: p, axes: [x, y]}], noise: [1 m, 2 m], correlation: [[1, 0.5], [0.5, 1]]}"
    assert composed(BLOCKS + text).plan.measurements[0].R == ((1.0, 1.0), (1.0, 4.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{kind: direct, of: [{block: q}], noise: 1 m}", "no block 'q'"),
        ("{kind: direct, of: [{block: p, axes: [w]}], noise: 1 m}", "no axis 'w'"),
        ("{kind: direct, of: [{block: p}, {block: b}], noise: 1 m}", "1 axes for 3 rows; give a coefficient"),
        (
            "{kind: direct, of: [{block: p, axes: [x, y]}], noise: 1 m, correlation: [[1, 2], [2, 1]]}",
            "not positive semidefinite",
        ),
        ("{kind: direct, of: [{block: b}], noise: -1 m}", "noise is negative"),
        ("{kind: direct, of: [{block: b}], noise: 0 m}", "zero noise (R = 0)"),
        ("{kind: direct, of: [{block: p, coefficient: [[1, 2], [3]]}], noise: 1 m}", "differ in length"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(composed: Composed, text: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        composed(BLOCKS + text)
    assert message in caught.value.message
    assert caught.value.location is not None


def test_a_simulated_rate_of_no_measurement_is_refused(composed: Composed) -> None:
    source = "\nsource: {kind: simulate_model, duration: 1 s, rate: 1 Hz, rates: {n: 2 Hz}}"
    with pytest.raises(ConfigError, match=r"source.rates names no measurement: 'n'"):
        load_record(composed(BLOCKS + "{kind: direct, of: [{block: b}], noise: 1 m}" + source))


@pytest.mark.parametrize(
    ("noise", "unit"), [("10 mV", "V"), ("10 mV/sqrt(Hz)", "V"), ("[1 cm/s, 2 cm/s]", "m/s"), ("1 Pa", "Pa")]
)
def test_a_forgotten_unit_is_told_by_the_noise(composed: Composed, noise: str, unit: str) -> None:
    text = f"{{kind: direct, of: [{{block: p, axes: [x, y]}}], noise: {noise}}}"
    with pytest.raises(ConfigError, match=rf"measurements\.m\.noise: .* not in m\s.*say `unit: {unit}`"):
        composed(BLOCKS + text)


def test_a_unit_that_is_said_is_not_guessed(composed: Composed) -> None:
    with pytest.raises(
        ConfigError, match=r"'10 mm' is in m, not in V\s+expected a quantity in V, such as 10 mV or 3.7 V"
    ):
        composed(BLOCKS + "{kind: direct, of: [{block: b}], unit: V, noise: 10 mm}")
