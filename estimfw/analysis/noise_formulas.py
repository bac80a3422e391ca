"""Formulas for the covariance Q of the noise that a step collects, from F and the diffusion D, and what they are held against.

White noise gives Q = int_0^T e^(F s) D e^(F' s) ds, which as a series is

    D T + T^2/2 (F D + D F') + T^3/24 (4 F^2 D + 8 F D F' + 4 D F'^2) + ...

Noise that is held constant over the step, with covariance D / T, gives Gamma (D / T) Gamma', Gamma = int_0^T e^(F s) ds: 4, 6, 4
in the third order, which is what some papers print for white noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimfw.kernels.discretise import held_noise, series, van_loan

__all__ = ["FORMULAS", "NoiseFormula", "exact_noise"]

FloatArray = NDArray[np.float64]
LongArray = NDArray[np.longdouble]

#: Steps of the reference are halved until |F| h is below this, and its series has so many terms: e^(1/4) to 1e-25.
SHORT, TERMS = 0.25, 20


@dataclass(frozen=True, slots=True)
class NoiseFormula:
    """``noise`` takes F (n, n), D (n, n) and the step in s to Q (n, n); ``key`` is for machines, ``text`` for people."""

    key: str
    text: str
    noise: Callable[[FloatArray, FloatArray, float], FloatArray]


def _series(order: int) -> Callable[[FloatArray, FloatArray, float], FloatArray]:
    def noise(F: FloatArray, D: FloatArray, dt: float) -> FloatArray:
        return series(F, D, np.zeros(F.shape[0]), np.array(dt), 1, order)[1]

    return noise


def _third_of_held(F: FloatArray, D: FloatArray, dt: float) -> FloatArray:
    first, outer = F @ D, F @ F @ D
    return np.asarray(
        D * dt + (first + first.T) * dt**2 / 2.0 + (4.0 * (outer + outer.T) + 6.0 * F @ D @ F.T) * dt**3 / 24.0
    )


FORMULAS = (
    NoiseFormula("first", "first order, D T", _series(1)),
    NoiseFormula("second", "second order", _series(2)),
    NoiseFormula("third_printed", "third order with 4, 6, 4 (as some papers print it)", _third_of_held),
    NoiseFormula("third", "third order with 4, 8, 4 (right for white noise)", _series(3)),
    NoiseFormula(
        "held_noise",
        "exact for noise held over the step",
        lambda F, D, dt: held_noise(F, D, np.zeros(F.shape[0]), np.array(dt))[1],
    ),
    NoiseFormula("van_loan", "Van Loan, exact", lambda F, D, dt: van_loan(F, D, np.zeros(F.shape[0]), np.array(dt))[1]),
)
"""From the shortest series to the exact one."""


def exact_noise(F: FloatArray, D: FloatArray, dt: float) -> tuple[LongArray, LongArray]:
    """Q (n, n) of white noise, and of noise held over the step, in the longest floats that the machine has.

    By Taylor series over a part of the step, doubled back: no matrix exponential, so that it can judge those that use one.
    """
    A, diffusion = F.astype(np.longdouble), D.astype(np.longdouble)
    times = max(0, int(np.ceil(np.log2(max(float(np.abs(F).sum(axis=0).max(initial=0.0)) * dt / SHORT, 1e-300)))))
    h = np.longdouble(dt) / np.longdouble(2.0) ** times
    power: LongArray = np.eye(F.shape[0], dtype=np.longdouble)
    Phi, Gamma, term = power, power * h, diffusion * h
    Q = term
    for k in range(1, TERMS):
        power = power @ A * (h / k)
        Phi, Gamma = Phi + power, Gamma + power * (h / (k + 1))
        term = A @ term
        term = (term + term.T) * (h / (k + 1))
        Q = Q + term
    for _ in range(times):
        Q, Gamma, Phi = Phi @ Q @ Phi.T + Q, Phi @ Gamma + Gamma, Phi @ Phi
    return Q, Gamma @ diffusion @ Gamma.T / np.longdouble(dt)
