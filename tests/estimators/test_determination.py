"""A determination: the provider's own outputs, through the same run, result, report and commands; no states, no sigma."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import read_document
from estimfw.config.types import Settings, Site
from estimfw.data.record import Record, Stream, Truth
from estimfw.errors import ConfigError
from estimfw.model.nominal import CompiledScan, InitialNominal, NominalVariable, ProviderSettings
from estimfw.model.parts import Output
from estimfw.montecarlo.campaign import run_campaign
from estimfw.registry.component import Component
from estimfw.registry.load import load_plugins
from estimfw.registry.registry import Registry
from estimfw.report.explain import explain_json
from estimfw.report.price_tables import price_table, value_table
from estimfw.report.price_values import values_of
from estimfw.report.terminal import print_result
from estimfw.report.write import write_report
from estimfw.run.answer import answer
from estimfw.run.budget import error_budget
from estimfw.run.compare import compare
from estimfw.run.contenders import from_configs, grid
from estimfw.run.dataset import result_dataset
from estimfw.run.observe import observe
from estimfw.run.result_file import read_result, write_result
from estimfw.run.run import run_problem
from estimfw.run.session import Session
from estimfw.run.summary import end_outputs, summarise
from estimfw.run.until import until
from estimfw.run.values_file import values_csv

FloatArray = NDArray[np.float64]
CONFIG = """\
estimfw: 1
name: track of a wheel
nominal: {kind: wheel}
estimator: {kind: determination}
source: {kind: rolled}
"""
RATE, TURN, STEPS = 2.0, 0.02, 400


def track(estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray]) -> FloatArray:
    return np.concatenate([nominal["place"], nominal["course"][..., None]], axis=-1)


def true_track(truth: Mapping[str, FloatArray]) -> FloatArray:
    return np.concatenate([truth["place"], truth["course"][..., None]], axis=-1)


class WheelConfig(Settings):
    kind: Literal["wheel"]


class Wheel:
    """Dead reckoning in a plane: distance and turn of each step, started at the origin, towards x."""

    kind, stream, columns, samples_per_step = "wheel", "wheel", ("distance", "turn"), 1
    operations: tuple[Any, ...] = ()
    slots: tuple[Any, ...] = ()
    outputs = (
        Output(
            "track",
            ("x", "y", "course"),
            ("m", "m", "rad"),
            ("m", "m", "deg"),
            track,
            (),
            ("place", "course"),
            true_track,
        ),
    )
    params, n_state, n_sample = np.zeros(1), 3, 2
    compiled: CompiledScan | None = None

    def variables(self, computed: frozenset[str]) -> tuple[NominalVariable, ...]:
        return NominalVariable("place", (2,), "m", "varying"), NominalVariable("course", (), "rad", "varying")

    def reference(self, initial: InitialNominal) -> dict[str, FloatArray]:
        return {"place": np.zeros(2), "course": np.zeros(())}

    def start(self, given: InitialNominal | None, record: Record) -> InitialNominal:
        return InitialNominal({})

    def bind(self, settings: ProviderSettings) -> Wheel:
        return self

    def initial_state(self, initial: InitialNominal) -> FloatArray:
        return np.zeros(3)

    initial_row = initial_state

    def samples(self, stream: Stream, rows: NDArray[np.int64]) -> FloatArray:
        return stream.values[rows[:-1]]

    def step(self, state: FloatArray, sample: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        course = state[..., 2] + 0.5 * sample[..., 1]
        x, y = state[..., 0] + sample[..., 0] * np.cos(course), state[..., 1] + sample[..., 0] * np.sin(course)
        after = np.stack([x, y, state[..., 2] + sample[..., 1]], axis=-1)
        return after, after, after

    def correct(self, state: FloatArray, delta: FloatArray) -> FloatArray:
        return state


class RolledConfig(Settings):
    kind: Literal["rolled"]


class Rolled:
    """A circle: constant speed and turn, and where that leads in closed form."""

    def load(self) -> Record:
        time = np.arange(1, STEPS + 1, dtype=np.float64) * 0.1
        angle = TURN * np.arange(1, STEPS + 1, dtype=np.float64)
        values: FloatArray = np.tile([RATE * 0.1, TURN], (STEPS, 1))
        place: FloatArray = RATE * 0.1 / TURN * np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=-1)
        truth = Truth(time, {"place": place, "course": angle})
        return Record({"wheel": Stream("wheel", time, values, ("distance", "turn"), "increment", 0.1)}, truth=truth)


def wheel(cfg: WheelConfig, site: Site | None) -> Wheel:
    return Wheel()


def rolled(cfg: RolledConfig, site: Site | None, given: InitialNominal | None) -> Rolled:
    return Rolled()


def registry() -> Registry:
    own = [
        Component("nominal", "wheel", WheelConfig, wheel, "dead reckoning"),
        Component("source", "rolled", RolledConfig, rolled, "a circle"),
    ]
    return load_plugins([*core_components(), *own])


def composed(text: str = CONFIG) -> Problem:
    return compose(read_document(text), registry())


@pytest.fixture(scope="module")
def problem() -> Problem:
    return composed()


def test_outputs_are_what_the_provider_computes(problem: Problem) -> None:
    done = run_problem(problem)
    assert done.estimate.shape == (STEPS, 0)
    # A step along the chord by the middle course is a chord of the circle but for its length: sin(u) / u of the arc.
    shrunk = np.sinc(0.5 * TURN / np.pi)
    assert done.output_truth is not None
    np.testing.assert_allclose(done.output[:, :2] * shrunk, done.output_truth[:, :2], atol=1e-10)
    np.testing.assert_allclose(done.output[:, 2], done.output_truth[:, 2], rtol=1e-12)


def test_the_result_has_outputs_and_errors_and_nothing_of_states(problem: Problem, tmp_path: Path) -> None:
    dataset = result_dataset(run_problem(problem))
    assert not {"state", "estimate", "sigma", "covariance", "output_sigma", "truth", "error"} & set(dataset.variables)
    assert {"output_value", "output_truth", "output_error"} <= set(dataset.variables)
    back = read_result(write_result(dataset, tmp_path / "result.nc"))
    np.testing.assert_array_equal(back["output_value"], dataset["output_value"])
    assert json.loads(back.attrs["provenance"])["estimator"] == "determination"


def test_answer_summary_and_csv_have_values_without_sigmas(problem: Problem) -> None:
    dataset = result_dataset(run_problem(problem))
    told = answer(until(dataset, 20.0))
    assert told["states"] == {} and told["time"] == pytest.approx(20.0)
    assert set(told["track"]) == {"x", "y", "course"}
    assert told["track"]["course"]["value"] == pytest.approx(np.degrees(TURN * 200))
    assert "sigma" not in told["track"]["x"] and "error" in told["track"]["x"]
    json.dumps(told, allow_nan=False)
    assert summarise(dataset)["outputs"][0]["sigma"] is None
    assert values_csv(dataset).splitlines()[0] == "time [s],track.x [m],track.y [m],track.course [deg]"
    assert [end.label for end in end_outputs(dataset)] == ["track.x", "track.y", "track.course"]


def test_terminal_page_and_pictures_show_the_outputs_alone(problem: Problem, tmp_path: Path) -> None:
    from rich.console import Console

    dataset = result_dataset(run_problem(problem))
    with (tmp_path / "told.txt").open("w") as file:
        print_result(dataset, Console(file=file, width=120))
    told = (tmp_path / "told.txt").read_text()
    assert "±" not in told and "σ" not in told and "track.x" in told
    written = write_report(dataset, tmp_path / "report")
    drawn = {"outputs_track", "outputs_track_2", "output_errors_track", "output_errors_track_2"}
    assert drawn == {p.stem for p in written if p.suffix == ".png"}
    assert 'class="sigma"' not in (tmp_path / "report" / "report.html").read_text().split("<script")[0]


def test_a_session_gives_what_the_batch_gives(problem: Problem) -> None:
    record = problem.source.load()
    session, stream = Session(problem), record.streams["wheel"]
    for time, sample in zip(stream.time[:50], stream.values[:50], strict=True):
        found = session.push(float(time), sample)
    assert found is not None and found.states == {}
    batch = run_problem(problem).output[49]
    np.testing.assert_array_equal([found.outputs[f"track.{c}"][0] for c in ("x", "y", "course")], batch)
    assert all(np.isnan(sigma) for _, sigma in found.outputs.values())


@pytest.mark.parametrize(
    ("analysis", "what"),
    [
        (error_budget, "an error budget needs states"),
        (observe, "observability needs states"),
        (lambda problem: run_campaign(problem, 1, 2), "a Monte Carlo of consistency needs states"),
    ],
)
def test_analyses_of_states_refuse_it(problem: Problem, analysis: Callable[[Problem], object], what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        analysis(problem)


def test_it_stands_beside_filters_in_a_comparison(tmp_path: Path) -> None:
    (tmp_path / "alone.yaml").write_text(CONFIG)
    (tmp_path / "beside.yaml").write_text(
        CONFIG.replace("estimator: {kind: determination}", BLOCK + "estimator: {kind: kalman}")
    )
    found = compare(
        from_configs([tmp_path / "alone.yaml", tmp_path / "beside.yaml"], ()), grid(()), registry(), repeats=1
    )
    values = values_of(found)
    assert [v.output for v in values] == ["track.x", "track.y", "track.course"]
    assert len(value_table(values).rows) == 3
    assert [one.cost.states for one in found.filters] == [0, 1]
    assert len(price_table(found).rows) == 2


BLOCK = "blocks:\n  b: {kind: random_constant, unit: m, sigma: 1 m}\n"


def test_states_and_a_determination_exclude_each_other() -> None:
    with pytest.raises(ConfigError, match=r"'blocks' says something of them") as told:
        composed(CONFIG + BLOCK)
    assert told.value.location is not None and told.value.location.line == 7
    with pytest.raises(ConfigError, match="there are no blocks: a filter has states") as told:
        composed(CONFIG.replace("determination", "kalman"))
    assert "kind: determination" in str(told.value.hint)


def test_a_filter_with_blocks_takes_the_outputs_of_its_blocks() -> None:
    assert composed(CONFIG.replace("determination", "kalman") + BLOCK).plan.outputs == ()


def test_explain_tells_a_model_without_states(problem: Problem) -> None:
    told = explain_json(problem)
    assert told["states"] == [] and told["F"] == [] and told["rank"] == 0
