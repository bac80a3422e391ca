"""The prior at a start that was found: the covariance of the finding in place of the block's own.

What was found with the same sensors is wrong by their biases too, so it is correlated with the states that are those biases. To
leave that out would count their uncertainty twice: levelled by biased accelerometers, then believed to be independent of them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.model.frame import rotation
from estimfw.model.model import Model
from estimfw.model.nominal import InitialNominal, Share
from estimfw.model.parts import StateBlock

__all__ = ["with_found_covariance"]

FloatArray = NDArray[np.float64]


def with_found_covariance(
    model: Model, covariance: FloatArray, start: InitialNominal, nominal: Mapping[str, ArrayLike]
) -> FloatArray:
    """The prior covariance (n, n) with what a start found.

    Parameters
    ----------
    model : Model
    covariance : (n, n) array
        The prior as configured, at the start.
    start : InitialNominal
    nominal : mapping of str to array
        At the start; it rotates what causes the found error into the frame of its block.

    Notes
    -----
    With found error = S q + rest and the configured prior P_q of a block q, the found block gets S P_q S^T + rest and the
    correlation S P_q with it. Of a q that the model does not have (any more) the share stays as the finding assumed it. Of a
    quotient the whole model is given what was found, for its states are combinations.
    """
    if model.quotient is not None and start.covariance:
        full, T = model.quotient.of, model.quotient.T
        return np.asarray(T @ with_found_covariance(full, full.prior.evaluate(nominal)[1], start, nominal) @ T.T)
    made = covariance.copy()
    for block in model.blocks:
        found = start.covariance.get(block.quantity)
        if found is None:
            continue
        own = _place(model, block)
        made[own, :] = made[:, own] = 0.0
        turn = _turn(block, model, nominal)
        total = turn @ np.asarray(found, dtype=float) @ turn.T
        for name, share in start.shares.get(block.quantity, {}).items():
            for cause in (b for b in model.blocks if b.quantity == name):
                S, assumed = _in_frame_of(cause, share, model, nominal)
                S = turn @ S
                live, at = list(cause.live), _place(model, cause)
                prior, S_live = covariance[at, at], S[:, live]
                total = total + S_live @ (prior - assumed[np.ix_(live, live)]) @ S_live.T
                made[own, at] = S_live[list(block.live)] @ prior
                made[at, own] = made[own, at].T
        made[own, own] = total[np.ix_(block.live, block.live)]
    return made


def _place(model: Model, block: StateBlock) -> slice:
    at = model.offsets[block.name]
    return slice(at, at + len(block.axes))


def _in_frame_of(
    cause: StateBlock, share: Share, model: Model, nominal: Mapping[str, ArrayLike]
) -> tuple[FloatArray, FloatArray]:
    """Sensitivity to, and assumed covariance of, a cause in the frame in which its block lives now."""
    turn = _turn(cause, model, nominal)
    return share.sensitivity @ turn.T, turn @ share.covariance @ turn.T


def _turn(block: StateBlock, model: Model, nominal: Mapping[str, ArrayLike]) -> FloatArray:
    """Rotation from the frame in which a block was declared to the one in which it lives now."""
    if block.home_frame is None or block.frame is None or block.frame == block.home_frame:
        return np.eye(len(block.all_axes))
    return rotation(block.home_frame, block.frame, model.frame_map).evaluate(nominal)
