"""What an ``estimator`` section asks for."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.config.generic.kalman import KalmanConfig

__all__ = ["Estimation", "one_filter"]


@dataclass(frozen=True, slots=True)
class Estimation:
    """An algorithm and its settings.

    Attributes
    ----------
    kind : str
        ``kalman``, ``determination``.
    filter : KalmanConfig
        How the recursion is done.
    """

    kind: str
    filter: KalmanConfig


def one_filter(cfg: KalmanConfig) -> Estimation:
    """One Kalman filter."""
    return Estimation("kalman", cfg)
