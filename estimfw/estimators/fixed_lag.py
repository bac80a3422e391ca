"""Fixed lag: each state as it is known when all data of a lag after it are there, while the data come in.

The links of a window are one link, made by composing them. A queue of two stacks keeps the window's: behind, links are
composed as they come; in front, each is composed with all that follow it there. So a step costs three compositions on average,
however long the lag is, and steps need not be equal. Once a lag, when the front is used up, all behind go there in one step.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimfw.data.record import SAME
from estimfw.estimators.links import Links
from estimfw.kernels.smooth import Link

__all__ = ["FixedLag", "Lagged"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lagged:
    """The state at ``time`` (s): ``estimate`` (n,) and covariance by all data up to the lag after it.

    ``form`` (n, n): the covariance in the form of `estimfw.kernels.ud`.
    """

    time: float
    estimate: FloatArray
    form: FloatArray


class FixedLag:
    """Smooths the steps of one filter as they are done.

    Parameters
    ----------
    lag : float, s
        A step is smoothed as soon as the filter is so much later; data after that do not count.
    kernel : module
        `estimfw.kernels.smooth` or its compiled twin.
    """

    def __init__(self, lag: float, kernel: ModuleType) -> None:
        self.lag, self._kernel = lag, kernel
        self._waiting: deque[tuple[float, FloatArray]] = deque()
        self._front: list[Link] = []
        self._behind: list[Link] = []
        self._total: Link | None = None
        self._newest: FloatArray = np.zeros((0, 0))

    def push(self, time: FloatArray, links: Links, estimate: FloatArray) -> list[Lagged]:
        """Hand over K steps: their ends (K,) in s, their links to the steps before, and the estimates (K, n) after them.

        Returns the steps that the lag has passed since those before, the earliest first.
        """
        done: list[Lagged] = []
        for k, end in enumerate(time.tolist()):
            if self._waiting:
                link = links.gain[k], links.shift[k], links.rest[k]
                self._behind.append(link)
                self._total = link if self._total is None else self._kernel.composed(self._total, link)
            self._waiting.append((end, estimate[k]))
            self._newest = links.form[k]
            done += self._taken(end - self.lag + SAME)
        return done

    def rest(self) -> list[Lagged]:
        """At the end of the data: the steps that the lag has not passed, with all data that there are."""
        return list(self._taken(np.inf))

    def _taken(self, until: float) -> Iterator[Lagged]:
        while self._waiting and self._waiting[0][0] <= until:
            time, estimate = self._waiting.popleft()
            yield self._smoothed(time, estimate)
            if self._waiting:
                self._drop_link()

    def _smoothed(self, time: float, estimate: FloatArray) -> Lagged:
        links = [link for link in (self._front[-1] if self._front else None, self._total) if link is not None]
        n = estimate.size
        C, b, L = (np.array([link[i] for link in links]) for i in range(3))
        corrections, forms = self._kernel.backward(
            C.reshape(-1, n, n), b.reshape(-1, n), L.reshape(-1, n, n), np.zeros(n), self._newest
        )
        return Lagged(time, estimate + corrections[0], forms[0])

    def _drop_link(self) -> None:
        """The link from the step that is next to the one that was taken."""
        if not self._front:
            for link in reversed(self._behind):
                self._front.append(self._kernel.composed(link, self._front[-1]) if self._front else link)
            self._behind, self._total = [], None
        self._front.pop()
