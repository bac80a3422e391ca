"""The recorded nominal: a pure scan, process rows where the config says, corrected as the error equations say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimfw_ins_errors.compiled_step import error_rate as compiled_rate
from estimfw_ins_errors.local_terms import LOCAL_TERMS
from estimfw_ins_errors.recorded_step import VARIABLES, correct, error_rate, step
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.errors import ConfigError, DataError
from estimfw.model.nominal import InitialNominal, ProviderSettings
from estimfw.run.load import load_record
from estimfw.run.prepare import prepare
from estimfw.run.run import run_problem
from estimfw.testing import check_draws, check_jacobians, check_measurements, check_outputs, check_provider

FloatArray = NDArray[np.float64]
Open = Callable[..., Problem]
Run = Callable[..., Any]

SHORT = "source.duration=100 s"
EVERYTHING = (
    SHORT,
    "measurements.heading={kind: ins_errors.heading, noise: 6 arcmin}",
    "measurements.doppler_log={kind: ins_errors.doppler_log, noise: 0.1 m/s, lever_arm: [1 m, 5 m]}",
    "measurements.position={kind: ins_errors.position, noise: 0.01 arcmin, lever_arm: [3 m, 10 m]}",
    "measurements.velocity.lever_arm=[10 m, 20 m]",
    "source.references={doppler_log: {noise: 0.1 m/s}, position: {noise: 5 m}}",
    "blocks.longitude_error={kind: ins_errors.longitude_error, sigma: 0.01 arcmin}",
    "source.legs=[{time: 1 s, course: 100 deg, speed: 5 m/s}]",
    "process.local_level.terms=complete",
)
CONFORM = [(SHORT,), (SHORT, "source.truth=linear"), EVERYTHING]


@pytest.mark.parametrize("settings", CONFORM)
def test_conformance(opened: Open, settings: tuple[str, ...]) -> None:
    problem = opened("ins_const11", *settings)
    check_provider(problem)
    check_measurements(problem)
    check_outputs(problem)
    check_draws(problem)


def test_conformance_of_a_heading_at_north(opened: Open) -> None:
    """A correction takes it through North: innovations and outputs go the shorter way round."""
    perfect = "source.errors={attitude: 0 deg, gyro_bias: 0 deg/h, accel_bias: 0 ug}"
    north = ("source.course=0 deg", perfect, "source.noise=false")
    problem = opened("ins_const11_heading", SHORT, *north)
    start = problem.source.load().streams["ins"].values[1, 4]
    assert min(start, 2.0 * np.pi - start) < 1e-6
    check_measurements(problem)
    check_jacobians(problem)
    check_outputs(problem)


def test_a_drive_draws_runs_of_one_way(opened: Open) -> None:
    drive = "source={kind: ins_errors.simulate_drive, duration: 60 s}"
    check_draws(opened("ins_const11", drive))


@pytest.mark.parametrize(("evaluation", "part"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
def test_process_rows_are_taken_where_the_config_says(opened: Open, evaluation: Any, part: float) -> None:
    provider = opened("ins_const11").provider
    bound = provider.bind(ProviderSettings(frozenset(), evaluation))
    assert bound is not None
    start = {"latitude": np.array(0.7), "velocity_t": np.array([5.0, -3.0]), "heading": np.radians(np.array(358.0))}
    sample = np.array([10.0, 0.701, 0.3, 6.0, -5.0, np.radians(4.0)])
    _, process, end = bound.step(bound.initial_state(InitialNominal(start)), sample)
    found = dict(
        zip([v.name for v in VARIABLES], np.split(process, np.cumsum([v.size for v in VARIABLES])[:-1]), strict=True)
    )
    assert found["latitude"][0] == pytest.approx(0.7 + part * 0.001)
    np.testing.assert_allclose(found["velocity_t"], [5.0 + part, -3.0 - 2.0 * part])
    assert np.degrees(found["heading"][0]) == pytest.approx((358.0 + 6.0 * part) % 360.0)
    assert np.degrees(found["heading_rate"][0]) == pytest.approx(0.6)
    np.testing.assert_allclose(found["acceleration_t"], [0.1, -0.2])
    np.testing.assert_allclose(end[2:4], [6.0, -5.0])


def test_the_compiled_error_equations_are_those_of_numpy() -> None:
    rng = np.random.default_rng(0)
    for size in (1.0, 1e-3, 0.0):
        c = size * np.array([*rng.normal(0, 1e-2, 3), *rng.normal(0, 10, 2), 5e-3, 0.1])
        recorded, acceleration = np.array([rng.uniform(-1.3, 1.3), 0, *rng.normal(0, 50, 2), 1]), rng.normal(0, 1, 2)
        found = np.empty(7)
        compiled_rate(c, recorded[0], recorded[2], recorded[3], acceleration[0], acceleration[1], 9.8, found)
        np.testing.assert_allclose(found, error_rate(c, recorded, acceleration, 9.8), rtol=1e-9, atol=1e-14)


def test_compiled_derived_variables_are_those_of_numpy() -> None:
    from importlib import import_module

    rng = np.random.default_rng(1)
    values = {"latitude": np.array(-0.9), "velocity_t": rng.normal(0, 50, 2), "acceleration_t": rng.normal(0, 1, 2)}
    for variable in LOCAL_TERMS:
        due = np.asarray(variable.function(**{name: values[name] for name in variable.needs}))
        found = np.empty(due.size)
        assert variable.compiled is not None
        twin = getattr(import_module(variable.compiled.module), variable.compiled.name)
        twin(*(np.atleast_1d(values[name]) for name in variable.needs), found)
        np.testing.assert_allclose(found.reshape(due.shape), due, rtol=1e-13, atol=1e-20, err_msg=variable.name)


def test_an_ins_that_is_corrected_at_the_start_goes_the_true_way(opened: Open) -> None:
    """Large errors, no drifts: what is recorded for 4 h less the correction of the first instant is where the vehicle was."""
    wrong = (
        "source.errors={attitude: [2 arcmin, -3 arcmin, 10 arcmin], velocity: [1 m/s, -2 m/s], latitude: 5 arcmin, "
        "longitude: 3 arcmin, gyro_bias: 0 deg/h, accel_bias: 0 ug}"
    )
    problem = opened("ins_6", wrong, "source.noise=false")
    record = load_record(problem)
    assert record.truth is not None
    ins, true = record.streams["ins"].values, record.truth.values
    params = np.array([0.0, 9.80665])
    errors = np.zeros(12)
    errors[:3], errors[3:5] = true["attitude_error_t"][0], ins[0, 2:4] - true["velocity_t"][0]
    errors[[6, 9]] = ins[0, :2] - [true["latitude"][0], true["longitude"][0]]
    state = correct(np.concatenate([ins[0], np.zeros(7)]), errors, params)
    rows = []
    for row in ins[1:]:
        state, _, end = step(state, np.concatenate([[10.0], row]), params)
        rows.append(end)
    found = np.array(rows)
    assert np.max(np.abs(ins[1:, 2:4] - true["velocity_t"][1:])) > 5.0
    np.testing.assert_allclose(found[:, 2:4], true["velocity_t"][1:], rtol=0, atol=2e-3)
    np.testing.assert_allclose(found[:, 0], true["latitude"][1:], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found[:, 1], true["longitude"][1:], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found[:, 8:11], true["attitude_error_t"][1:], rtol=0, atol=1e-6)


def test_a_row_that_is_not_complete_is_refused_and_a_gap_is_bridged_and_flagged(opened: Open) -> None:
    problem = opened("ins_const11", "source.duration=300 s")
    record = load_record(problem)
    ins = record.streams["ins"]
    broken = ins.values.copy()
    broken[7, 2] = np.nan
    with pytest.raises(DataError, match="the row at 70 s is not complete"):
        run_problem(problem, record=replace(record, streams={**record.streams, "ins": replace(ins, values=broken)}))
    keep = np.arange(len(ins)) != 7
    gapped = replace(ins, time=ins.time[keep], values=ins.values[keep])
    done = run_problem(problem, record=replace(record, streams={**record.streams, "ins": gapped}))
    assert [e.kind for e in done.events if e.source == "ins"] == ["gap"]
    assert np.max(done.prepared.steps.dt) == 20.0
    assert np.all(np.isfinite(done.estimate))


def test_a_log_without_a_place_asks_for_a_site(opened: Open) -> None:
    source = "source={kind: log, streams: {ins: {file: ins.csv}, velocity: {file: velocity.csv}}}"
    problem = opened("ins_const11", source, "nominal.at_start={speed: 10 m/s, heading: 90 deg}")
    np.testing.assert_allclose(problem.reference["velocity_t"], [10.0, 0.0], atol=1e-12)
    provider = replace(problem.provider, latitude=None)  # type: ignore[type-var]
    with pytest.raises(ConfigError, match="latitude"):
        provider.reference(InitialNominal({"C_bn": np.eye(3)}))


def test_the_source_of_a_log_is_asked_for_the_columns_of_the_ins(opened: Open) -> None:
    problem = opened("ins_const11", "nominal.columns={latitude: lat, longitude: null, heading: hdg}")
    assert dict(problem.wanted["ins"]) == {"lat": "rad", "velocity_E": "m/s", "velocity_N": "m/s", "hdg": "rad"}


def test_the_start_is_the_first_row(opened: Open) -> None:
    problem = opened("ins_const11", SHORT)
    prepared = prepare(problem, load_record(problem))
    assert prepared.steps.start == 0.0
    assert len(prepared.steps) == 10
