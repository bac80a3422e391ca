"""What an ``estimator`` section asks for."""

from __future__ import annotations

from dataclasses import dataclass

from estimfw.config.generic.decentralised import DecentralisedConfig
from estimfw.config.generic.kalman import KalmanConfig
from estimfw.config.generic.unscented import UnscentedConfig
from estimfw.units.quantity import Quantity

__all__ = ["Estimation", "RecursionSettings", "StartSpread", "one_filter"]

#: Settings of a recursion over the whole model.
RecursionSettings = KalmanConfig | UnscentedConfig | DecentralisedConfig


@dataclass(frozen=True, slots=True)
class StartSpread:
    """Several starts around one.

    Attributes
    ----------
    quantity : str
        A value of the start, or the quantity of a correction slot.
    axis : str, int or None
        Of a frame, or a place; None for a single number.
    count : int
    spacing : Quantity
    """

    quantity: str
    axis: str | int | None
    count: int
    spacing: Quantity

    @property
    def steps(self) -> tuple[int, ...]:
        """How many spacings each is away: 0, 1, -1, 2, -2, ..."""
        return tuple((k + 1) // 2 * (1 if k % 2 else -1) for k in range(self.count))


@dataclass(frozen=True, slots=True)
class Estimation:
    """An algorithm and its settings.

    Attributes
    ----------
    kind : str
        ``kalman``, ``unscented``, ``decentralised``, ``bank``, ``determination``.
    filter : KalmanConfig, UnscentedConfig or DecentralisedConfig
        How the recursion is done; of each member of a bank.
    starts : StartSpread or None
        How the members of a bank differ; None: the start itself is several.
    """

    kind: str
    filter: RecursionSettings
    starts: StartSpread | None = None


def one_filter(cfg: RecursionSettings) -> Estimation:
    """One filter."""
    return Estimation(cfg.kind, cfg)
