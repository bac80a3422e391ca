"""The Jacobian of an output is the derivative of its value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.model.parts import Output
from estimfw.plan.lowering import Lowered
from estimfw.run.outputs import wrapped
from estimfw.testing.first_steps import first_steps

__all__ = ["check_outputs"]

FloatArray = NDArray[np.float64]
STEP = 1e-6


def check_outputs(problem: Problem, tolerance: float = 1e-6) -> None:
    """Compare the Jacobian of each output, at estimates of zero, with central differences of its value.

    Parameters
    ----------
    problem : Problem
    tolerance : float
        Largest difference, of the largest entry of the Jacobian.

    Raises
    ------
    AssertionError
        Naming the output and the block.
    """
    first = first_steps(problem, 1)
    row = problem.plan.layout.pack(problem.reference)
    if first is not None:
        row = first.provider.step(first.state, first.samples[0])[2]
    row = problem.plan.layout.complete(row)
    for output, jacobian in problem.plan.outputs:
        _check(problem, output, jacobian, row, tolerance)


def _check(problem: Problem, output: Output, jacobian: Lowered, row: FloatArray, tolerance: float) -> None:
    given = jacobian.evaluate(row)
    nominal = problem.plan.layout.unpack(row)
    blocks = [problem.model.block(name) for name, _, _ in output.jacobian if name in problem.model.offsets]
    still = {b.name: np.zeros(len(b.all_axes)) for b in blocks}
    for block in blocks:
        at = problem.model.offsets[block.name]
        for column, axis in enumerate(block.live):
            ends = []
            for sign in (1.0, -1.0):
                moved = still[block.name].copy()
                moved[axis] = sign * STEP
                ends.append(np.asarray(output.value({**still, block.name: moved}, nominal), dtype=float))
            slope = wrapped(ends[0] - ends[1], output.period) / (2.0 * STEP)
            worst = float(np.max(np.abs(given[:, at + column] - slope)))
            assert worst <= tolerance * max(1.0, float(np.max(np.abs(given)))), (
                f"output {output.name}: its Jacobian over {block.labels[column]} differs by {worst:.3g} from finite "
                f"differences: {given[:, at + column]} against {slope}"
            )
