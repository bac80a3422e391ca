"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_ins_errors import blocks, local_level, policies, recorded, references, simulate, simulate_config

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component(
            "block", "attitude_error", blocks.AttitudeErrorConfig, blocks.attitude_error, "tilt and azimuth error in t"
        ),
        Component("block", "velocity_error", blocks.VelocityErrorConfig, blocks.velocity_error, "velocity error in t"),
        Component("block", "latitude_error", blocks.LatitudeErrorConfig, blocks.latitude_error, "latitude error"),
        Component("block", "longitude_error", blocks.LongitudeErrorConfig, blocks.longitude_error, "longitude error"),
        Component(
            "process", "local_level", local_level.LocalLevelConfig, local_level.local_level,
            "error equations of a local-level INS",
        ),
        Component(
            "policy", "paper_terms", policies.PaperTermsConfig, policies.paper_terms,
            "drop the first-order terms that eq. (1) leaves out",
        ),
        Component(
            "policy", "neglect_motion", policies.NeglectMotionConfig, policies.neglect_motion, "V = 0 in the coefficients"
        ),
        Component(
            "nominal", "recorded", recorded.RecordedConfig, recorded.recorded,
            "a recorded INS, and what it would be if it were corrected",
        ),
        Component(
            "measurement", "velocity", references.VelocityConfig, references.velocity, "velocity East and North: GNSS"
        ),
        Component(
            "measurement", "doppler_log", references.DopplerLogConfig, references.doppler_log,
            "velocity in vehicle axes: Doppler log",
        ),
        Component("measurement", "heading", references.HeadingConfig, references.heading, "heading: compass"),
        Component("measurement", "position", references.PositionConfig, references.position, "latitude, longitude"),
        Component(
            "source", "simulate", simulate_config.VoyageConfig, simulate.simulate, "a ship with an INS and its references"
        ),
        Component(
            "source", "simulate_drive", simulate_config.DriveConfig, simulate.simulate_drive,
            "a car with an INS: stops and turns",
        ),
    ]  # fmt: skip
