"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_ins_errors import blocks

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
    ]
