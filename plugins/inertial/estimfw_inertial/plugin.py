"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_inertial import coarse_averaging, coarse_inertial, given, log_config, log_source, strapdown

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component(
            "nominal", "strapdown", strapdown.StrapdownConfig, strapdown.strapdown, "strapdown mechanization in East, North, Up"
        ),
        Component("initial", "given", given.GivenAttitudeConfig, given.given_attitude, "a start attitude that is known"),
        Component(
            "initial", "inertial_frame", coarse_inertial.InertialFrameConfig, coarse_inertial.build_inertial_frame,
            "coarse alignment in inertial frames, for a standing vehicle that sways",
        ),
        Component(
            "initial", "averaging", coarse_averaging.AveragingConfig, coarse_averaging.build_averaging,
            "coarse alignment by averaging, for a vehicle that stands still",
        ),
        Component("source", "imu_log", log_config.ImuLogConfig, log_source.build_imu_log, "recorded IMU: NPZ, CSV or PSINS .imu"),
    ]  # fmt: skip
