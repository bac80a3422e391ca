"""What this plugin brings to estimfw."""

from __future__ import annotations

import pluggy

from estimfw.registry.component import Component
from estimfw_inertial import given, strapdown

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl  # type: ignore[untyped-decorator]
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component(
            "nominal", "strapdown", strapdown.StrapdownConfig, strapdown.strapdown, "strapdown mechanization in East, North, Up"
        ),
        Component("initial", "given", given.GivenAttitudeConfig, given.given_attitude, "a start attitude that is known"),
    ]  # fmt: skip
