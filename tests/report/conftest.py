"""Results that no filter made, but that look as if one had: sigmas shrink, errors stay inside them, NIS follows chi-square."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr

DEG = np.pi / 180
STATES = {
    "velocity_error[E]": ("m/s", "m/s", 1.0, 0.1, 2e-3),
    "velocity_error[N]": ("m/s", "m/s", 1.0, 0.1, 2e-3),
    "attitude_error[E]": ("rad", "deg", 1 / DEG, 10 * DEG, 6e-3 * DEG),
    "attitude_error[N]": ("rad", "deg", 1 / DEG, 10 * DEG, 6e-3 * DEG),
    "attitude_error[U]": ("rad", "deg", 1 / DEG, 10 * DEG, 6e-2 * DEG),
    "gyro_bias[N]": ("rad/s", "deg/h", 3600 / DEG, 0.01 * DEG / 3600, 6e-3 * DEG / 3600),
    "gyro_bias[U]": ("rad/s", "deg/h", 3600 / DEG, 0.01 * DEG / 3600, 9.9e-3 * DEG / 3600),
}
"""SI unit, display unit, display scale, sigma at the start, sigma in the end."""

OUTPUTS = {"yaw": 179.98, "pitch": 0.8, "roll": 0.3, "heading": 180.02}
"""Truth in deg. The yaw sits on the cut at 180 deg."""


def shrinking(time: np.ndarray, start: float, end: float) -> np.ndarray:
    """A sigma (N,) that falls like the root of information from ``start`` towards ``end``."""
    sigma: np.ndarray = end + (start - end) / np.sqrt(1 + (time / 30) ** 2)
    return sigma


def wandering(rng: np.random.Generator, steps: int) -> np.ndarray:
    """Unit-variance noise (N,) with a memory of about ten steps."""
    white = rng.standard_normal(steps + 60)
    kernel = np.exp(-np.arange(60) / 10)
    noise: np.ndarray = np.convolve(white, kernel, "valid")[:steps] / np.sqrt(np.sum(kernel**2))
    return noise


def wrapped(angle: np.ndarray) -> np.ndarray:
    turned: np.ndarray = (angle + np.pi) % (2 * np.pi) - np.pi
    return turned


def state_part(time: np.ndarray, rng: np.random.Generator, truth: bool) -> dict[str, Any]:
    labels = list(STATES)
    sigma = np.stack([shrinking(time, *STATES[label][3:]) for label in labels], axis=1)
    error = sigma * np.stack([wandering(rng, time.size) for _ in labels], axis=1)
    true = np.broadcast_to([0.4 * STATES[label][3] for label in labels], sigma.shape)
    parts: dict[str, Any] = {
        "state": labels,
        "state_unit": ("state", [STATES[label][0] for label in labels]),
        "state_display_unit": ("state", [STATES[label][1] for label in labels]),
        "state_display_scale": ("state", [STATES[label][2] for label in labels]),
        "estimate": (("time", "state"), true + error),
        "sigma": (("time", "state"), sigma),
    }
    if truth:
        parts |= {"truth": (("time", "state"), true.copy()), "error": (("time", "state"), error)}
    return parts


def output_part(time: np.ndarray, rng: np.random.Generator, truth: bool) -> dict[str, Any]:
    names = list(OUTPUTS)
    ends = [0.06 if name in ("yaw", "heading") else 0.006 for name in names]
    sigma = np.stack([shrinking(time, 10 * DEG, end * DEG) for end in ends], axis=1)
    error = sigma * np.stack([wandering(rng, time.size) for _ in names], axis=1)
    true = np.broadcast_to(np.array([OUTPUTS[name] for name in names]) * DEG, sigma.shape)
    parts: dict[str, Any] = {
        "output": [f"attitude.{name}" for name in names],
        "output_unit": ("output", ["rad"] * len(names)),
        "output_display_unit": ("output", ["deg"] * len(names)),
        "output_display_scale": ("output", [1 / DEG] * len(names)),
        "output_value": (("time", "output"), wrapped(true + error)),
        "output_sigma": (("time", "output"), sigma),
    }
    if truth:
        parts |= {"output_truth": (("time", "output"), wrapped(true)), "output_error": (("time", "output"), error)}
    return parts


def measurement_part(name: str, time: np.ndarray, rng: np.random.Generator, rows: Sequence[str]) -> dict[str, Any]:
    sigma = np.stack([shrinking(time, 0.14, 0.1) for _ in rows], axis=1)
    standard = rng.standard_normal(sigma.shape)
    disposition = np.zeros(time.size, dtype=np.int8)
    if time.size > 100:
        disposition[[60, 61, 90]] = 1
        standard[[60, 61, 90]] *= 6
        disposition[70:74] = 3
        standard[70:74] = np.nan
        disposition[80] = 2
    nis = np.where(np.isnan(standard).all(axis=1), np.nan, np.nansum(standard**2, axis=1))
    attributes = {"unit": "m/s", "threshold": 0.999}
    return {
        f"{name}_time": time,
        f"{name}_row": list(rows),
        f"{name}_innovation": ((f"{name}_time", f"{name}_row"), standard * sigma, attributes),
        f"{name}_innovation_sigma": ((f"{name}_time", f"{name}_row"), sigma),
        f"{name}_nis": (f"{name}_time", nis),
        f"{name}_disposition": (f"{name}_time", disposition),
        f"{name}_used": (f"{name}_time", np.where(disposition == 0, len(rows), 0)),
    }


def event_part(time: np.ndarray) -> dict[str, Any]:
    texts = ["NIS 31.2 over 13.8 (99.9 %)", "gap of 4.0 s, propagated at the nominal step", "<b>not</b> & bold"]
    return {
        "event_time": ("event", [float(time[0]), float(time[-1]), np.nan]),
        "event_source": ("event", ["zero_velocity", "imu", "nominal"]),
        "event_kind": ("event", ["gated", "gap", "note"]),
        "event_text": ("event", texts),
        "event_count": ("event", [3, 1, 12]),
    }


POLICIES = [
    {
        "label": "sins_static.remove_coriolis",
        "kind": "mirrored",
        "before": list(STATES),
        "after": list(STATES),
        "removed_states": [],
        "removed_terms": ["coriolis"],
        "condition": "the mechanization drops it too",
        "number": {"value": 0.0004, "unit": "deg", "text": "heading changes by 0.0004 deg"},
        "measures": [{"name": "heading changes by", "value": 0.0004, "unit": "deg"}],
        "text": "the mechanization drops it too; heading changes by 0.0004 deg",
    },
    {
        "label": "sins_static.prune_unobservable",
        "kind": "approximate",
        "before": [*STATES, "accel_bias[E]", "accel_bias[N]", "gyro_bias[E]"],
        "after": list(STATES),
        "removed_states": ["accel_bias[E]", "accel_bias[N]", "gyro_bias[E]"],
        "removed_terms": [],
        "removed_noises": ["accel_bias_noise[E]"],
        "condition": "no run length determines these states; their prior goes into the reported sigma",
        "number": None,
        "measures": [],
        "text": "no run length determines these states; their prior goes into the reported sigma",
    },
]
EQUIVALENCE = [
    {
        "operation": "coriolis",
        "mirror": "coriolis",
        "in_model": False,
        "computed": False,
        "setting": "follow",
        "status": "equivalent",
        "text": "dropped on both sides",
    },
    {
        "operation": "transport_rate",
        "mirror": "transport_rate",
        "in_model": False,
        "computed": True,
        "setting": "on",
        "status": "mismatch",
        "text": "computed, but not in the model (allow_mismatch)",
    },
]
PROVENANCE = {
    "config": {"estimfw": 1, "name": "static alignment", "site": {"latitude": "34 deg"}, "policies": ["a", "b"]},
    "config_sha256": "9f" * 32,
    "plan_hash": "ab" * 32,
    "data": {"imu.npz": "cd" * 32},
    "versions": {"estimfw": "0.1.0", "numpy": "2.4.6", "estimfw-inertial": "0.1.0"},
    "seed": 7,
    "kernel": "numpy",
    "covariance": "ud",
    "wall_times": {"load": 0.12, "filter": 0.034},
    "start": "given",
    "config_files": [{"name": "filter.yaml", "sha256": "ef" * 32}],
    "command": "estimfw run filter.yaml",
}


def synthetic_result(
    steps: int = 600,
    *,
    rate: float = 1.0,
    truth: bool = True,
    states: bool = True,
    outputs: bool = True,
    events: bool = True,
    sigma: bool = True,
    measurements: Sequence[str] = ("zero_velocity",),
    seed: int = 1,
) -> xr.Dataset:
    """A result of ``steps`` steps; each part can be left out."""
    rng = np.random.default_rng(seed)
    time = np.arange(1, steps + 1) / rate
    parts: dict[str, Any] = {"time": time}
    if states:
        parts |= state_part(time, rng, truth)
    if outputs:
        parts |= output_part(time, rng, truth)
    for name in measurements:
        parts |= measurement_part(name, time, rng, ("E", "N"))
    if events:
        parts |= event_part(time)
    if not sigma:
        parts = {name: value for name, value in parts.items() if name not in ("sigma", "output_sigma")}
    texts = {"provenance": PROVENANCE, "policies": POLICIES, "equivalence": EQUIVALENCE}
    axes = {"time", "state", "output", *(f"{name}_{part}" for name in measurements for part in ("time", "row"))}
    return xr.Dataset(
        {name: value for name, value in parts.items() if name not in axes},
        coords={name: value for name, value in parts.items() if name in axes},
        attrs={
            "title": "static alignment, reduced to 7 states",
            **{name: json.dumps(value) for name, value in texts.items()},
        },
    )


@pytest.fixture(scope="session")
def make_result() -> Callable[..., xr.Dataset]:
    """`synthetic_result`, for tests."""
    return synthetic_result
