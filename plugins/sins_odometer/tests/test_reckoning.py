"""Dead reckoning after an alignment: the track of a perfect drive, what a wrong heading does to it, and where it begins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimfw_inertial.rotation import attitude_matrix, exponential
from estimfw_sins_odometer import compiled
from estimfw_sins_odometer.aligned import AlignedConfig, aligned
from estimfw_sins_odometer.reckoned import DeadReckoning
from estimfw_sins_odometer.vehicle import Vehicle
from numpy.typing import NDArray

from estimfw.data.record import Record
from estimfw.errors import DataError
from estimfw.model.nominal import InitialNominal, ProviderSettings
from estimfw.run.dataset import result_dataset
from estimfw.run.result_file import write_result
from estimfw.run.run import run_problem

FloatArray = NDArray[np.float64]
ROW = 15


def tracked(vehicle: Vehicle, record: Record, start: InitialNominal, *, plain: bool = False) -> FloatArray:
    """Rows (K, 15) of a whole drive."""
    provider = DeadReckoning(vehicle)
    bound = provider.bind(ProviderSettings(frozenset()))
    samples = bound.samples(record.streams["imu"], np.arange(1, len(record.streams["imu"]), 100))
    state = bound.initial_state(provider.start(start, record))
    made, process = np.empty((len(samples), ROW)), np.empty(ROW)
    for k, sample in enumerate(samples):
        if plain:
            state, _, made[k] = bound.step(state, sample)
        else:
            compiled.reckoning_step(state, sample, bound.params, process, made[k])
    return made


def true_start(record: Record) -> FloatArray:
    assert record.truth is not None
    return np.asarray(record.truth.values["C_bn"][0])


def test_a_perfect_drive_from_the_true_attitude_ends_where_it_really_does(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=1)
    made = tracked(vehicle, record, InitialNominal({"C_bn": true_start(record)}))
    true = record.truth.values["track"][100 * np.arange(1, len(made) + 1)]
    assert np.linalg.norm(true[-1]) > 1000.0
    assert np.max(np.abs(made[:, 12:15] - true)) < 0.5


def test_a_wrong_heading_moves_the_end_sideways_by_angle_times_way(drive: Any, vehicle: Vehicle) -> None:
    record, angle = drive(seed=2, duration="300 s"), np.radians(0.2)
    C = true_start(record)
    straight, off = (
        tracked(vehicle, record, InitialNominal({"C_bn": turned}))[-1, 12:15]
        for turned in (C, exponential(np.array([0.0, 0.0, angle])) @ C)
    )
    way = straight - record.truth.values["track"][0]
    assert (off - straight)[:2] == pytest.approx(
        angle * np.array([-way[1], way[0]]), abs=float(2e-4 * np.linalg.norm(way))
    )


def test_a_known_gyro_bias_is_taken_off(drive: Any, vehicle: Vehicle) -> None:
    record, bias = drive(seed=2, duration="300 s"), np.radians([1.0, -2.0, 3.0]) / 3600.0
    stream = record.streams["imu"]
    values = stream.values.copy()
    values[:, :3] += 0.01 * bias
    biased = replace(record, streams={"imu": replace(stream, values=values)})
    C = true_start(record)
    true = tracked(vehicle, record, InitialNominal({"C_bn": C}))
    told = tracked(vehicle, biased, InitialNominal({"C_bn": C, "gyro_bias_b": bias}))
    silent = tracked(vehicle, biased, InitialNominal({"C_bn": C}))
    assert np.max(np.abs(told[-1, 12:15] - true[-1, 12:15])) < 1e-3
    assert np.max(np.abs(silent[-1, 12:15] - true[-1, 12:15])) > 0.2


def test_compiled_and_plain_tracks_agree(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=2, duration="60 s", errors=True, speed="raw")
    start = InitialNominal({"C_bn": true_start(record), "gyro_bias_b": np.array([1e-6, 2e-6, -1e-6])})
    plain, fast = (tracked(vehicle, record, start, plain=p) for p in (True, False))
    assert fast == pytest.approx(plain, rel=1e-11, abs=1e-11)


def test_it_begins_with_what_an_alignment_of_the_same_drive_found(opened: Any, tmp_path: Path) -> None:
    done = run_problem(opened("odometer_aeba.yaml"))
    path = tmp_path / "result.nc"
    write_result(result_dataset(done), path, force=False)
    config = {"kind": "sins_odometer.aligned", "result": str(path), "at": "300 s"}
    start = aligned(AlignedConfig.model_validate(config), None).find(Record({}))
    k = int(np.flatnonzero(done.prepared.steps.time <= 300.0)[-1])
    assert start.time == pytest.approx(done.prepared.steps.time[k])
    assert start.values["C_bn"] == pytest.approx(attitude_matrix(*done.output[k, :3]), abs=1e-12)
    assert start.values["gyro_bias_b"] == pytest.approx(done.estimate[k, 3:6])
    track = run_problem(opened("odometer_track.yaml", f"initial_attitude.result={path}"))
    assert track.output_error is not None
    east, north = np.abs(track.output_error[-1, :2])
    assert track.prepared.steps.start == pytest.approx(start.time) and np.hypot(east, north) < 30.0


def test_without_an_alignment_it_is_refused(tmp_path: Path, drive: Any, vehicle: Vehicle) -> None:
    missing = AlignedConfig.model_validate({"kind": "sins_odometer.aligned", "result": str(tmp_path / "no.nc")})
    with pytest.raises(DataError, match="no result"):
        aligned(missing, None).find(Record({}))
    with pytest.raises(DataError, match="known attitude"):
        DeadReckoning(vehicle).start(None, drive(seed=2, duration="60 s"))
