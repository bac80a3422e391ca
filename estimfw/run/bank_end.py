"""Which member of a bank is reported at the end of a result, and how the others stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BankEnd", "bank_end"]


@dataclass(frozen=True, slots=True)
class BankEnd:
    """``member`` is reported without a break since ``since`` (s); ``weights`` are those of all, the largest first."""

    member: str
    since: float
    weights: tuple[tuple[str, float], ...]

    @property
    def weight(self) -> float:
        """Of the reported member."""
        return dict(self.weights)[self.member]


def bank_end(dataset: xr.Dataset) -> BankEnd | None:
    """None where the result is not that of a bank."""
    if "bank_member" not in dataset or not dataset.sizes["time"]:
        return None
    labels = [str(label) for label in dataset["member"].to_numpy()]
    best, last = dataset["bank_member"].to_numpy(), dataset["bank_weight"].to_numpy()[-1]
    others = np.flatnonzero(best != best[-1])
    since = float(dataset["time"].to_numpy()[others[-1] + 1 if others.size else 0])
    order = np.argsort(-last, kind="stable")
    return BankEnd(labels[int(best[-1])], since, tuple((labels[i], float(last[i])) for i in order))
