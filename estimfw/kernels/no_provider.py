"""The provider of a model that has none, for the compiled scan: nothing to step, nothing to correct."""

from __future__ import annotations

from typing import Any

from numba import njit

__all__ = ["correct", "step"]


@njit(cache=True)
def step(state: Any, sample: Any, params: Any, process_row: Any, end_row: Any) -> None:
    """Leave the rows as they are."""


@njit(cache=True)
def correct(state: Any, delta: Any, params: Any) -> None:
    """Leave the state as it is."""
