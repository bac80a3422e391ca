"""Wrong units, wrong axes and dead sensors in a standing record are found, with the guess."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.data.record import Record
from estimfw.errors import DataError

Load = Callable[..., Record]
Write = Callable[..., Path]

PERIOD = 0.01


def refusal(load: Load, path: Path, **settings: object) -> str:
    with pytest.raises(DataError) as caught:
        load(path, **settings)
    return str(caught.value)


def test_milliseconds_for_seconds(load: Load, npz_of: Write, csv_of: Write, standing: Any) -> None:
    slow = standing.changed(t=standing.t * 1000.0)
    against_header = refusal(load, npz_of(slow))
    assert "the time stamps are 10 s apart, the sampling interval is 0.01 s: time in ms, not in s?" in against_header
    assert "by the factor 0.001" in against_header
    assert "the time stamps are 10 s apart: time in ms, not in s?" in refusal(load, csv_of(slow.rows()))
    assert load(csv_of(slow.rows()), units={"time": "ms"}).events == ()


def test_another_rate_than_the_configured_one(load: Load, csv_of: Write, standing: Any) -> None:
    text = refusal(load, csv_of(standing.rows()), rate="200 Hz")
    assert "the time stamps are 0.01 s apart (100 Hz), the sampling interval is 0.005 s (200 Hz)" in text


def test_g_for_metres_per_second_squared(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=standing.dvel / 9.80665)))
    assert "gravity is 9.7965 m/s^2: g for m/s^2? (factor 9.80665)" in text


def test_degrees_for_radians(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dtheta=np.degrees(standing.dtheta))))
    assert "the Earth's is 7.2921e-05 rad/s: deg for rad? (factor 0.0174533)" in text


def test_rates_for_increments(load: Load, npz_of: Write, csv_of: Write, standing: Any) -> None:
    rates = standing.changed(dtheta=standing.dtheta / PERIOD, dvel=standing.dvel / PERIOD)
    text = refusal(load, csv_of(rates.rows()))
    assert text.count("rates taken for increments? (factor 0.01)") == 2
    assert "say `values: rate`" in text
    assert load(csv_of(rates.rows()), values="rate").events == ()
    text = refusal(load, npz_of(rates))
    assert text.count("rates taken for increments? (factor 0.01)") == 2
    assert "an NPZ log holds increments, `dtheta` in rad and `dvel` in m/s over each interval: correct the log" in text


def test_increments_for_rates(load: Load, csv_of: Write, standing: Any) -> None:
    text = refusal(load, csv_of(standing.rows()), values="rate")
    assert text.count("increments taken for rates? (factor 100)") == 2
    assert "say `values: increment`" in text


def test_rates_in_degrees_and_g_for_increments(load: Load, csv_of: Write, standing: Any) -> None:
    rates = standing.changed(dtheta=np.degrees(standing.dtheta) / PERIOD, dvel=standing.dvel / 9.80665 / PERIOD)
    text = refusal(load, csv_of(rates.rows()))
    assert "rates taken for increments, and g for m/s^2?" in text
    assert "rates taken for increments, and deg for rad?" in text
    assert "say `values: rate` and `units: {gyro: deg/s, accel: g}`" in text
    assert load(csv_of(rates.rows()), values="rate", units={"gyro": "deg/s", "accel": "g"}).events == ()


@pytest.mark.parametrize(
    ("values", "scale", "units"),
    [
        ("increment", (np.degrees(1.0), 1.0), "{gyro: deg}"),
        ("increment", (1.0, 1.0 / 9.80665), "{accel: g*s}"),
        ("increment", (np.degrees(3600.0), 1.0), "{gyro: arcsec}"),
        ("rate", (np.degrees(1.0), 1.0 / 9.80665), "{gyro: deg/s, accel: g}"),
        ("rate", (np.degrees(3600.0), 1.0), "{gyro: deg/h}"),
    ],
)
def test_the_units_that_the_hint_says_cure_the_log(
    load: Load, csv_of: Write, standing: Any, values: str, scale: tuple[float, float], units: str
) -> None:
    divided = {"increment": 1.0, "rate": PERIOD}[values]
    odd = standing.changed(dtheta=standing.dtheta * scale[0] / divided, dvel=standing.dvel * scale[1] / divided)
    assert f"say `units: {units}`" in refusal(load, csv_of(odd.rows()), values=values)
    said = dict(pair.split(": ") for pair in units.strip("{}").split(", "))
    assert load(csv_of(odd.rows()), values=values, units=said).events == ()


def test_units_that_were_said_but_are_not_those_of_the_log(load: Load, csv_of: Write, standing: Any) -> None:
    text = refusal(load, csv_of(standing.rows()), units={"gyro": "deg", "accel": "g*s"})
    assert "m/s^2 for g?" in text
    assert "rad for deg?" in text
    assert "say `units: {gyro: rad, accel: m/s}`" in text


def test_a_force_that_is_no_known_mistake(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=1.7 * standing.dvel)))
    assert "this is no record of a standing vehicle in SI units" in text
    assert "`checks: false`" in text


def test_z_down(load: Load, npz_of: Write, standing: Any) -> None:
    turn = np.diag([1.0, -1.0, -1.0])
    down = standing.changed(dtheta=standing.dtheta @ turn, dvel=standing.dvel @ turn)
    text = refusal(load, npz_of(down))
    assert "the reaction to gravity shows on -z, not on +z: z points down?\n  say in `source.mounting`" in text
    assert load(npz_of(down), mounting={"roll": "180 deg"}).streams["imu"].values[:, 5].min() > 0.0


def test_accelerometers_with_flipped_signs_are_told_from_z_down(load: Load, npz_of: Write, standing: Any) -> None:
    text = refusal(load, npz_of(standing.changed(dvel=-standing.dvel)))
    assert "the signs of the accelerometers are flipped" in text


@pytest.mark.parametrize(
    ("order", "signs", "axis", "turn"),
    [
        ([2, 0, 1], [1, 1, 1], "+x", {"roll": "-90 deg"}),
        ([2, 0, 1], [-1, -1, 1], "-x", {"roll": "90 deg"}),
        ([1, 2, 0], [1, 1, 1], "+y", {"pitch": "90 deg"}),
        ([1, 2, 0], [1, -1, -1], "-y", {"pitch": "-90 deg"}),
    ],
)
def test_axes_swapped(
    load: Load, npz_of: Write, standing: Any, order: list[int], signs: list[int], axis: str, turn: dict[str, str]
) -> None:
    swapped = standing.changed(dtheta=standing.dtheta[:, order] * signs, dvel=standing.dvel[:, order] * signs)
    text = refusal(load, npz_of(swapped))
    assert f"the reaction to gravity shows on {axis}, not on +z: axes swapped?" in text
    assert f"`mounting: {str(turn).replace(chr(39), '')}`" in text
    assert "reorder them as right, forward, up (in `source.columns`, if it is CSV)" in text
    assert load(npz_of(swapped), mounting=turn).streams["imu"].values[:, 5].min() > 0.0


def test_checks_can_be_switched_off(load: Load, npz_of: Write, standing: Any) -> None:
    assert load(npz_of(standing.changed(dvel=-standing.dvel)), checks=False).events == ()


def test_a_large_gyro_bias_is_a_warning_not_a_unit(load: Load, npz_of: Write, standing: Any) -> None:
    biased = standing.changed(dtheta=standing.dtheta + np.radians([0.24, 0.0, 0.0]) * PERIOD)
    (event,) = load(npz_of(biased)).events
    assert event.kind == "rate"
    assert "large gyro biases, or the vehicle turns" in event.text


def test_a_mean_rate_beyond_any_bias_is_told_to_be_of_another_unit(load: Load, npz_of: Write, standing: Any) -> None:
    (event,) = load(npz_of(standing.changed(dtheta=standing.dtheta + 0.05 * PERIOD))).events
    assert "or the gyros are in deg, not in rad" in event.text


@pytest.mark.parametrize("rows", [slice(300, 700), slice(500, 530)], ids=["4 s", "0.3 s"])
def test_a_noisy_channel_that_freezes_for_a_while_is_flagged(
    load: Load, npz_of: Write, standing: Any, rows: slice
) -> None:
    dvel = standing.dvel.copy()
    dvel[rows, 0] = dvel[rows.start, 0]
    (event,) = load(npz_of(standing.changed(dvel=dvel))).events
    assert (event.kind, event.count) == ("stuck", rows.stop - rows.start)
    assert event.text.startswith("accelerometer x shows")


def test_a_channel_that_freezes_again_and_again_is_told_to(load: Load, npz_of: Write, standing: Any) -> None:
    dtheta = standing.dtheta.copy()
    for first in range(100, 900, 200):
        dtheta[first : first + 150, 2] = dtheta[first, 2]
    (event,) = load(npz_of(standing.changed(dtheta=dtheta))).events
    assert event.text.endswith("without change for 1.5 s, and so 3 more times")


def test_lost_samples_that_were_bridged_are_not_called_stuck(load: Load, npz_of: Write, standing: Any) -> None:
    lost = slice(400, 440)
    cut = standing.changed(**{k: np.delete(getattr(standing, k), lost, axis=0) for k in ("t", "dtheta", "dvel")})
    assert [e.kind for e in load(npz_of(cut), longest_gap="0.5 s").events] == ["gap", "repeated"]


def test_a_stuck_sensor_is_flagged_with_its_instant(load: Load, npz_of: Write, standing: Any) -> None:
    dtheta = standing.dtheta.copy()
    dtheta[400:, 1] = dtheta[400, 1]
    (event,) = load(npz_of(standing.changed(dtheta=dtheta))).events
    assert (event.kind, event.count) == ("stuck", 600)
    assert event.time == pytest.approx(4.01)
    assert event.text.startswith("gyro y shows")


def test_coarse_resolution_is_not_taken_for_a_stuck_sensor(load: Load, npz_of: Write, standing: Any) -> None:
    count = 60_000
    rng = np.random.default_rng(1)
    dvel = np.tile(standing.dvel.mean(axis=0), (count, 1))
    flips = np.cumsum(rng.random(count) < 0.01)
    assert np.diff(np.flatnonzero(np.diff(flips))).max() * PERIOD > 5.0
    dvel[:, 0] += 1e-3 * (flips % 2)
    dvel += 1e-6 * rng.standard_normal((count, 3)) * [0.0, 1.0, 1.0]
    long = standing.changed(
        t=PERIOD * np.arange(1, count + 1), dtheta=np.tile(standing.dtheta, (count // 1000, 1)), dvel=dvel
    )
    assert load(npz_of(long)).events == ()
