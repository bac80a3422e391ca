"""What an ``estimator`` section asks for."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.config.generic.kalman import KalmanConfig
from estimfw.config.generic.unscented import UnscentedConfig

__all__ = ["Estimation", "RecursionSettings", "one_filter"]

#: Settings of a recursion over the whole model.
RecursionSettings = KalmanConfig | UnscentedConfig


@dataclass(frozen=True, slots=True)
class Estimation:
    """An algorithm and its settings.

    Attributes
    ----------
    kind : str
        ``kalman``, ``unscented``, ``determination``.
    filter : KalmanConfig or UnscentedConfig
        How the recursion is done.
    """

    kind: str
    filter: RecursionSettings


def one_filter(cfg: RecursionSettings) -> Estimation:
    """One filter."""
    return Estimation(cfg.kind, cfg)
