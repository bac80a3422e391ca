"""From x' = F x + w, E[w w'] = D delta, x' += b, to x <- Phi x + d + w_k, E[w_k w_k'] = Q."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

__all__ = ["doubled", "held_noise", "series", "van_loan"]

FloatArray = NDArray[np.float64]


def van_loan(
    F: FloatArray, D: FloatArray, b: FloatArray, dt: FloatArray, doublings: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Exact discretisation by one matrix exponential (Van Loan 1978).

    Parameters
    ----------
    F, D : (..., n, n) array
        Dynamics (1/s) and diffusion G Q G^T.
    b : (..., n) array
        Known input rate.
    dt : (...) array, s
    doublings : int
        The interval is cut into 2**doublings, for stiff F dt.

    Returns
    -------
    Phi, Q : (..., n, n) array
    d : (..., n) array
    """
    n = F.shape[-1]
    h = np.asarray(dt, dtype=float)[..., None, None] / 2.0**doublings
    lead = np.broadcast_shapes(F.shape[:-2], D.shape[:-2], b.shape[:-1], h.shape[:-2])
    block = np.zeros((*lead, 2 * n + 1, 2 * n + 1))
    block[..., :n, :n] = -F * h
    block[..., :n, n : 2 * n] = D * h
    block[..., n : 2 * n, n : 2 * n] = np.swapaxes(F, -1, -2) * h
    block[..., 2 * n, n : 2 * n] = b * h[..., 0]
    exponential = expm(block)
    Phi = np.swapaxes(exponential[..., n : 2 * n, n : 2 * n], -1, -2)
    Q = np.where(_reached(F, D), Phi @ exponential[..., :n, n : 2 * n], 0.0)
    return doubled(Phi, Q, exponential[..., 2 * n, n : 2 * n], doublings)


def _reached(F: FloatArray, D: FloatArray) -> NDArray[np.bool_]:
    """Pairs of states (..., n, n) that noise gets to by the pattern of F and D; the others have none.

    What a matrix exponential leaves of rounding at the others, a constant for instance, would be pivots of a factor of Q.
    """
    reached = np.einsum("...ii->...i", D) != 0.0
    couples = F != 0.0
    for _ in range(F.shape[-1]):
        more = reached | np.any(couples & reached[..., None, :], axis=-1)
        if np.array_equal(more, reached):
            break
        reached = more
    return np.asarray(reached[..., :, None] & reached[..., None, :])


def series(
    F: FloatArray, D: FloatArray, b: FloatArray, dt: FloatArray, phi_order: int, q_order: int, doublings: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Truncated series: Phi to ``dt**phi_order``, Q to ``dt**q_order`` (1: Q = D dt), d as Phi.

    Q follows from Q' = F Q + Q F' + D: its k-th Taylor term is L^(k-1)(D) dt^k / k! with L(X) = F X + X F'.
    Shapes as for `van_loan`.
    """
    h = np.asarray(dt, dtype=float)[..., None, None] / 2.0**doublings
    n = F.shape[-1]
    lead = np.broadcast_shapes(F.shape[:-2], h.shape[:-2])
    Phi = np.broadcast_to(np.eye(n), (*lead, n, n)).copy()
    power = Phi
    rate = np.asarray(b)[..., None] * h
    d = rate if phi_order >= 1 else np.zeros_like(rate)
    for k in range(1, phi_order + 1):
        power = power @ F * (h / k)
        Phi = Phi + power
        if k < phi_order:
            rate = F @ rate * (h / (k + 1))
            d = d + rate
    term = D * h
    Q = term
    for k in range(2, q_order + 1):
        product = F @ term
        term = (product + np.swapaxes(product, -1, -2)) * (h / k)
        Q = Q + term
    return doubled(Phi, Q, d[..., 0], doublings)


def held_noise(
    F: FloatArray, D: FloatArray, b: FloatArray, dt: FloatArray, doublings: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Exact where the noise is held constant over the step, with covariance D / dt: Q = Gamma (D / dt) Gamma^T.

    Gamma = int_0^dt e^(F s) ds. A sensor that holds a reading until the next one makes such noise; white noise makes that of
    `van_loan`. They agree to dt^2: to the third order 4, 6, 4 stand in Q here where white noise has 4, 8, 4 (times dt^3 / 24).
    Shapes as for `van_loan`.
    """
    n = F.shape[-1]
    h = np.asarray(dt, dtype=float)[..., None, None] / 2.0**doublings
    lead = np.broadcast_shapes(F.shape[:-2], b.shape[:-1], h.shape[:-2])
    block = np.zeros((*lead, 2 * n, 2 * n))
    block[..., :n, :n] = F * h
    block[..., :n, n:] = np.eye(n) * h
    exponential = expm(block)
    Phi, Gamma = exponential[..., :n, :n], exponential[..., :n, n:]
    for _ in range(doublings):
        Gamma = Phi @ Gamma + Gamma
        Phi = Phi @ Phi
    Q = Gamma @ D @ np.swapaxes(Gamma, -1, -2) / np.asarray(dt, dtype=float)[..., None, None]
    Q = np.where(_reached(F, D), Q, 0.0)
    return Phi, 0.5 * (Q + np.swapaxes(Q, -1, -2)), (Gamma @ b[..., None])[..., 0]


def doubled(Phi: FloatArray, Q: FloatArray, d: FloatArray, times: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same over an interval 2**times as long."""
    for _ in range(times):
        d = np.einsum("...ij,...j->...i", Phi, d) + d
        Q = Phi @ Q @ np.swapaxes(Phi, -1, -2) + Q
        Phi = Phi @ Phi
    return Phi, 0.5 * (Q + np.swapaxes(Q, -1, -2)), d
