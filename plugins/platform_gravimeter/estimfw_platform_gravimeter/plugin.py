"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_platform_gravimeter import blocks, platform, platform_error, simulate, velocity

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component("block", "velocity_error", blocks.VelocityErrorConfig, blocks.velocity_error, "velocity error dV in n"),
        Component(
            "block", "attitude_error", blocks.AttitudeErrorConfig, blocks.attitude_error, "platform error phi in n"
        ),
        Component("block", "accel_bias", blocks.AccelBiasConfig, blocks.accel_bias, "accelerometer biases dA in p"),
        Component("block", "gyro_drift", blocks.GyroDriftConfig, blocks.gyro_drift, "gyro drifts eps in p"),
        Component(
            "process", "platform_error", platform_error.PlatformErrorConfig, platform_error.platform_error,
            "error equations of a levelled platform",
        ),
        Component("measurement", "velocity", velocity.VelocityConfig, velocity.velocity, "the base stands"),
        Component(
            "nominal", "platform", platform.PlatformConfig, platform.platform, "a standing platform, turned by alpha"
        ),
        Component("source", "simulate", simulate.SimulateConfig, simulate.simulate, "the exact platform"),
    ]  # fmt: skip
