"""What an INS is compared with: velocity (GNSS), velocity of a Doppler log in vehicle axes, heading (compass), position.

Each is INS minus reference, z = nominal - reading. The reference may stand elsewhere on the vehicle: ``lever_arm`` (right,
forward, m) goes from the INS to it, and turns with the heading of the INS, l_E = l_R cos K + l_F sin K,
l_N = l_F cos K - l_R sin K. At a heading rate K' the reference moves by K' (l_N, -l_E) against the INS.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from estimfw.config.types import Names, NoiseLevel, Settings, noise, quantity_vector
from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, constant, matrix, scalar, vector, zeros
from estimfw.model.parts import CompiledFunction, DerivedVariable, HeldArgument, Measurement, MeasurementTerm
from estimfw_ins_errors.local_terms import LOCAL_TERMS

__all__ = [
    "DopplerLogConfig",
    "HeadingConfig",
    "PositionConfig",
    "VelocityConfig",
    "doppler_log",
    "heading",
    "position",
    "velocity",
]

FloatArray = NDArray[np.float64]
_Two = tuple[float, float]
TURN = 2.0 * np.pi
_ARM = "right and forward, from the INS to the reference"
_STREAM = "stream that holds the readings (left out: the name of this entry)"


class _ReferenceConfig(Settings):
    """What the references have in common."""

    stream: Annotated[str | None, Field(description=_STREAM)] = None
    attitude: Annotated[str, Field(description="name of the block of the attitude error")] = "attitude_error"
    perfect: Annotated[bool, Field(description="whether a noise of 0 is meant")] = False


class VelocityConfig(_ReferenceConfig):
    """z = V_INS - V_ref, East and North: GNSS."""

    kind: Literal["ins_errors.velocity"]
    noise: Annotated[NoiseLevel, noise("m/s", 2), Field(description="of both axes, or of E and N")]
    columns: Annotated[
        Names, Field(min_length=2, max_length=2, description="velocity to the east and to the north")
    ] = (
        "E",
        "N",
    )
    lever_arm: Annotated[_Two, quantity_vector("m", 2), Field(description=_ARM)] = (0.0, 0.0)
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"


class DopplerLogConfig(_ReferenceConfig):
    """z = V_INS in vehicle axes, turned with the heading of the INS, minus the reading: to the right -V gamma is in it."""

    kind: Literal["ins_errors.doppler_log"]
    noise: Annotated[NoiseLevel, noise("m/s", 2), Field(description="of both axes, or to the right and forward")]
    columns: Annotated[Names, Field(min_length=2, max_length=2, description="velocity to the right and forward")] = (
        "right",
        "forward",
    )
    lever_arm: Annotated[_Two, quantity_vector("m", 2), Field(description=_ARM)] = (0.0, 0.0)
    velocity: Annotated[str, Field(description="name of the block of the velocity error")] = "velocity_error"


class HeadingConfig(_ReferenceConfig):
    """z = K_INS - K_ref = gamma, the shorter way round."""

    kind: Literal["ins_errors.heading"]
    noise: Annotated[NoiseLevel, noise("rad"), Field(description="of a reading, such as 6 arcmin")]
    column: Annotated[str, Field(description="heading, clockwise from north")] = "heading"


class PositionConfig(_ReferenceConfig):
    """z = latitude (and longitude, where the config has its error as a block) of the INS minus that of the reference.

    The noise is an angle: 1 m to the north is 0.00054 arcmin of latitude, 1 m to the east that over cos(latitude) of longitude.
    """

    kind: Literal["ins_errors.position"]
    noise: Annotated[
        NoiseLevel,
        noise("rad"),
        Field(description="of a reading, such as 0.003 arcmin; or of latitude and of longitude"),
    ]
    columns: Annotated[
        Names, Field(min_length=1, max_length=2, description="latitude, and longitude where it is read")
    ] = (
        "latitude",
        "longitude",
    )
    lever_arm: Annotated[_Two, quantity_vector("m", 2), Field(description=_ARM)] = (0.0, 0.0)
    latitude: Annotated[str, Field(description="name of the block of the latitude error")] = "latitude_error"
    longitude: Annotated[str, Field(description="name of the block of the longitude error")] = "longitude_error"


def velocity(name: str, cfg: VelocityConfig, context: Any) -> Measurement:
    """H = I over dV, and what a wrong heading does to the lever arm."""
    predicted, arm = vector("velocity_t", 2), _arm(name, cfg.lever_arm)
    terms = [MeasurementTerm(context.block(cfg.velocity).name, constant(np.eye(2, 3)))]
    if arm:
        rate, (east, north) = scalar("heading_rate"), _arm_parts(name)
        predicted = predicted + (north * rate).embed((2, 1), 0, 0) - (east * rate).embed((2, 1), 1, 0)
        turned = -(east * rate).embed((2, 3), 0, 2) - (north * rate).embed((2, 3), 1, 2)
        terms += _of_attitude(cfg.attitude, turned, context)
    return _reference(
        name, cfg, ("E", "N"), "m/s", terms, predicted, tuple(cfg.columns), arm, text="V_INS - V_ref"
    )  # fmt: skip


def doppler_log(name: str, cfg: DopplerLogConfig, context: Any) -> Measurement:
    """H over dV turned into vehicle axes, and (-V_forward, V_right) over gamma."""
    right, forward = cfg.lever_arm
    own = vector("vehicle_velocity", 2)
    predicted = own + scalar("heading_rate") * constant([forward, -right]) if right or forward else own
    gamma = -own.select([1], [0]).embed((2, 3), 0, 2) + own.select([0], [0]).embed((2, 3), 1, 2)
    terms = [
        MeasurementTerm(context.block(cfg.velocity).name, matrix("vehicle_axes", (2, 2)) @ constant(np.eye(2, 3))),
        *_of_attitude(cfg.attitude, gamma, context),
    ]
    return _reference(
        name, cfg, ("right", "forward"), "m/s", terms, predicted, tuple(cfg.columns), (VEHICLE_AXES, VEHICLE_VELOCITY),
        text="V_INS, resolved with the heading of the INS, minus the log",
    )  # fmt: skip


def heading(name: str, cfg: HeadingConfig, context: Any) -> Measurement:
    """H = +1 over gamma."""
    context.block(cfg.attitude)
    terms = _of_attitude(cfg.attitude, constant([[0.0, 0.0, 1.0]]), context)
    return _reference(
        name, cfg, ("",), "rad", terms, scalar("heading"), (cfg.column,), (), period=TURN, text="K_INS - K_ref = gamma"
    )  # fmt: skip


def position(name: str, cfg: PositionConfig, context: Any) -> Measurement:
    """H = 1 over the errors of latitude and, where it is a state, of longitude.

    Raises
    ------
    ConfigError
        Neither of them is a state, or the noise is a list of two for a latitude alone.
    """
    rows = [(n, b) for n, b in (("latitude", cfg.latitude), ("longitude", cfg.longitude)) if b in context.blocks]
    if len(rows) < 1:
        raise ConfigError(
            f"measurement {name!r} compares positions, but neither {cfg.latitude!r} nor {cfg.longitude!r} is a block",
            hint="add `latitude_error: {kind: ins_errors.latitude_error, sigma: 0.005 arcmin}` to the blocks",
        )
    names, arm, count = tuple(n for n, _ in rows), _arm(name, cfg.lever_arm), len(rows)
    if len(cfg.columns) < count:
        raise ConfigError(f"measurement {name!r} needs a column for each of {', '.join(names)}", within=("columns",))
    if len(cfg.noise.values) not in (1, count):
        raise ConfigError(
            f"measurement {name!r} has {len(cfg.noise.values)} noises for {' and '.join(names)}",
            hint=f"longitude is measured where {cfg.longitude!r} is a block",
            within=("noise",),
        )
    predicted = zeros(count, 1)
    for i, row in enumerate(names):
        predicted = predicted + scalar(row).embed((count, 1), i, 0)
    terms = [MeasurementTerm(block, constant(np.eye(count)[:, [i]])) for i, (_, block) in enumerate(rows)]
    derived: tuple[DerivedVariable, ...] = ()
    if arm:
        derived, shifted = (*LOCAL_TERMS, *arm), _shift(name, names)
        predicted = predicted + shifted[0]
        terms += _of_attitude(cfg.attitude, shifted[1], context)
    return _reference(
        name, cfg, names, "rad", terms, predicted, tuple(cfg.columns[:count]), derived, period=TURN,
        text="position of the INS minus that of the reference",
    )  # fmt: skip


def _shift(name: str, names: tuple[str, ...]) -> tuple[Coefficient, Coefficient]:
    """What the lever arm adds to the position, (rows, 1) rad, and its change with the azimuth error, (rows, 3)."""
    east, north = _arm_parts(name)
    per_metre = {
        "latitude": scalar("meridian_curvature"),
        "longitude": scalar("prime_vertical_curvature") * scalar("sec_latitude"),
    }
    along, across = {"latitude": north, "longitude": east}, {"latitude": -east, "longitude": north}
    added, turned = zeros(len(names), 1), zeros(len(names), 3)
    for i, row in enumerate(names):
        added = added + (along[row] * per_metre[row]).embed((len(names), 1), i, 0)
        turned = turned + (across[row] * per_metre[row]).embed((len(names), 3), i, 2)
    return added, turned


def _reference(
    name: str,
    cfg: VelocityConfig | DopplerLogConfig | HeadingConfig | PositionConfig,
    rows: tuple[str, ...],
    unit: str,
    terms: list[MeasurementTerm],
    predicted: Coefficient,
    columns: tuple[str, ...],
    derived: tuple[DerivedVariable, ...],
    *,
    period: float = 0.0,
    text: str,
) -> Measurement:
    covariance = np.diag(np.square(np.broadcast_to(cfg.noise.value, len(rows))))
    return Measurement(
        name=name,
        all_rows=rows,
        rows=rows,
        unit=unit,
        terms=tuple(terms),
        covariance=tuple(tuple(float(x) for x in row) for row in covariance),
        noise=cfg.noise.kind,
        innovation=predicted,
        stream=cfg.stream or name,
        columns=columns,
        sign=-1.0,
        perfect=cfg.perfect,
        text=text,
        derived=derived,
        period=period,
    )


def _of_attitude(block: str, coefficient: Coefficient, context: Any) -> list[MeasurementTerm]:
    return [MeasurementTerm(block, coefficient)] if block in context.blocks else []


def _arm(name: str, arm: _Two) -> tuple[DerivedVariable, ...]:
    """The lever arm in t as a derived variable of this measurement; none where there is no arm."""
    if not any(arm):
        return ()
    held = HeldArgument.of("arm", arm)
    twin = CompiledFunction("estimfw_ins_errors.compiled_references", "lever_arm")
    return (
        DerivedVariable(
            f"{name}.lever_arm_t",
            (2,),
            ("heading", "arm"),
            lever_arm,
            "m",
            f"l_{{{name}}}",
            held=(held,),
            compiled=twin,
        ),
    )


def _arm_parts(name: str) -> tuple[Coefficient, Coefficient]:
    whole = vector(f"{name}.lever_arm_t", 2)
    return whole.select([0], [0]), whole.select([1], [0])


def lever_arm(heading: FloatArray, arm: FloatArray) -> FloatArray:
    """(l_E, l_N) (..., 2) m, of (right, forward)."""
    s, c = np.sin(heading), np.cos(heading)
    return np.stack([arm[..., 0] * c + arm[..., 1] * s, arm[..., 1] * c - arm[..., 0] * s], axis=-1)


def vehicle_axes(heading: FloatArray) -> FloatArray:
    """(..., 2, 2): East and North to right and forward."""
    s, c = np.sin(heading), np.cos(heading)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def vehicle_velocity(heading: FloatArray, velocity_t: FloatArray) -> FloatArray:
    """Right, forward (..., 2) m/s."""
    return np.asarray((vehicle_axes(heading) @ velocity_t[..., None])[..., 0])


VEHICLE_AXES = DerivedVariable(
    "vehicle_axes", (2, 2), ("heading",), vehicle_axes, "1", "C_t^v",
    compiled=CompiledFunction("estimfw_ins_errors.compiled_references", "vehicle_axes"),
)  # fmt: skip
VEHICLE_VELOCITY = DerivedVariable(
    "vehicle_velocity", (2,), ("heading", "velocity_t"), vehicle_velocity, "m/s", "V^v",
    compiled=CompiledFunction("estimfw_ins_errors.compiled_references", "vehicle_velocity"),
)  # fmt: skip
