"""Coefficients and products of matrices as loops for numba, in place; products skip what is zero."""

from __future__ import annotations

from numba import njit

# mypy: disallow-untyped-defs=False, disallow-untyped-decorators=False, check-untyped-defs=False
# mypy: disable-error-code="no-untyped-def, no-untyped-call, type-arg, untyped-decorator"


@njit(cache=True)
def evaluate(entry, constant, factors, row, out):
    """out.flat[entry] += constant * product of factors; out is flat and is cleared first."""
    out[:] = 0.0
    for k in range(entry.shape[0]):
        value = constant[k]
        for p in range(factors.shape[1]):
            if factors[k, p] >= 0:
                value *= row[factors[k, p]]
        out[entry[k]] += value


@njit(cache=True)
def sparse_times(ni, nj, values, X, out):
    """out = F X for F with values at (ni, nj)."""
    n = X.shape[1]
    out[:, :] = 0.0
    for k in range(ni.shape[0]):
        i, j, f = ni[k], nj[k], values[k]
        if f != 0.0:
            for c in range(n):
                out[i, c] += f * X[j, c]


@njit(cache=True)
def dense_times(A, B, out):
    """out = A B, skipping zeros of A."""
    out[:, :] = 0.0
    for i in range(A.shape[0]):
        for k in range(A.shape[1]):
            a = A[i, k]
            if a != 0.0:
                for j in range(B.shape[1]):
                    out[i, j] += a * B[k, j]


@njit(cache=True)
def times_transposed(A, B, out):
    """out = A B', skipping zeros of B."""
    out[:, :] = 0.0
    for j in range(B.shape[0]):
        for k in range(B.shape[1]):
            b = B[j, k]
            if b != 0.0:
                for i in range(A.shape[0]):
                    out[i, j] += A[i, k] * b
