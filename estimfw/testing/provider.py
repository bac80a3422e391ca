"""A nominal provider is a pure scan on flat arrays with leading axes (contract 5 of the design)."""

from __future__ import annotations

import pickle
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.estimators.unscented_scan import manifold_of
from estimfw.model.nominal import BoundProvider
from estimfw.testing.first_steps import FirstSteps, first_steps

__all__ = ["check_provider"]

FloatArray = NDArray[np.float64]
STEPS = 5
#: Compiled and plain code may round differently; relative, and absolute where large numbers (gravity) cancel.
ROUNDING = 1e-12


def check_provider(problem: Problem) -> None:
    """Check the provider of a filter over the first steps of its record.

    * configured, it can be pickled and hashed;
    * a row has the width of its variables, and so has the reference nominal;
    * ``step`` and ``correct`` leave their arguments alone, and give for stacked states what they give for each;
    * a correction by zero changes nothing;
    * ``difference``, where there is one, is the inverse of ``correct``;
    * the compiled step and correction, where there are some, do as the plain ones.

    Raises
    ------
    AssertionError
        With what does not hold.
    """
    assert pickle.loads(pickle.dumps(problem.provider)) == problem.provider, "the provider changes when it is pickled"
    hash(problem.provider)
    first = first_steps(problem, STEPS)
    if first is None:
        return
    _check_rows(problem, first)
    _check_purity(problem, first)
    _check_leading_axes(problem, first)
    if callable(getattr(first.provider, "difference", None)):
        _check_difference(problem, first)
    if first.provider.compiled is not None:
        _check_compiled(problem, first, first.provider)


def _width(problem: Problem) -> int:
    return 3 * len(problem.provider.slots)


def _check_rows(problem: Problem, first: FirstSteps) -> None:
    variables = problem.provider.variables(problem.settings.computed)
    size = sum(v.size for v in variables)
    for what, row in zip(
        ("process row", "end row"), first.provider.step(first.state, first.samples[0])[1:], strict=True
    ):
        assert row.shape == (size,), f"the {what} is {row.shape}, the variables fill ({size},)"
    for v in variables:
        shape = np.shape(problem.reference[v.name])
        assert shape == v.shape, f"the reference nominal has {v.name} as {shape}, the layout as {v.shape}"


def _check_purity(problem: Problem, first: FirstSteps) -> None:
    state, sample, delta = first.state.copy(), first.samples[0].copy(), np.zeros(_width(problem))
    first.provider.step(state, sample)
    assert np.array_equal(state, first.state), "step writes into its state"
    assert np.array_equal(sample, first.samples[0]), "step writes into its sample"
    corrected = first.provider.correct(state, delta)
    assert np.array_equal(state, first.state), "correct writes into its state"
    np.testing.assert_allclose(corrected, state, rtol=1e-15, atol=0, err_msg="a correction by zero changes the state")


def _check_difference(problem: Problem, first: FirstSteps) -> None:
    manifold = manifold_of(first.provider)
    states = _disturbed(problem, first)
    delta = 0.3 * np.random.default_rng(2).standard_normal((3, _width(problem)))
    others = first.provider.correct(states, delta)
    found = manifold.difference(states, others)
    assert found.shape == delta.shape, f"difference makes the shape {found.shape}, {delta.shape} is due"
    there = first.provider.correct(states, found)
    np.testing.assert_allclose(
        there, others, rtol=1e-9, atol=1e-9, err_msg="correct(state, difference(state, other)) is not other"
    )


def _disturbed(problem: Problem, first: FirstSteps) -> FloatArray:
    """Three states near the start, (3, n_state)."""
    small = 1e-3 * np.random.default_rng(0).standard_normal((3, _width(problem)))
    return np.stack([first.provider.correct(first.state, delta) for delta in small])


def _check_leading_axes(problem: Problem, first: FirstSteps) -> None:
    states = _disturbed(problem, first)
    stacked = first.provider.step(states, np.broadcast_to(first.samples[0], (3, first.samples.shape[1])))
    for k, state in enumerate(states):
        for what, together, alone in zip(
            ("state", "process row", "end row"), stacked, first.provider.step(state, first.samples[0]), strict=True
        ):
            np.testing.assert_allclose(
                together[k], alone, rtol=ROUNDING, atol=ROUNDING, err_msg=f"stacked states give another {what}"
            )


def _check_compiled(problem: Problem, first: FirstSteps, provider: BoundProvider) -> None:
    assert provider.compiled is not None
    module = import_module(provider.compiled.module)
    step, correct = getattr(module, provider.compiled.step), getattr(module, provider.compiled.correct)
    plain = first.state
    compiled = plain.copy()
    process, end = (np.empty(row.shape) for row in provider.step(plain, first.samples[0])[1:])
    for sample in first.samples:
        plain, *rows = provider.step(plain, sample)
        step(compiled, sample, provider.params, process, end)
        for what, mine, its in zip(
            ("state", "process row", "end row"), (plain, *rows), (compiled, process, end), strict=True
        ):
            np.testing.assert_allclose(
                its, mine, rtol=ROUNDING, atol=ROUNDING, err_msg=f"compiled step: another {what}"
            )
    delta = 1e-3 * np.random.default_rng(1).standard_normal(_width(problem))
    corrected = provider.correct(plain, delta)
    correct(compiled, delta, provider.params)
    np.testing.assert_allclose(
        compiled, corrected, rtol=ROUNDING, atol=ROUNDING, err_msg="compiled correct: another state"
    )
