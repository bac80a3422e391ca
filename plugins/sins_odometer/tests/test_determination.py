"""Alignment by determination against another solver of Wahba's problem, and its compiled twin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from estimfw_inertial.rotation import euler_angles
from estimfw_sins_odometer import compiled
from estimfw_sins_odometer.determined import Determination
from estimfw_sins_odometer.vehicle import Vehicle
from estimfw_sins_odometer.wahba import best_rotation, davenport
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.data.record import Record
from estimfw.model.nominal import ProviderSettings

FloatArray = NDArray[np.float64]


def rows_of(provider: Determination, record: Record, *, plain: bool) -> FloatArray:
    """The rows of a whole drive."""
    bound = provider.bind(ProviderSettings(frozenset()))
    stream = record.streams["imu"]
    rows = np.arange(1, len(stream), 100)
    samples = bound.samples(stream, rows)
    state = bound.initial_state(provider.start(None, record))
    made = np.empty((len(samples), 28))
    process = np.empty(28)
    for k, sample in enumerate(samples):
        if plain:
            state, _, made[k] = bound.step(state, sample)
        else:
            compiled.determination_step(state, sample, bound.params, process, made[k])
    return made


def test_the_matrix_of_davenport_is_the_sum_of_squares_of_wahba() -> None:
    rng = np.random.default_rng(1)
    beta, alpha = rng.standard_normal((2, 50, 3))
    q = rng.standard_normal((50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    C = Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_matrix()
    squares = np.sum(np.square(beta - np.einsum("nij,nj->ni", C, alpha)), axis=1)
    assert np.einsum("ni,nij,nj->n", q, davenport(beta, alpha), q) == pytest.approx(squares)


@pytest.mark.parametrize("seed", range(5))
def test_the_attitude_is_that_of_another_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    C = Rotation.random(random_state=rng).as_matrix()
    alpha = 10.0 * rng.standard_normal((40, 3))
    beta = alpha @ C.T + 0.1 * rng.standard_normal((40, 3))
    found, smallest = best_rotation(davenport(beta, alpha).sum(axis=0))
    other, distance = Rotation.align_vectors(beta, alpha)
    assert found == pytest.approx(other.as_matrix(), abs=1e-10)
    assert np.sqrt(smallest) == pytest.approx(distance, rel=1e-9)


def test_a_drive_is_determined_as_another_solver_does_with_its_vectors(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=3)
    made = rows_of(Determination(vehicle), record, plain=False)
    alpha, beta, C_bi = made[:, 18:21], made[:, 21:24], made[:, 9:18].reshape(-1, 3, 3)
    for k in (99, 299, len(made) - 1):
        start = Rotation.align_vectors(beta[: k + 1], alpha[: k + 1])[0].as_matrix()
        ours = made[k, :9].reshape(3, 3) @ C_bi[k].T
        turned = ours @ start.T  # C_{n0}^{n(t)}: the same for all vectors, small and known
        angle = np.linalg.norm(Rotation.from_matrix(turned).as_rotvec())
        assert angle < 7.292115e-5 * (k + 1) + 0.003, "the Earth and the way turn n, nothing else does"


def test_a_perfect_drive_is_determined(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=1)
    made = rows_of(Determination(vehicle), record, plain=False)
    last = 100 * len(made)
    assert record.truth is not None
    error = euler_angles(made[-1, :9].reshape(3, 3)) - euler_angles(record.truth.values["C_bn"][last])
    assert np.abs(np.degrees(error)) == pytest.approx(np.zeros(3), abs=0.05)


def test_dropping_the_transport_rate_costs_more_than_anything(drive: Any, vehicle: Vehicle) -> None:
    record = drive(seed=1)
    assert record.truth is not None
    errors = {}
    for transport in (True, False):
        made = rows_of(Determination(vehicle, transport=transport), record, plain=False)
        error = euler_angles(made[-1, :9].reshape(3, 3)) - euler_angles(record.truth.values["C_bn"][100 * len(made)])
        errors[transport] = abs(np.degrees(error[0]))
    assert errors[False] > 0.2 > 5.0 * errors[True]


@pytest.mark.parametrize("normalised", [False, True])
def test_compiled_and_plain_drives_agree(drive: Any, vehicle: Vehicle, normalised: bool) -> None:
    record = drive(seed=2, duration="100 s", errors=True, speed="raw")
    provider = Determination(vehicle, normalised=normalised)
    plain, fast = (rows_of(provider, record, plain=p) for p in (True, False))
    assert fast == pytest.approx(plain, rel=1e-7, abs=1e-7)
