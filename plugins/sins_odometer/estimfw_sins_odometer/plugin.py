"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_sins_odometer import aligned, blocks, determined, level, measurement, process, provider, reckoned, simulate

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component(
            "nominal", "preintegration", provider.PreintegrationConfig, provider.preintegration,
            "IMU and odometer integrated in the axes of the start",
        ),
        Component(
            "nominal", "determination", determined.DeterminationConfig, determined.determined,
            "the attitude that fits the integrated velocities best",
        ),
        Component(
            "nominal", "dead_reckoning", reckoned.DeadReckoningConfig, reckoned.dead_reckoning,
            "the track of a vehicle whose attitude is known",
        ),
        Component("initial", "aligned", aligned.AlignedConfig, aligned.aligned, "the attitude that another run found"),
        Component("initial", "level", level.LevelConfig, level.level, "levelled by the first second, heading assumed"),
        Component("block", "attitude_error", blocks.AttitudeErrorConfig, blocks.attitude_error, "attitude error phi in i"),
        Component("block", "gyro_bias", blocks.GyroBiasConfig, blocks.gyro_bias, "gyro bias in b"),
        Component("block", "accel_bias", blocks.AccelBiasConfig, blocks.accel_bias, "accelerometer bias in b"),
        Component(
            "block", "initial_speed_error", blocks.InitialSpeedErrorConfig, blocks.initial_speed_error,
            "error of the speed at the start",
        ),
        Component("process", "phi_i", process.PhiIConfig, process.phi_i, "the attitude error in i"),
        Component(
            "measurement", "integrated_velocity", measurement.IntegratedVelocityConfig, measurement.integrated_velocity,
            "integrated specific-force equation against the attitude",
        ),
        Component("source", "simulate", simulate.SimulateConfig, simulate.simulate, "a drive with stops and turns"),
    ]  # fmt: skip
