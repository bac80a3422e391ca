"""Derived variables for the scan of a model that has none in its loop; `estimfw.kernels.completion` writes the others."""

from __future__ import annotations

from numba import njit

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def complete_process(row):
    """Leave the row as it is, before the process terms read it."""


@njit(cache=True)
def complete_end(row):
    """Leave the row as it is, before measurements and corrections read it."""
