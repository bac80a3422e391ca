"""Who is closer, and from when on errors stay small."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from estimfw.analysis.rivals import closer, settled

ERRORS = arrays(float, (4, 9), elements=st.floats(-2.0, 2.0))
TIME = np.arange(9.0)


@given(ERRORS)
def test_settled_is_the_first_instant_after_which_no_error_is_as_large_as_the_bound(error: np.ndarray) -> None:
    for own, since in zip(error, settled(TIME, error, 1.0), strict=True):
        beyond = np.flatnonzero(np.abs(own) >= 1.0)
        last = beyond[-1] if beyond.size else -1
        assert since == (np.inf if last == 8 else TIME[last + 1])


def test_what_is_not_known_is_not_settled() -> None:
    assert settled(TIME, np.full((1, 9), np.nan), 1.0)[0] == np.inf
    late = np.where(TIME < 3.0, np.nan, 0.1)[None]
    assert settled(TIME, late, 1.0)[0] == 3.0


def test_a_tie_is_closer_for_nobody() -> None:
    ones = np.ones(3)
    assert closer(ones, -ones) == 0
    assert closer(np.array([0.5, -0.5, 2.0]), ones) == 2
