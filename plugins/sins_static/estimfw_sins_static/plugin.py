"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_sins_static import blocks, motion, phi_angle, policies, sensor_noise, simulate, zero_velocity

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component("block", "velocity_error", blocks.VelocityErrorConfig, blocks.velocity_error, "velocity error dV in n"),
        Component("block", "attitude_error", blocks.AttitudeErrorConfig, blocks.attitude_error, "attitude error phi in n"),
        Component("block", "accel_bias", blocks.AccelBiasConfig, blocks.accel_bias, "accelerometer bias in b"),
        Component("block", "gyro_bias", blocks.GyroBiasConfig, blocks.gyro_bias, "gyro bias in b"),
        Component("process", "phi_angle", phi_angle.PhiAngleConfig, phi_angle.phi_angle, "phi-angle error equations"),
        Component(
            "measurement", "zero_velocity", zero_velocity.ZeroVelocityConfig, zero_velocity.zero_velocity, "the base stands"
        ),
        Component(
            "policy", "remove_coriolis", policies.RemoveCoriolisConfig, policies.remove_coriolis, "drop Coriolis on both sides"
        ),
        Component(
            "policy", "bias_in_navigation_frame", policies.BiasInNavigationFrameConfig, policies.bias_in_navigation_frame,
            "equivalent biases in n",
        ),
        Component(
            "policy", "remove_vertical_channel", policies.RemoveVerticalChannelConfig, policies.remove_vertical_channel,
            "drop dV_U and the vertical accelerometer bias",
        ),
        Component(
            "policy", "constant_specific_force", policies.ConstantSpecificForceConfig, policies.constant_specific_force,
            "f_n = [0, 0, g] in the coefficients",
        ),
        Component(
            "policy", "prune_unobservable", policies.PruneUnobservableConfig, policies.prune_unobservable,
            "delete what cannot be determined",
        ),
        Component("source", "simulate", simulate.SimulateConfig, simulate.simulate, "the paper's experiment"),
        Component("monitor", "motion", motion.MotionConfig, motion.motion, "flags a vehicle that moves"),
        Component(
            "monitor", "sensor_noise", sensor_noise.SensorNoiseConfig, sensor_noise.sensor_noise,
            "flags sensors that are noisier than the model has them",
        ),
    ]  # fmt: skip
