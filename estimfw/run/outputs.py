"""Outputs, truths and errors along a chunk of steps: vectorised, outside the filter loop."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.data.record import SAME, Event, Truth
from estimfw.estimators.scan import ChunkResult
from estimfw.model.frame import rotation
from estimfw.model.model import Model
from estimfw.model.parts import Output, StateBlock
from estimfw.plan.lowering import Lowered
from estimfw.registry.contract import broken, plugin_code

__all__ = ["output_truth", "output_value", "output_values", "state_truth", "truth_at", "truth_events", "wrapped"]

FloatArray = NDArray[np.float64]


def output_values(
    problem: Problem, output: Output, jacobian: Lowered, result: ChunkResult, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Value and sigma (K, components) of an output for complete rows (K, size); a sigma of a determination is NaN."""
    nominal = problem.plan.layout.unpack(rows)
    estimates = {}
    for name, _, frame in output.jacobian:
        if name not in problem.model.offsets:
            continue
        block = problem.model.block(name)
        full = np.zeros((result.estimate.shape[0], len(block.all_axes)))
        at = problem.model.offsets[name]
        full[:, block.live] = result.estimate[:, at : at + len(block.axes)]
        if frame is not None and block.frame is not None and frame != block.frame:
            turn = rotation(block.frame, frame, problem.model.frame_map).evaluate(nominal)
            full = np.einsum("...ij,...j->...i", turn, full)
        estimates[name] = full
    J = jacobian.evaluate(rows)
    variance = np.einsum("kij,kjl,kil->ki", J, result.covariance, J)
    value = output_value(output, estimates, nominal, variance.shape[0])
    if not problem.plan.states:
        return value, np.full(variance.shape, np.nan)
    return value, np.sqrt(np.maximum(variance, 0.0))


def output_value(
    output: Output, estimates: Mapping[str, FloatArray], nominal: Mapping[str, FloatArray], count: int
) -> FloatArray:
    """Value (count, components) of an output.

    Raises
    ------
    PluginError
        Its function fails, or returns another shape.
    """
    shape = (count, len(output.components))
    what = f"{output.value.__module__}.{output.value.__qualname__}"
    with plugin_code(f"output {output.name!r}", what):
        value = np.asarray(output.value(estimates, nominal), dtype=float)
    if value.shape != shape:
        raise broken(f"output {output.name!r}", what, f"made the shape {value.shape}, {shape} is due")
    return value


def output_truth(output: Output, truth: Mapping[str, FloatArray], count: int) -> FloatArray:
    """True values (count, components) of an output; NaN where the truth does not say what it needs."""
    if output.truth is not None:
        try:
            return np.asarray(output.truth(truth), dtype=float)
        except KeyError:
            pass
    return np.full((count, len(output.components)), np.nan)


def truth_at(truth: Truth | None, time: FloatArray) -> dict[str, FloatArray] | None:
    """The truth at these instants, as it says of itself (`Truth.between`); None where it is not known at all."""
    if truth is None or not truth.time.size:
        return None
    count = truth.time.size
    if truth.between == "linear":
        return {name: _linear(truth, name, time) for name in truth.values}
    index = np.clip(np.searchsorted(truth.time, time - SAME), 0, count - 1)
    return {
        name: np.asarray(value)[index]
        if np.shape(value)[:1] == (count,)
        else np.broadcast_to(value, (time.size, *np.shape(value)))
        for name, value in truth.values.items()
    }


def truth_events(truth: Truth | None, time: FloatArray) -> tuple[Event, ...]:
    """A word where a truth covers no instant, as of another day or another clock: errors are not told then."""
    if truth is None or truth.between != "linear" or not truth.time.size or not time.size:
        return ()
    first, last = float(truth.time[0]), float(truth.time[-1])
    if np.any((time >= first - SAME) & (time <= last + SAME)):
        return ()
    text = (
        f"the truth goes from {first:.10g} to {last:.10g} s, the run from {time[0]:.10g} to {time[-1]:.10g} s: "
        "no error can be told"
    )
    return (Event(float("nan"), "truth", "elsewhere", text),)


def _linear(truth: Truth, name: str, time: FloatArray) -> FloatArray:
    """Between the instants on both sides, NaN outside of them; a constant is known always."""
    value = np.asarray(truth.values[name], dtype=float)
    if value.shape[:1] != (truth.time.size,):
        return np.broadcast_to(value, (time.size, *value.shape))
    last = truth.time.size - 1
    if truth.time.size == 1:
        after = before = np.zeros(time.size, dtype=np.int64)
    else:
        after = np.clip(np.searchsorted(truth.time, time - SAME), 1, last)
        before = after - 1
    length = np.where(after > before, truth.time[after] - truth.time[before], 1.0)
    part = np.clip((time - truth.time[before]) / length, 0.0, 1.0).reshape((-1,) + (1,) * (value.ndim - 1))
    change = value[after] - value[before]
    change = wrapped(change, 2.0 * np.pi) if name in truth.wraps else change
    made = np.where(part == 1.0, value[after], value[before] + part * change)
    outside = (time < truth.time[0] - SAME) | (time > truth.time[-1] + SAME)
    made[outside] = np.nan
    return np.asarray(made)


def state_truth(problem: Problem, rows: FloatArray, truth: Mapping[str, FloatArray]) -> FloatArray:
    """True value of each state (K, n), of one that is a combination that of the combination; NaN where it is not known."""
    nominal = problem.plan.layout.unpack(rows)
    quotient = problem.model.quotient
    if quotient is None:
        return _truth_of(problem.model, nominal, truth, rows.shape[0])
    if any(f"state:{label}" in truth for label in set(quotient.of.states) - set(problem.model.states)):
        return quotient.combined(_truth_of(quotient.of, nominal, truth, rows.shape[0]))
    named = {name: value for name, value in truth.items() if not name.startswith("state:")}
    values = quotient.combined(_truth_of(quotient.of, nominal, named, rows.shape[0]))
    return _with_named(problem.model, values, truth)  # a source that simulates the filter's own states knows these


def _truth_of(
    model: Model, nominal: Mapping[str, FloatArray], truth: Mapping[str, FloatArray], count: int
) -> FloatArray:
    values = np.full((count, len(model.states)), np.nan)
    for block in model.blocks:
        full = _block_truth(model, block, nominal, truth)
        if full is not None:
            at = model.offsets[block.name]
            values[:, at : at + len(block.axes)] = full[:, block.live]
    return _with_named(model, values, truth)


def _with_named(model: Model, values: FloatArray, truth: Mapping[str, FloatArray]) -> FloatArray:
    for i, label in enumerate(model.states):
        if f"state:{label}" in truth:
            values[:, i] = truth[f"state:{label}"]
    return values


def _block_truth(
    model: Model, block: StateBlock, nominal: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]
) -> FloatArray | None:
    try:
        if block.truth_error is not None:
            full = np.asarray(block.truth_error(nominal, truth), dtype=float)
        elif block.truth in truth:
            full = np.asarray(truth[block.truth], dtype=float)
        else:
            return None
    except KeyError:
        return None
    if block.home_frame is None or block.frame is None or block.home_frame == block.frame:
        return full
    where = {**nominal, **truth}
    turn = rotation(block.home_frame, block.frame, model.frame_map).evaluate(where)
    return np.asarray(np.einsum("...ij,...j->...i", turn, full))


def wrapped(difference: FloatArray, period: float) -> FloatArray:
    """Differences of angles in (-period / 2, period / 2]."""
    if period <= 0.0:
        return difference
    return np.asarray(-(np.mod(-difference + 0.5 * period, period) - 0.5 * period))
