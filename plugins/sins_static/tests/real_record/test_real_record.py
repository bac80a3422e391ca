"""The public record `lasergyro`: estimfw against a textbook filter (conftest), and against what is known of the record.

Samples 100 to 30000 in pairs, 0.02 s a step: that is 29901 samples, so the last one is left over and the run ends at 299.99 s.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.run.run import Collected

FloatArray = NDArray[np.float64]
Run = Callable[..., Collected]
Filter = Callable[..., FloatArray]

REPOSITORY = Path(__file__).parents[4]
STEPS_PER_S = 50
#: yaw, pitch, roll (deg) at 300 s, where right filters end.
KNOWN = np.array([-90.6, 0.80, 0.31])
COARSE = "initial_attitude={kind: inertial.inertial_frame, duration: 120 s}"
ARCMIN, ARCSEC = 1.0 / 60.0, 1.0 / 3600.0


def attitude(done: Collected) -> FloatArray:
    """yaw, pitch, roll (K, 3), deg."""
    return np.asarray(np.degrees(done.output[:, :3]))


def at(second: float) -> int:
    """The step that ends so many seconds after the start."""
    return round(second * STEPS_PER_S) - 1


def measured_and_constant_force(states: int) -> tuple[str, str]:
    """Overrides of ``policies`` for measured and for constant specific force."""
    own = (
        "sins_static.remove_coriolis, sins_static.bias_in_navigation_frame, sins_static.remove_vertical_channel, "
        "{kind: sins_static.prune_unobservable, protect: [attitude_error]}"
        if states == 7
        else ""
    )
    constant = ", ".join(part for part in ("sins_static.constant_specific_force", own) if part)
    return f"policies=[{own}]", f"policies=[{constant}]"


@pytest.mark.parametrize("states", [12, 7])
def test_the_textbook_filter_agrees_to_a_second_of_arc_in_level_and_a_fifth_of_a_minute_in_yaw(
    run: Run, textbook: Filter, window: tuple[FloatArray, FloatArray], states: int
) -> None:
    ours = run(states)
    assert ours.prepared.steps.time[-1] == pytest.approx(299.99)
    expected = textbook(window, states=states)
    apart = np.abs(attitude(ours) - expected)[at(10.0) :].max(axis=0)
    assert apart[0] < 0.2 * ARCMIN
    assert apart[1:].max() < 1.0 * ARCSEC


def test_the_honest_sigmas_of_seven_states_are_those_of_twelve(run: Run) -> None:
    """Two filters of one record: what the small one leaves out of its own sigma is what the large one has in it."""
    seven, twelve = run(7), run(12)
    assert seven.honest is not None
    honest = seven.honest.output_sigma[at(60.0) :, :3]
    np.testing.assert_allclose(honest, twelve.output_sigma[at(60.0) :, :3], rtol=0.02)
    assert np.all(seven.output_sigma[-1, 1:3] < 0.3 * honest[-1, 1:])


@pytest.mark.slow
@pytest.mark.parametrize("first", [98, 100])
def test_a_window_that_is_off_by_one_sample_is_inside_the_agreement_too(
    run: Run, textbook: Filter, lasergyro: Path, first: int
) -> None:
    """Samples counted from 0, or a window that ends with sample 30000: the vehicle moves 0.6 arcsec in 0.01 s."""
    with np.load(lasergyro / "lasergyro.npz") as file:
        expected = textbook((file["dtheta"][first:30000], file["dvel"][first:30000]))
    apart = np.abs(attitude(run(12))[-1] - expected[-1])
    assert apart[0] < 0.2 * ARCMIN
    assert apart[1:].max() < 1.0 * ARCSEC


@pytest.mark.parametrize("states", [12, 7])
@pytest.mark.parametrize("start", [*(f"initial_attitude.yaw={yaw} deg" for yaw in (-92, -91, -87, -82)), COARSE])
def test_every_start_ends_at_the_known_attitude(run: Run, states: int, start: str) -> None:
    done = run(states, start)
    off = np.abs(attitude(done)[-1] - KNOWN)
    assert off[0] < 3.0 * ARCMIN
    assert off[1:].max() < 1.0 * ARCMIN
    assert all(done.disposition[:, 0] == 0), "every measurement is fused"


def test_a_coarse_start_hands_over_its_full_covariance(run: Run) -> None:
    """Not the 0.5, 0.5, 5 deg of the config: roll and heading are tied by tan(latitude), through the accelerometer bias."""
    done = run(12, COARSE)
    P = done.prepared.prior[1][3:6, 3:6]
    assert pytest.approx(done.prepared.start.covariance["attitude"], rel=1e-9) == P
    assert P[1, 2] > 0.0 != P[0, 2]
    assert np.degrees(np.sqrt(np.diag(P))) / ARCMIN == pytest.approx([0.35, 0.35, 9.0], rel=0.2)
    assert done.prepared.steps.start == pytest.approx(0.99 + 120.0)
    assert np.degrees(done.output_sigma[0, 0]) / ARCMIN < 10.0, "the yaw sigma of the first step is already small"


def test_npz_and_imu_give_the_same(run: Run) -> None:
    npz, imu = run(12), run(12, file="lasergyro.imu")
    assert attitude(imu) == pytest.approx(attitude(npz), abs=1e-9)


@pytest.mark.parametrize("states", [12, 7])
def test_the_whole_record_runs(run: Run, states: int) -> None:
    """184 619 samples from the 100th on: 92 309 pairs, and one left over."""
    done = run(states, "source.last_sample=null")
    assert len(done.prepared.steps) == 92309
    assert done.prepared.steps.time[-1] == pytest.approx(1847.17)
    assert all(done.disposition[:, 0] == 0)
    yaw = attitude(done)[[at(300.0), at(600.0), at(1200.0), -1], 0]
    assert yaw == pytest.approx(KNOWN[0], abs=3.0 * ARCMIN), "the vehicle sways, but does not turn"


def test_a_variance_for_a_density_is_another_filter(run: Run) -> None:
    variance = run(12, "measurements.zero_velocity.noise=0.1 m/s")
    assert abs(attitude(variance)[at(60.0), 0] - attitude(run(12))[at(60.0), 0]) > 1.0


def test_seven_states_lose_next_to_nothing_against_twelve(run: Run) -> None:
    apart = np.abs(attitude(run(7)) - attitude(run(12)))[[at(60.0), -1]].max(axis=0)
    assert apart[0] < 0.3 * ARCMIN
    assert apart[1:].max() < 1.0 * ARCSEC


def test_seven_states_do_not_see_the_east_gyro_bias_in_their_yaw(run: Run) -> None:
    """0.03 deg/h east over the north component of the Earth's rate: 8.4 arcmin that the smaller filter's own P lacks."""
    variance = {n: run(n).sigma[-1, 5 if n == 12 else 4] ** 2 for n in (12, 7)}
    lost = np.degrees(np.sqrt(variance[12] - variance[7])) / ARCMIN
    expected = np.degrees(np.radians(0.03 / 3600.0) / (7.292115e-5 * np.cos(np.radians(34.246048)))) / ARCMIN
    assert lost == pytest.approx(8.4, abs=0.05)
    assert lost == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("states", [12, 7])
@pytest.mark.parametrize(("yaw", "after_a_minute"), [(-92, 8.06), (-102, 63.96)])
def test_a_constant_specific_force_costs_yaw_while_the_attitude_error_is_large(
    run: Run, states: int, yaw: int, after_a_minute: float
) -> None:
    """In arcmin after 60 s, from the textbook filter; little of it is left after 300 s."""
    measured, constant = measured_and_constant_force(states)
    start = f"initial_attitude.yaw={yaw} deg"
    cost = (attitude(run(states, start, constant)) - attitude(run(states, start, measured)))[:, 0] / ARCMIN
    assert cost[at(60.0)] == pytest.approx(after_a_minute, abs=0.05)
    assert abs(cost[-1]) < (0.7 if yaw == -92 else 3.0)


@pytest.mark.slow
@pytest.mark.parametrize("states", [12, 7])
@pytest.mark.parametrize("yaw", [-92, -102])
def test_the_textbook_filter_pays_the_same_for_a_constant_specific_force(
    run: Run, textbook: Filter, window: tuple[FloatArray, FloatArray], states: int, yaw: int
) -> None:
    _, constant = measured_and_constant_force(states)
    ours = attitude(run(states, f"initial_attitude.yaw={yaw} deg", constant))
    expected = textbook(window, yaw, states=states, constant_force=True)
    assert ours[at(60.0)] == pytest.approx(expected[at(60.0)], abs=0.02 * ARCMIN)
    assert ours[-1] == pytest.approx(expected[-1], abs=0.02 * ARCMIN)


def test_three_hundred_seconds_take_less_than_three_tenths_of_one(run: Run) -> None:
    # Other tests run beside this one: what the code can do shows when they leave it a core.
    assert any(run(12).timing.filter < 0.3 for _ in range(20))


def test_the_command_of_the_readme_ends_at_the_known_attitude(lasergyro: Path) -> None:
    command = [
        sys.executable, "-m", "estimfw.cli.main", "run", "examples/lasergyro_12.yaml",
        "--set", f"source.file={lasergyro / 'lasergyro.imu'}", "--json",
    ]  # fmt: skip
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    answer = json.loads(done.stdout)
    found = [answer["attitude"][name]["value"] for name in ("yaw", "pitch", "roll")]
    assert found == pytest.approx(KNOWN.tolist(), abs=3.0 * ARCMIN)
    assert found[1:] == pytest.approx(KNOWN[1:].tolist(), abs=1.0 * ARCMIN)
    assert answer["attitude"]["heading"]["value"] == pytest.approx(-answer["attitude"]["yaw"]["value"])
