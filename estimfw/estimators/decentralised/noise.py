"""Noises of two nodes that are correlated: each measurement is rid of what those fused before it tell of its noise.

Once l is fused, y_c <- y_c - B y_l with B = R_cl R_ll^-1 has the noise v_c - B v_l, which does not know v_l any more, and
H_c <- H_c - B H_l, R_cd <- R_cd - B R_ld. What was not fused tells nothing: a gated or missing l is passed over, and of l only
its usable components count. Every node knows H, R and what was fused, so each does this for itself; only y_l has to be sent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.estimators.decentralised.work import Stage, Work

__all__ = ["Decorrelation"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: An eigenvalue of a correlation of noises below this is a rounding: the noise is perfectly known there.
SINGULAR = 1e-13


@dataclass
class Decorrelation:
    """The stages of one step as they stand; ``taken[c]`` are the (l, B) that y_c has to be rid of."""

    stages: dict[int, Stage]
    noise: dict[tuple[int, int], FloatArray]
    taken: dict[int, list[tuple[int, FloatArray]]] = field(default_factory=dict)

    @classmethod
    def of(cls, work: Work) -> Decorrelation:
        return cls({stage.place: stage for stage in work.stages}, dict(work.noise))

    def later(self, place: int) -> list[int]:
        """The measurements still to come whose noise is correlated with this one."""
        return [second for first, second in self.noise if first == place]

    def reading(self, place: int, z: FloatArray, sent: Mapping[int, FloatArray]) -> FloatArray:
        """y of a measurement from its reading z, and from those that were sent, by place."""
        for before, B in self.taken.get(place, ()):
            z = z - B @ sent[before]
        return z

    def fused(self, place: int, usable: BoolArray) -> None:
        """Tell that this measurement was fused, with which components."""
        following = self.later(place)
        if not following:
            return
        own = self.stages[place]
        gain = {c: _regression(self.noise[place, c].T, own.R, usable) for c in following}
        for c in following:
            stage, B = self.stages[c], gain[c]
            self.stages[c] = replace(
                stage,
                H=stage.H - B @ own.H,
                R=_symmetric(stage.R - B @ self.noise[place, c]),
                reads=stage.reads | ((B != 0.0) @ own.reads),
            )
            self.taken.setdefault(c, []).append((place, B))
            for d in following:
                if d > c:
                    rest = self.noise.get((c, d), 0.0) - B @ self.noise[place, d]
                    self.noise[c, d] = rest


def _regression(R_cl: FloatArray, R_ll: FloatArray, usable: BoolArray) -> FloatArray:
    """R_cl R_ll^-1 over the usable components of l, zero for the others; R_ll may be singular."""
    sigma = np.sqrt(np.diag(R_ll))
    live = usable & (sigma > 0.0)
    scale = sigma[live]
    B = np.zeros_like(R_cl)
    inside = np.linalg.pinv(R_ll[np.ix_(live, live)] / np.outer(scale, scale), rcond=SINGULAR, hermitian=True)
    B[:, live] = (R_cl[:, live] / scale) @ inside / scale
    return B


def _symmetric(R: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (R + R.T))
