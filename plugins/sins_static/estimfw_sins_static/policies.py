"""The paper's reductions as named policies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from estimfw.config.types import Names, Settings
from estimfw.policies.change import Policy
from estimfw.policies.drop_frame_rotation import DropFrameRotation
from estimfw.policies.drop_states import DropStates
from estimfw.policies.drop_term import DropTerm
from estimfw.policies.express_in_frame import ExpressInFrame
from estimfw.policies.fix_nominal import FixNominal
from estimfw.policies.prune_unobservable import MODES, PruneMode, PruneUnobservable
from estimfw.policies.sequence import Sequential

__all__ = [
    "BiasInNavigationFrameConfig",
    "ConstantSpecificForceConfig",
    "PruneUnobservableConfig",
    "RemoveCoriolisConfig",
    "RemoveVerticalChannelConfig",
    "bias_in_navigation_frame",
    "constant_specific_force",
    "prune_unobservable",
    "remove_coriolis",
    "remove_vertical_channel",
]


class RemoveCoriolisConfig(Settings):
    """Drop the term coriolis; the mechanization's Coriolis correction follows (the equivalence operation)."""

    kind: Literal["sins_static.remove_coriolis"]


class BiasInNavigationFrameConfig(Settings):
    """Estimate the equivalent biases in n instead of b, constant there: right for a base that does not turn."""

    kind: Literal["sins_static.bias_in_navigation_frame"]
    blocks: Annotated[Names, Field(description="blocks of the body frame")] = ("accel_bias", "gyro_bias")


class RemoveVerticalChannelConfig(Settings):
    """Drop the vertical velocity error and the vertical accelerometer bias; the mechanization holds V_U at 0."""

    kind: Literal["sins_static.remove_vertical_channel"]
    states: Annotated[Names, Field(description="labels of the vertical states")] = (
        "velocity_error[U]",
        "accel_bias[U]",
    )


class ConstantSpecificForceConfig(Settings):
    """f_n = [0, 0, g] in the coefficients: a base at rest."""

    kind: Literal["sins_static.constant_specific_force"]


class PruneUnobservableConfig(Settings):
    """Delete the states that are least determined even with perfect knowledge of the observable part, or let others stand
    for them."""

    kind: Literal["sins_static.prune_unobservable"]
    mode: Annotated[PruneMode, Field(description=MODES)] = "delete"
    protect: Annotated[Names, Field(description="blocks or states that stay")] = ("attitude_error",)


def remove_coriolis(cfg: RemoveCoriolisConfig) -> Policy:
    condition = (
        "exact to first order if the mechanization drops it too; on one side only, heading is wrong by 1.35 x tilt"
    )
    return Sequential("sins_static.remove_coriolis", (DropTerm(("coriolis",), mirrored=True),), condition, "mirrored")


def bias_in_navigation_frame(cfg: BiasInNavigationFrameConfig) -> Policy:
    steps = [step for block in cfg.blocks for step in (ExpressInFrame(block, "n"), DropFrameRotation(block))]
    return Sequential("sins_static.bias_in_navigation_frame", tuple(steps))


def remove_vertical_channel(cfg: RemoveVerticalChannelConfig) -> Policy:
    condition = (
        "the vertical pair is decoupled if biases are in n and Coriolis is dropped; the mechanization holds V_U at 0"
    )
    return Sequential("sins_static.remove_vertical_channel", (DropStates(cfg.states),), condition)


def constant_specific_force(cfg: ConstantSpecificForceConfig) -> Policy:
    condition = "the base does not accelerate; the cost shows while the attitude error is large"
    step = FixNominal("f_n", (0.0, 0.0, "gravity"))
    return Sequential("sins_static.constant_specific_force", (step,), condition)


def prune_unobservable(cfg: PruneUnobservableConfig) -> Policy:
    condition = "the attitude takes up what the deleted biases do; its own sigma does not include them"
    told = condition if cfg.mode == "delete" else ""
    return Sequential("sins_static.prune_unobservable", (PruneUnobservable(cfg.protect, cfg.mode),), told)
