r"""The error equations of a local-level INS, a term at a time: eq. (1), and the first-order terms that it leaves out.

With x East, y North, z Up, and the latitude :math:`\varphi`::

    alpha' =  wz beta - wy gamma - dVy/R_M + eps_x
    beta'  = -wz alpha - (Vy/R_M) gamma + dVx/R_N - Omega sin dphi + eps_y
    gamma' =  wy alpha + (Vy/R_M) beta + (tan/R_N) dVx + (Omega cos + Vx sec^2/R_N) dphi + eps_z
    dVx'   = -g beta  + (Vy tan/R_N) dVx + (2 Omega sin + Vx tan/R_N) dVy + k Vy dphi + dA_x
    dVy'   =  g alpha - 2 (Omega sin + Vx tan/R_N) dVx - k Vx dphi + dA_y
    dphi'  =  dVy/R_M
    dlam'  =  dVx sec/R_N + (Vx/R_N) tan sec dphi
    wy = Omega cos + Vx/R_N,  wz = Omega sin + Vx tan/R_N,  k = 2 Omega cos + Vx sec^2/R_N

(1) takes the specific force for (0, 0, g) and the Earth's radii for constants; the terms of `LEFT_OUT` do not. All together are
the derivative of the exact platform equations.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from estimfw.config.types import Names, Settings, non_negative_quantity
from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, constant, identity, scalar, skew, vector, zeros
from estimfw.model.dynamics import StateBlock
from estimfw.model.parts import NoiseInput, ProcessParts, ProcessTerm
from estimfw_ins_errors.frames import LEVEL
from estimfw_ins_errors.local_terms import LOCAL_TERMS

__all__ = ["LEFT_OUT", "LocalLevelConfig", "local_level"]

#: First-order terms that eq. (1) leaves out.
LEFT_OUT = ("motion_force_tilt", "radius_attitude", "radius_velocity", "radius_latitude", "radius_longitude")


class LocalLevelConfig(Settings):
    """Eq. (1) over the named blocks, and what it leaves out; terms of blocks that are not there are left out."""

    kind: Literal["ins_errors.local_level"]
    terms: Annotated[
        Literal["complete", "paper"],
        Field(
            description="all terms of first order, or those of eq. (1) alone; the policy ins_errors.paper_terms drops them"
        ),
    ] = "complete"
    gyro_noise: Annotated[
        float,
        non_negative_quantity("rad/sqrt(s)", examples=("0.001 deg/sqrt(h)",)),
        Field(description="angle random walk of each gyro, a density"),
    ]
    accel_noise: Annotated[
        float,
        non_negative_quantity("m/s/sqrt(s)", examples=("10 ug/sqrt(Hz)",)),
        Field(description="velocity random walk of each accelerometer, a density"),
    ]
    attitude: Annotated[str, Field(description="name of the block of the attitude error")] = "attitude_error"
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"
    latitude: Annotated[str, Field(description="name of the block of the latitude error")] = "latitude_error"
    longitude: Annotated[str, Field(description="name of the block of the longitude error")] = "longitude_error"
    gyro_drifts: Annotated[
        Names, Field(description="blocks whose sum drifts the platform about E, N, U (rad/s, frame: t)")
    ] = ("gyro_bias", "gyro_drift")
    accel_biases: Annotated[
        Names,
        Field(description="blocks whose sum the accelerometers read too much (m/s^2, axes: [E, N] or frame: t)"),
    ] = ("accel_bias",)


def local_level(name: str, cfg: LocalLevelConfig, context: Any) -> ProcessParts:
    """Terms acting in t; ``context.blocks`` are the blocks that the config has."""
    every = (
        *_eq_1(cfg),
        *(_left_out(cfg) if cfg.terms == "complete" else ()),
        *_noise_terms(cfg),
        *_drifts(cfg, context),
    )
    noises = (
        NoiseInput("accel_noise", LEVEL.axes, LEVEL.axes[:2], (cfg.accel_noise**2,) * 3, "m/s^2", frame="t"),
        NoiseInput("gyro_noise", LEVEL.axes, LEVEL.axes, (cfg.gyro_noise**2,) * 3, "rad/s", frame="t"),
    )
    known = {*context.blocks, "accel_noise", "gyro_noise"}
    terms = tuple(t for t in every if t.target in known and t.source in known)
    driving = {t.source for t in terms}
    return ProcessParts(terms, tuple(n for n in noises if n.name in driving), frames=(LEVEL,), derived=LOCAL_TERMS)


V_E, V_N = (vector("velocity_t", 2).select([i], [0]) for i in range(2))
R_M, R_N = scalar("meridian_curvature"), scalar("prime_vertical_curvature")
SLOPE_M, SLOPE_N = scalar("meridian_slope"), scalar("prime_vertical_slope")
TAN, SEC = scalar("tan_latitude"), scalar("sec_latitude")
COSINE, SINE = (vector("earth_rate_t").select([i], [0]) for i in (1, 2))  # Omega cos, Omega sin


def _eq_1(cfg: LocalLevelConfig) -> tuple[ProcessTerm, ...]:
    phi, V, lat, lon = cfg.attitude, cfg.velocity, cfg.latitude, cfg.longitude
    gravity = _filled((3, 3), {(0, 1): -scalar("gravity"), (1, 0): scalar("gravity")})
    return (
        _term("earth_rate", phi, phi, -skew("earth_rate_t"), "-omega_ie x phi"),
        _term("transport_rate", phi, phi, -skew("transport_rate_t"), "-omega_et x phi"),
        _term(
            "transport_velocity", phi, V, _filled((3, 3), {(0, 1): -R_M, (1, 0): R_N, (2, 0): TAN * R_N}),
            "omega_et of the velocity error: -dVy/R_M, dVx/R_N, dVx tan/R_N",
        ),
        _term(
            "earth_rate_latitude", phi, lat, _filled((3, 1), {(1, 0): -SINE, (2, 0): COSINE}),
            "omega_ie at a wrong latitude: -Omega sin dphi, Omega cos dphi",
        ),
        _term(
            "transport_latitude", phi, lat, _filled((3, 1), {(2, 0): V_E * R_N * SEC * SEC}),
            "omega_et at a wrong latitude: Vx sec^2/R_N dphi",
        ),
        _term("gravity_tilt", V, phi, gravity, "-g beta, g alpha"),
        _term("coriolis", V, V, -2.0 * skew("earth_rate_t"), "-2 omega_ie x dV"),
        _term(
            "transport_coriolis", V, V,
            _filled((3, 3), {(0, 0): V_N * TAN * R_N, (0, 1): V_E * TAN * R_N, (1, 0): -2.0 * (V_E * TAN * R_N)}),
            "the velocity error in omega_et x V",
        ),
        _term(
            "coriolis_latitude", V, lat, _filled((3, 1), {(0, 0): 2.0 * (COSINE * V_N), (1, 0): -2.0 * (COSINE * V_E)}),
            "2 omega_ie at a wrong latitude x V",
        ),
        _term(
            "transport_coriolis_latitude", V, lat,
            _filled((3, 1), {(0, 0): V_E * V_N * R_N * SEC * SEC, (1, 0): -(V_E * V_E * R_N * SEC * SEC)}),
            "omega_et at a wrong latitude x V",
        ),
        _term("latitude_rate", lat, V, _filled((1, 3), {(0, 1): R_M}), "dVy/R_M"),
        _term("longitude_rate", lon, V, _filled((1, 3), {(0, 0): SEC * R_N}), "dVx sec/R_N"),
        _term("longitude_latitude", lon, lat, V_E * R_N * TAN * SEC, "(Vx/R_N) tan sec dphi"),
    )  # fmt: skip


def _left_out(cfg: LocalLevelConfig) -> tuple[ProcessTerm, ...]:
    phi, V, lat, lon = cfg.attitude, cfg.velocity, cfg.latitude, cfg.longitude
    force = skew("motion_force_t").select([0, 1], [0, 1, 2]).embed((3, 3), 0, 0)
    made = (
        (V, phi, force, "(f - (0, 0, g)) x phi: Coriolis, centripetal and the vehicle's own acceleration"),
        (
            phi, lat, _filled((3, 1), {(0, 0): V_N * SLOPE_M, (1, 0): -(V_E * SLOPE_N), (2, 0): -(V_E * TAN * SLOPE_N)}),
            "radii at a wrong latitude in omega_et",
        ),
        (
            V, lat, _filled((3, 1), {(0, 0): -(V_E * V_N * TAN * SLOPE_N), (1, 0): V_E * V_E * TAN * SLOPE_N}),
            "radii at a wrong latitude in omega_et x V",
        ),
        (lat, lat, -(V_N * SLOPE_M), "R_M at a wrong latitude in phi' = Vy/R_M"),
        (lon, lat, -(V_E * SLOPE_N * SEC), "R_N at a wrong latitude in lam' = Vx sec/R_N"),
    )  # fmt: skip
    return tuple(_term(label, *term) for label, term in zip(LEFT_OUT, made, strict=True))


def _noise_terms(cfg: LocalLevelConfig) -> tuple[ProcessTerm, ...]:
    return (
        _term("accel_noise_coupling", cfg.velocity, "accel_noise", identity(3), "+white noise of the accelerometers"),
        _term("gyro_noise_coupling", cfg.attitude, "gyro_noise", identity(3), "+white noise of the gyros (gimballed)"),
    )


def _drifts(cfg: LocalLevelConfig, context: Any) -> list[ProcessTerm]:
    gyros = [(n, cfg.attitude, "+eps: it turns the platform (gimballed)") for n in cfg.gyro_drifts]
    accels = [(n, cfg.velocity, "+dA") for n in cfg.accel_biases]
    there = [(n, target, text) for n, target, text in gyros + accels if n in context.blocks]
    return [_term(f"{n}_coupling", target, n, _along(LEVEL.axes, context.blocks[n]), text) for n, target, text in there]


def _along(axes: tuple[str, ...], block: StateBlock) -> Coefficient:
    """Each axis of the block onto that of the same name; a block in a frame has all three, of that frame."""
    if block.frame is not None and len(block.all_axes) == len(axes):
        return identity(3)
    if not set(axes) & set(block.all_axes):
        raise ConfigError(
            f"block {block.name!r} has none of the axes {', '.join(axes)}",
            hint="say `frame: t` for all three, or `axes: [E, N]`",
            within=("blocks", block.name),
        )
    return constant(np.array([[float(a == b) for b in block.all_axes] for a in axes]))


def _filled(shape: tuple[int, int], entries: dict[tuple[int, int], Coefficient]) -> Coefficient:
    total = zeros(*shape)
    for (i, j), value in entries.items():
        total = total + value.embed(shape, i, j)
    return total


def _term(label: str, target: str, source: str, coefficient: Coefficient, text: str) -> ProcessTerm:
    return ProcessTerm(label, target, source, coefficient, frame="t", text=text)
