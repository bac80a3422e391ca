"""What a nominal that was recorded says of the outputs, before any correction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.model.parts import Output
from estimfw.registry.contract import plugin_code
from estimfw.run.outputs import output_value
from estimfw.run.prepare import Prepared

__all__ = ["AsRecorded", "as_recorded", "corrects_a_record"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AsRecorded:
    """Of K steps.

    Attributes
    ----------
    value : (K, components) array, SI
        All outputs, as recorded.
    error_scale : (K, components) array
        What an error of one SI unit is in ``error_units``: m of latitude, for instance; 1 where an output says nothing.
    error_units : tuple of str
        One a component; empty where an output says nothing.
    """

    value: FloatArray
    error_scale: FloatArray
    error_units: tuple[str, ...]


def as_recorded(prepared: Prepared) -> AsRecorded | None:
    """The outputs without any correction; None where the nominal is not a record of a device, or there are no outputs.

    A provider whose nominal was recorded has ``as_recorded(record, time)``: its nominal variables at instants (K,), as they stand
    in the record, whatever a closed loop made of them.
    """
    problem = prepared.problem
    if not corrects_a_record(problem):
        return None
    provider: Any = problem.provider
    time, outputs = prepared.steps.time, [o for o, _ in problem.plan.outputs]
    with plugin_code(problem.owners.get("nominal"), "as_recorded() of 'nominal'"):
        nominal = provider.as_recorded(prepared.record, time)
        scales = [_error_scale(output, nominal, time.size) for output in outputs]
    values = [output_value(output, _nothing(prepared, output), nominal, time.size) for output in outputs]
    units = tuple(o.error_unit for o in outputs for _ in o.components)
    return AsRecorded(np.concatenate(values, axis=1), np.concatenate(scales, axis=1), units)


def corrects_a_record(problem: Problem) -> bool:
    """There are outputs, of a nominal that a device recorded, and states that correct them."""
    return bool(hasattr(problem.provider, "as_recorded") and problem.plan.outputs and problem.plan.states)


def _nothing(prepared: Prepared, output: Output) -> dict[str, FloatArray]:
    """Estimates of zero of the blocks that an output reads."""
    model, count = prepared.problem.model, len(prepared.steps)
    names = [name for name, _, _ in output.jacobian if name in model.offsets]
    return {name: np.zeros((count, len(model.block(name).all_axes))) for name in names}


def _error_scale(output: Output, nominal: Mapping[str, FloatArray], count: int) -> FloatArray:
    shape = (count, len(output.components))
    if output.error_scale is None:
        return np.ones(shape)
    return np.array(np.broadcast_to(np.asarray(output.error_scale(nominal), dtype=float), shape))
