"""The framework's own preprocessing, by bare names."""

from __future__ import annotations

from estimfw.config.generic.preprocessing import (
    clip_check,
    counter,
    fir_lowpass,
    join,
    jump_limit,
    lag_check,
    shift,
    stuck,
)
from estimfw.registry.component import Component

__all__ = ["preprocessing_components"]


def preprocessing_components() -> list[Component]:
    """What a config can name in its section ``preprocess`` without any plugin."""
    return [
        Component("preprocess", "shift", shift.ShiftConfig, shift.shift, "latency, offset and drift of a stream's clock"),
        Component(
            "preprocess", "counter", counter.CounterConfig, counter.counter, "pulse counts to a speed or a distance"
        ),
        Component(
            "preprocess", "fir_lowpass", fir_lowpass.FirLowPassConfig, fir_lowpass.fir_lowpass,
            "low-pass filter of linear phase, its delay compensated",
        ),
        Component(
            "preprocess", "jump_limit", jump_limit.JumpLimitConfig, jump_limit.jump_limit,
            "leave out readings that change faster than is possible: slip",
        ),
        Component(
            "preprocess", "clip_check", clip_check.ClipCheckConfig, clip_check.clip_check,
            "leave out readings at the end of a sensor's range",
        ),
        Component("preprocess", "stuck", stuck.StuckConfig, stuck.stuck, "leave out readings of a sensor that stands still"),
        Component(
            "preprocess", "lag_check", lag_check.LagCheckConfig, lag_check.lag_check, "tell a column that lags another: clocks"
        ),
        Component("preprocess", "join", join.JoinConfig, join.join, "columns of one stream onto the stamps of another"),
    ]  # fmt: skip
