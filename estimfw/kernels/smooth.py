"""Backwards from one step to the one before: what all later data say of a state, once they are known at the next step.

With x+ and P+ of step k - 1, and x- = Phi x+ + d, P- = Phi P+ Phi' + Q of step k (Rauch, Tung and Striebel 1965):

    C = P+ Phi' (P-)^-1        x = x+ + C (x_k - x-)        P = C P_k C' + L,   L = (I - C Phi) P+ (I - C Phi)' + C Q C'

No P- is inverted, and none need have an inverse: a state may be known exactly, and Q singular. Bierman's time update has with
P+ = U diag(D) U' and Q = Uq diag(Dq) Uq' the rows W = [Phi U, Uq] = U- V, V diag(D, Dq) V' = D-. So with V = [V1, V2]

    C = G (U-)^-1,   G = U D V1' (D-)^-1        L = B diag(D, Dq) B',   B = [U - G V1, -G V2]

where what has no D- has none in G: nothing is learnt of what was known. P is made as in a time update, by C in place of Phi and L
in place of Q, so it cannot become negative; and as all goes by factors, the condition number of P- counts with its root.

With u the correction of x+, u_(k-1) = C u_k + b, b = C (x+_k - x-_k): links (C, b, L) compose, see `composed`. L and P have the
form of `estimfw.kernels.ud`. Arrays have leading axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimfw.kernels.ud import factor, orthogonal, split

__all__ = ["Link", "backward", "composed", "gain"]

FloatArray = NDArray[np.float64]
Link = tuple[FloatArray, FloatArray, FloatArray]

#: What of a variance is no larger than this part of it is a rounding: it is known from the rest.
KNOWN = 1e-22


def gain(form: FloatArray, Phi: FloatArray, Q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C and L (..., n, n) of the time update that begins with this covariance."""
    n = form.shape[-1]
    (U, D), (Uq, Dq) = split(form), split(factor(Q))
    weight = np.concatenate(np.broadcast_arrays(D, Dq), axis=-1)
    after, V = orthogonal(np.concatenate(np.broadcast_arrays(Phi @ U, Uq), axis=-1), weight, KNOWN)
    U_after, D_after = split(after)
    live = D_after != 0.0
    inverse = np.where(live, 1.0 / np.where(live, D_after, 1.0), 0.0)
    G = U @ (D[..., :, None] * np.swapaxes(V[..., :n], -1, -2) * inverse[..., None, :])
    B = -G @ V
    B[..., :n] += U
    C = G.copy()
    for j in range(1, n):
        C[..., j] -= np.einsum("...ij,...j->...i", C[..., :j], U_after[..., :j, j])
    return C, orthogonal(B, weight, KNOWN)[0]


def backward(
    C: FloatArray, b: FloatArray, L: FloatArray, u: FloatArray, form: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Corrections (K + 1, n) and covariances (K + 1, n, n) at all ends of K links, from those at the last, (n,) and (n, n)."""
    steps, n = b.shape
    corrections, forms = np.empty((steps + 1, n)), np.empty((steps + 1, n, n))
    corrections[-1], forms[-1] = u, form
    for k in range(steps - 1, -1, -1):
        corrections[k] = C[k] @ corrections[k + 1] + b[k]
        forms[k] = _carried(C[k], forms[k + 1], L[k])
    return corrections, forms


def composed(first: Link, then: Link) -> Link:
    """One link in place of two: ``first`` is that of the earlier time."""
    (C1, b1, L1), (C2, b2, L2) = first, then
    return C1 @ C2, np.einsum("...ij,...j->...i", C1, b2) + b1, _carried(C1, L2, L1)


def _carried(C: FloatArray, form: FloatArray, L: FloatArray) -> FloatArray:
    """C P C' + L."""
    (U, D), (Ul, Dl) = split(form), split(L)
    return orthogonal(np.concatenate([C @ U, Ul], axis=-1), np.concatenate([D, Dl], axis=-1))[0]
