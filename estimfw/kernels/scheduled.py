"""The compiled step of a nominal that time alone moves: the sample is the row, for the whole interval and at its end."""

from __future__ import annotations

from typing import Any

from numba import njit

__all__ = ["correct", "step"]


@njit(cache=True)
def step(state: Any, sample: Any, params: Any, process_row: Any, end_row: Any) -> None:
    """Both rows become the sample."""
    process_row[:] = sample
    end_row[:] = sample


@njit(cache=True)
def correct(state: Any, delta: Any, params: Any) -> None:
    """Leave the state as it is."""
