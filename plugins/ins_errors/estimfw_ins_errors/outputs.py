"""What people want of it: corrected velocity, heading, latitude and longitude, the INS less its estimated errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimfw.model.coefficient import constant
from estimfw.model.parts import Output
from estimfw_ins_errors.local_terms import meridian_curvature, prime_vertical_curvature

__all__ = ["heading_output", "position_output", "velocity_output"]

FloatArray = NDArray[np.float64]
Values = Mapping[str, FloatArray]
TURN = 2.0 * np.pi


def heading_output(block: str) -> Output:
    """``heading``: K_INS - gamma, 0 .. 360 deg clockwise from North."""
    return Output(
        "heading", ("corrected",), ("rad",), ("deg",), heading_value, ((block, constant([[0.0, 0.0, -1.0]]), "t"),),
        needs=("heading",), truth=true_heading, period=TURN,
    )  # fmt: skip


def velocity_output(block: str) -> Output:
    """``velocity``: V_INS - dV, East and North."""
    return Output(
        "velocity", ("E", "N"), ("m/s",) * 2, ("m/s",) * 2, velocity_value,
        ((block, constant(-np.eye(2, 3)), "t"),), needs=("velocity_t",), truth=true_velocity,
    )  # fmt: skip


def position_output(name: str, block: str) -> Output:
    """``latitude`` or ``longitude``, of the INS less its error; errors of it in m over ground."""
    latitude = name == "latitude"
    return Output(
        name, ("corrected",), ("rad",), ("deg",), latitude_value if latitude else longitude_value,
        ((block, constant([[-1.0]]), None),), needs=(name,), truth=true_latitude if latitude else true_longitude,
        period=0.0 if latitude else TURN,
        error_unit="m", error_scale=metres_of_latitude if latitude else metres_of_longitude,
    )  # fmt: skip


def heading_value(estimates: Values, nominal: Values) -> FloatArray:
    """(..., 1) rad."""
    (phi,) = estimates.values()
    return np.asarray(np.mod(nominal["heading"] - phi[..., 2], TURN))[..., None]


def velocity_value(estimates: Values, nominal: Values) -> FloatArray:
    """(..., 2) m/s."""
    (dV,) = estimates.values()
    return np.asarray(nominal["velocity_t"] - dV[..., :2])


def latitude_value(estimates: Values, nominal: Values) -> FloatArray:
    """(..., 1) rad."""
    (error,) = estimates.values()
    return np.asarray(nominal["latitude"][..., None] - error)


def longitude_value(estimates: Values, nominal: Values) -> FloatArray:
    """(..., 1) rad."""
    (error,) = estimates.values()
    return np.asarray(nominal["longitude"][..., None] - error)


def metres_of_latitude(nominal: Values) -> FloatArray:
    """R_M (..., 1), m/rad."""
    return 1.0 / meridian_curvature(nominal["latitude"])[..., None]


def metres_of_longitude(nominal: Values) -> FloatArray:
    """R_N cos (..., 1), m/rad."""
    L = nominal["latitude"]
    return np.asarray((np.cos(L) / prime_vertical_curvature(L))[..., None])


def true_heading(truth: Values) -> FloatArray:
    """(..., 1) rad."""
    return truth["heading"][..., None]


def true_velocity(truth: Values) -> FloatArray:
    """(..., 2) m/s."""
    return truth["velocity_t"]


def true_latitude(truth: Values) -> FloatArray:
    """(..., 1) rad."""
    return truth["latitude"][..., None]


def true_longitude(truth: Values) -> FloatArray:
    """(..., 1) rad."""
    return truth["longitude"][..., None]
