"""The provider `inertial.strapdown`: what it says of itself, where it starts, and what it refuses."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from estimfw_inertial import mechanization
from estimfw_inertial.strapdown import Strapdown, StrapdownConfig, strapdown
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimfw.config.types import Site
from estimfw.data.record import Record, Stream
from estimfw.errors import ConfigError, DataError, NumericalError
from estimfw.model.nominal import InitialNominal, ProviderSettings

FloatArray = NDArray[np.float64]

LATITUDE = np.radians(34.0)
PROVIDER = Strapdown(LATITUDE, 1.3, 100.0)
C_BN = Rotation.from_euler("ZXY", [0.5, 0.1, -0.2]).as_matrix()
START = InitialNominal({"C_bn": C_BN})
ALL = frozenset(mechanization.OPERATIONS)
COLUMNS = tuple(f"{what}_{axis}" for what in ("dtheta", "dvel") for axis in "xyz")


def site(latitude: str) -> Site:
    return Site.model_validate({"latitude": latitude, "height": "100 m"})


def config(**fields: Any) -> StrapdownConfig:
    return StrapdownConfig.model_validate({"kind": "inertial.strapdown", **fields})


def imu(rows: int, dt: float = 0.01) -> Stream:
    values = np.random.default_rng(1).normal(0.0, 0.01, (rows, 6))
    return Stream("imu", dt * np.arange(1, rows + 1, dtype=np.float64), values, COLUMNS, "increment", dt)


def record(**initial: FloatArray) -> Record:
    return Record({"imu": imu(4)}, initial=initial)


def test_the_variables_fill_a_row_in_the_order_of_the_mechanization() -> None:
    bound = PROVIDER.bind(ProviderSettings(frozenset()))
    V = np.array([1.0, 2.0, 3.0])
    row = bound.initial_row(InitialNominal({"C_bn": C_BN, "velocity_n": V}))
    variables = PROVIDER.variables(frozenset())
    assert sum(v.size for v in variables) == row.size == mechanization.ROW_SIZE
    pieces = np.split(row, np.cumsum([v.size for v in variables])[:-1])
    found = {v.name: piece.reshape(v.shape) for v, piece in zip(variables, pieces, strict=True)}
    assert np.array_equal(found["C_bn"], C_BN)
    assert found["velocity_n"].tolist() == [1.0, 2.0, 0.0], "V_U is held where it is not computed"
    assert found["f_n"].tolist() == [0.0, 0.0, float(found["gravity"])]
    assert found["earth_rate_n"] == pytest.approx(7.292115e-5 * np.array([0.0, np.cos(LATITUDE), np.sin(LATITUDE)]))
    assert not found["transport_rate_n"].any()
    assert not found["omega_nb_n"].any()


@pytest.mark.parametrize(
    ("computed", "varying"),
    [
        (frozenset(), {"C_bn", "f_n", "omega_nb_n", "velocity_n"}),
        (frozenset({"transport_rate"}), {"C_bn", "f_n", "omega_nb_n", "velocity_n", "transport_rate_n"}),
        (frozenset({"position_update"}), {"C_bn", "f_n", "omega_nb_n", "velocity_n", "earth_rate_n", "gravity"}),
    ],
)
def test_what_varies_follows_from_what_is_computed(computed: frozenset[str], varying: set[str]) -> None:
    """A row's constants are what the plan finds a model time-invariant by: they do not change in a run, the others do."""
    variables = PROVIDER.variables(computed)
    assert {v.name for v in variables if v.changes == "varying"} == varying
    bound = PROVIDER.bind(ProviderSettings(computed))
    sample = np.concatenate([[0.02], np.random.default_rng(2).normal(0.0, 0.1, 12)])
    state = bound.initial_state(InitialNominal({"C_bn": C_BN, "velocity_n": np.array([50.0, 80.0, 0.0])}))
    rows = []
    for _ in range(3):
        state, _, end = bound.step(state, sample)
        rows.append(end)
    edges = np.cumsum([v.size for v in variables])[:-1]
    for v, *pieces in zip(variables, *(np.split(row, edges) for row in rows), strict=True):
        same = all(np.array_equal(pieces[0], piece) for piece in pieces)
        assert same == (v.name not in varying), v.name


def test_the_reference_is_a_standing_base() -> None:
    found = PROVIDER.reference(InitialNominal({"C_bn": C_BN, "velocity_n": np.array([9.0, 9.0, 9.0])}))
    assert set(found) == {v.name for v in PROVIDER.variables(frozenset())}
    assert np.array_equal(found["C_bn"], C_BN)
    assert found["f_n"].tolist() == [0.0, 0.0, float(found["gravity"])]
    assert not found["velocity_n"].any()


def test_only_what_is_computed_is_switched_on() -> None:
    for name in mechanization.OPERATIONS:
        on = mechanization.switches(PROVIDER.bind(ProviderSettings(frozenset({name}))).params)
        assert {n for n in mechanization.OPERATIONS if getattr(on, n)} == {name}


@pytest.mark.parametrize(("point", "fraction"), [("start", 0.0), ("middle", 0.5), ("end", 1.0)])
def test_the_plans_evaluation_point_reaches_the_mechanization(point: Any, fraction: float) -> None:
    assert mechanization.switches(PROVIDER.bind(ProviderSettings(ALL, point)).params).point == fraction


def test_a_given_start_wins_over_that_of_the_record() -> None:
    assert PROVIDER.start(START, record(C_bn=np.eye(3))) is START


def test_without_a_given_start_the_record_tells_it() -> None:
    found = PROVIDER.start(None, record(C_bn=C_BN, velocity_n=np.ones(3)))
    assert np.array_equal(found.values["C_bn"], C_BN)
    assert np.array_equal(found.values["velocity_n"], np.ones(3))
    assert found.source == "the record"


def test_a_start_that_nobody_tells_is_refused_with_two_ways_out() -> None:
    with pytest.raises(DataError, match="nobody says what the attitude at the start is") as caught:
        PROVIDER.start(None, record())
    assert "yaw" in str(caught.value.hint)
    assert "inertial.inertial_frame" in str(caught.value.hint)


def test_many_starts_are_a_leading_axis() -> None:
    bound = PROVIDER.bind(ProviderSettings(ALL))
    turns = Rotation.random(5, random_state=1).as_matrix()
    states = bound.initial_state(InitialNominal({"C_bn": turns, "velocity_n": np.array([1.0, 2.0, 3.0])}))
    assert states.shape == (5, mechanization.N_STATE)
    for turn, state in zip(turns, states, strict=True):
        alone = bound.initial_state(InitialNominal({"C_bn": turn, "velocity_n": np.array([1.0, 2.0, 3.0])}))
        assert np.array_equal(state, alone)


@pytest.mark.parametrize("per_step", [1, 2])
def test_a_scan_over_a_stream_uses_every_row_once(per_step: int) -> None:
    bound = Strapdown(LATITUDE, 1.3, 100.0, per_step).bind(ProviderSettings(ALL))
    stream = imu(6)
    samples = bound.samples(stream, np.arange(0, 7, per_step, dtype=np.int64))
    assert samples.shape == (6 // per_step, bound.n_sample)
    assert samples[:, 0] == pytest.approx(0.01 * per_step)
    assert np.array_equal(samples[:, 1:].ravel(), stream.values.ravel())


def test_a_provider_is_a_value() -> None:
    assert pickle.loads(pickle.dumps(PROVIDER)) == PROVIDER
    assert hash(Strapdown(0.5, 1.0, 2.0)) == hash(Strapdown(0.5, 1.0, 2.0))
    assert Strapdown(0.5, 1.0, 2.0) != Strapdown(0.5, 1.0, 2.0, 1)


def test_a_config_makes_a_provider_at_the_site() -> None:
    found = strapdown(config(samples=1), site("34 deg"))
    assert found.latitude == pytest.approx(LATITUDE)
    assert (found.height, found.samples_per_step) == (100.0, 1)


def test_without_a_site_there_is_no_gravity() -> None:
    with pytest.raises(ConfigError, match="needs the place") as caught:
        strapdown(config(), None)
    assert "--set 'site={latitude: ..., longitude: ..., height: ...}'" in str(caught.value.hint)


@pytest.mark.parametrize("latitude", ["90 deg", "-90 deg"])
def test_a_pole_is_refused(latitude: str) -> None:
    with pytest.raises(NumericalError, match="there is no North at a pole"):
        strapdown(config(), site(latitude))


@pytest.mark.parametrize(("latitude", "warned"), [("89.5 deg", True), ("-89.5 deg", True), ("88 deg", False)])
def test_near_a_pole_there_is_a_warning(latitude: str, warned: bool) -> None:
    assert bool(strapdown(config(), site(latitude)).warnings) is warned
