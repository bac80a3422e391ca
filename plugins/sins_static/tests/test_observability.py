"""What a standing base can determine, anywhere and in any attitude: spec section 1 and correction 11."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.analysis.frozen import frozen_stretch
from estimfw.config.compose import Problem
from estimfw.run.observe import Observed, observe

FloatArray = NDArray[np.float64]
Composed = Callable[..., Problem]

EARTH_RATE = 7.292115e-5
COMMON = ("sins_static.constant_specific_force",)
NAVIGATION = (*COMMON, "sins_static.bias_in_navigation_frame")
FLAT = (*NAVIGATION, "sins_static.remove_vertical_channel")
CORIOLIS = "sins_static.remove_coriolis"

ALWAYS = {"accel_bias[E]", "gyro_bias[E]"}
TRIPLES = {frozenset(ALWAYS | {third}) for third in ("accel_bias[N]", "gyro_bias[N]", "gyro_bias[U]")}


def place(seed: int) -> tuple[float, tuple[str, ...]]:
    """A latitude of 1 to 85 deg, and overrides: an attitude, and biases unequal by axis."""
    rng = np.random.default_rng(seed)
    latitude = float(rng.uniform(1.0, 85.0))
    yaw, pitch, roll = rng.uniform(-180, 180), rng.uniform(-80, 80), rng.uniform(-180, 180)
    accel, gyro = rng.uniform(20, 500, 3), rng.uniform(0.002, 0.05, 3)
    return latitude, (
        f"initial_attitude={{yaw: {yaw} deg, pitch: {pitch} deg, roll: {roll} deg}}",
        f"blocks.accel_bias.sigma=[{', '.join(f'{a} ug' for a in accel)}]",
        f"blocks.gyro_bias.sigma=[{', '.join(f'{g} deg/h' for g in gyro)}]",
    )


def site(latitude: float) -> str:
    return f"site={{latitude: {latitude} deg, longitude: 75 deg, height: 100 m}}"


def observed(composed: Composed, latitude: float, policies: tuple[str, ...], *more: str) -> Observed:
    return observe(composed("static_12", site(latitude), f"policies=[{', '.join(policies)}]", *more), record=False)


def sets(found: Observed) -> set[frozenset[str]]:
    assert found.removable.complete
    return {frozenset(found.labels(s)) for s in found.removable.sets}


@pytest.mark.parametrize("coriolis", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_ranks_are_nine_of_twelve_and_seven_of_ten_and_three_triples_can_go(
    composed: Composed, seed: int, coriolis: bool
) -> None:
    latitude, more = place(seed)
    without = () if coriolis else (CORIOLIS,)
    for states, rank, policies in ((12, 9, NAVIGATION), (10, 7, FLAT)):
        found = observed(composed, latitude, (*without, *policies), *more)
        assert (len(found.names.states), found.frozen.rank) == (states, rank)
        assert not found.frozen.spectrum.near_edge
        assert sets(found) == TRIPLES


@pytest.mark.parametrize("seed", range(4))
def test_the_reduced_filter_is_observable(composed: Composed, seed: int) -> None:
    latitude, more = place(seed)
    prune = "{kind: sins_static.prune_unobservable, protect: [attitude_error]}"
    found = observed(composed, latitude, (CORIOLIS, *FLAT, prune), *more)
    assert found.frozen.rank == len(found.names.states) == 7
    assert found.directions == () and found.chosen is None


def test_at_the_equator_two_triples_can_go(composed: Composed) -> None:
    """There wU is zero, and gyro_bias[N] shows in the tilt, whatever accel_bias[N] is."""
    found = observed(composed, 0.0, FLAT)
    assert sets(found) == {t for t in TRIPLES if "gyro_bias[N]" not in t}


@pytest.mark.parametrize("latitude", [1.0, 34.0, 85.0])
def test_directions_are_the_null_space_of_the_map_of_the_spec(
    composed: Composed, quotient: Callable[..., FloatArray], latitude: float
) -> None:
    _, more = place(5)
    problem = composed("static_12", site(latitude), f"policies=[{', '.join(FLAT)}]", *more)
    found = observe(problem, record=False)
    ten = list(found.names.states)
    seven = [s for s in ten if s not in ("accel_bias[E]", "accel_bias[N]", "gyro_bias[E]")]
    T = quotient(ten, seven, problem.reference)
    told = np.zeros((3, len(ten)))
    for row, direction in zip(told, found.directions, strict=True):
        for term in direction.terms:
            row[ten.index(term.state)] = term.coefficient
    sigma = np.array(found.prior_sigma)
    whitened = told / sigma / np.linalg.norm(told / sigma, axis=1)[:, None]
    seen = T * sigma / np.linalg.norm(T * sigma, axis=1)[:, None]
    assert np.linalg.matrix_rank(whitened) == 3
    assert np.abs(seen @ whitened.T).max() < 1e-6


def test_directions_are_told_in_names(composed: Composed) -> None:
    texts = [d.text for d in observed(composed, 34.0, FLAT).directions]
    assert "attitude_error[U] - 6.05e-05 1/s * gyro_bias[E]" in texts
    assert "attitude_error[N] + 9.8 m/rad/s^2 * accel_bias[E] + 0.675 * attitude_error[U]" in texts


@pytest.mark.parametrize("seed", range(3))
def test_biases_of_the_body_have_sets_of_their_own(composed: Composed, seed: int) -> None:
    """Tilted: against the rank of every rest, in units in which the Earth's rate and gravity are 1."""
    latitude, more = place(seed)
    problem = composed("static_12", site(latitude), f"policies=[{', '.join(COMMON)}]", *more)
    found = observe(problem, record=False)
    assert found.frozen.rank == 9
    frozen = frozen_stretch(problem.model, problem.reference)
    scale = np.array([9.8 / EARTH_RATE] * 3 + [1.0] * 3 + [9.8] * 3 + [EARTH_RATE] * 3)
    F, H = frozen.F / scale[:, None] * scale / EARTH_RATE, frozen.H * scale / scale[0]

    def rank_without(gone: tuple[int, ...]) -> int:
        kept = [i for i in range(12) if i not in gone]
        blocks = [H[:, kept]]
        for _ in range(len(kept) - 1):
            blocks.append(blocks[-1] @ F[np.ix_(kept, kept)])
        return int(np.linalg.matrix_rank(np.vstack(blocks), tol=1e-7))

    wanted = {
        frozenset(problem.model.states[i] for i in s) for s in combinations(range(6, 12), 3) if rank_without(s) == 9
    }
    assert sets(found) == wanted
    assert len(wanted) > 3 and not any("[E]" in state for s in wanted for state in s)


def test_degrees_after_ten_minutes_are_those_of_the_spec(composed: Composed) -> None:
    found = observe(composed("static_12"))
    assert found.record is not None and not found.time_invariant
    end = dict(zip(found.names.states, found.record.degrees.posterior[-1], strict=True))
    wanted = {
        "gyro_bias[U]": 1.0,
        "gyro_bias[R]": 1.0,
        "accel_bias[R]": 1.0,
        "accel_bias[F]": 1.0,
        "gyro_bias[F]": 0.58,
    }
    assert all(end[state] == pytest.approx(degree, abs=0.005) for state, degree in wanted.items())
    assert end["accel_bias[U]"] == pytest.approx(0.03, abs=0.005)


def test_along_a_still_record_the_gramian_has_the_frozen_rank(composed: Composed) -> None:
    """Known but for the unobservable: the level tilts to a tenth of what their biases leave of them."""
    found = observe(composed("static_12", f"policies=[{CORIOLIS}, {', '.join(NAVIGATION)}]"), segments=4)
    assert found.record is not None and found.time_invariant and found.record.stripped
    assert [s.gramian.rank for s in found.record.segments] == [s.rank for s in found.record.segments] == [9] * 4
    assert found.record.segments[-1].gramian.informed == 8
    degrees = found.record.degrees
    for state in ("attitude_error[E]", "attitude_error[N]"):
        i = found.names.states.index(state)
        assert degrees.posterior[-1, i] == pytest.approx(found.frozen.degree[i], rel=0.05)
        assert degrees.observable_part[-1, i] < 0.2 * degrees.posterior[-1, i]
