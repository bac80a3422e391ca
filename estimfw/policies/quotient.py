"""The exact quotient of a frozen model by its unobservable subspace: states that are combinations of others.

With K (n, k) a basis of the unobservable subspace and S the k states that go, ``T = [I, -K_kept K_S^-1]`` has the kernel K, and
for E, the embedding of the states that stay, ``T E = I``. As ``F K`` stays in K and ``H K = 0``,

    T F = F_r T  with F_r = T F E,      H = H_r T  with H_r = H E,      G_r = T G,  B_r = T B,  P0_r = T P0 T^T

(Kalman, "Mathematical description of linear dynamical systems", SIAM J. Control 1, 1963: the observable part). So the quotient
gives the innovations of the whole filter, whatever the state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from estimfw.analysis.directions import StateNames, Term, combination
from estimfw.errors import ConfigError
from estimfw.model.coefficient import constant
from estimfw.model.frame import rotation
from estimfw.model.model import Model
from estimfw.model.parts import NoiseInput, ProcessTerm, StateBlock
from estimfw.model.prior import Prior
from estimfw.model.quotient import Quotient
from estimfw.policies.drop_states import without_states
from estimfw.units.ratio import unit_ratio

__all__ = ["inexact", "quotient_map", "quotient_model", "refuse_inexact"]

FloatArray = NDArray[np.float64]

#: A part of a combination smaller than this, of the prior sigma of the state that it is part of, is rounding.
ROUNDING = 1e-11
#: Of the size of what is compared: the two sides of T F = F_r T differ by rounding only.
EXACT = 1e-8


def quotient_map(kernel: FloatArray, chosen: Sequence[int], covariance: FloatArray) -> FloatArray:
    """T (n - k, n).

    Parameters
    ----------
    kernel : (n, k) array
        The unobservable subspace, in the units of the states.
    chosen : sequence of int
        The k states that go; their rows of ``kernel`` are independent.
    covariance : (n, n) array
        The prior: tells what is rounding.
    """
    n, gone = kernel.shape[0], list(chosen)
    kept = [i for i in range(n) if i not in set(gone)]
    sigma = np.sqrt(np.diag(covariance))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    scaled = kernel / sigma[:, None]
    parts = -np.linalg.solve(scaled[gone].T, scaled[kept].T).T
    parts[np.abs(parts) < ROUNDING] = 0.0
    T = np.zeros((len(kept), n))
    T[range(len(kept)), kept] = 1.0
    T[:, gone] = parts * sigma[kept, None] / sigma[gone]
    return T


def quotient_model(model: Model, T: FloatArray, chosen: Sequence[int]) -> Model:
    """The quotient: what drives a state that goes also drives the combinations that it is part of, by terms with labels."""
    gone = [model.states[i] for i in chosen]
    carried = tuple(_carried(model, T, set(gone)))
    after = without_states(model.with_parts(terms=(*model.terms, *carried)), gone)
    before = model.prior
    prior = Prior(before.mean0, before.covariance0, constant(T) @ before.transform)
    rows = tuple(tuple(float(x) for x in row) for row in T)
    return after.with_parts(prior=prior, quotient=Quotient(model, rows, _meanings(model, T, set(gone))))


def _carried(model: Model, T: FloatArray, gone: set[str]) -> Iterator[ProcessTerm]:
    for term in model.terms:
        target = model.block(term.target)
        for block in model.blocks:
            weights = _weights(model, T, block, target, gone)
            if not np.any(weights):
                continue
            made = _carried_term(model, term, block, weights)
            source = model.source(term.source)
            if not made.coefficient.select(range(len(block.all_axes)), list(source.live)).is_zero:
                yield made


def _weights(model: Model, T: FloatArray, block: StateBlock, target: StateBlock, gone: set[str]) -> FloatArray:
    """The part of T from the states of ``target`` that go to those of ``block`` that stay, over all axes of both."""
    kept = [label for label in model.states if label not in gone]
    weights = np.zeros((len(block.all_axes), len(target.all_axes)))
    for i, row in zip(block.live, block.labels, strict=True):
        for j, column in zip(target.live, target.labels, strict=True):
            if row not in gone and column in gone:
                weights[i, j] = T[kept.index(row), model.states.index(column)]
    return weights


def _carried_term(model: Model, term: ProcessTerm, block: StateBlock, weights: FloatArray) -> ProcessTerm:
    source = model.source(term.source)
    come = model.noise_frame(source) if isinstance(source, NoiseInput) else None
    come = source.frame if isinstance(source, StateBlock) else come
    product = constant(weights) @ model.whole_term(term)
    if block.frame is not None and come is not None and come != block.frame:
        product = product @ rotation(block.frame, come, model.frame_map)
    return ProcessTerm(
        label=f"{term.label}.into_{block.name}", target=block.name, source=term.source, coefficient=product,
        frame=block.frame or come, text=f"{term.label}, as far as {block.name} stands for {term.target} too",
        aliases=(term.label, *term.aliases),
    )  # fmt: skip


def _meanings(model: Model, T: FloatArray, gone: set[str]) -> tuple[str, ...]:
    """``attitude_error[E] + 0.102 s2/m * accel_bias[N]``, SI."""
    names = StateNames.of(model)
    kept = [i for i, label in enumerate(model.states) if label not in gone]
    return tuple(_meaning(row, own, names) for row, own in zip(T, kept, strict=True))


def _meaning(row: FloatArray, own: int, names: StateNames) -> str:
    others = [i for i in np.flatnonzero(row).tolist() if i != own]
    terms = [Term(names.states[own], 1.0, "1")]
    terms += [Term(names.states[i], float(row[i]), unit_ratio(names.units[own], names.units[i])) for i in others]
    return combination(terms)


def refuse_inexact(model: Model, nominal: Mapping[str, FloatArray]) -> None:
    """Nothing for a model that is no quotient, or one that is exact at this nominal too.

    Raises
    ------
    ConfigError
        Naming the equation that does not hold: the quotient was made at another nominal.
    """
    broken = inexact(model, nominal)
    if broken:
        raise ConfigError(
            f"prune_unobservable: the quotient is not exact at this nominal, {broken} does not hold",
            hint="use mode: delete, or choose the states with drop_states",
        )


def inexact(model: Model, nominal: Mapping[str, FloatArray]) -> str:
    """Which equation of its quotient a model does not fulfil at a nominal; empty where it is exact, or no quotient."""
    if model.quotient is None:
        return ""
    full, T = model.quotient.of, model.quotient.T
    before, after = full.nominal(nominal), model.nominal(nominal)
    F, F_r = full.F.coefficient.evaluate(before), model.F.coefficient.evaluate(after)
    D, D_r = full.diffusion.evaluate(before), model.diffusion.evaluate(after)
    B, B_r = full.B.coefficient.evaluate(before), model.B.coefficient.evaluate(after)
    if _differ(T @ F, F_r @ T, np.abs(T) @ np.abs(F) + np.abs(F_r) @ np.abs(T)):
        return "T F = F_r T"
    if _differ(T @ D @ T.T, D_r, np.abs(T) @ np.abs(D) @ np.abs(T).T):
        return "D_r = T D T^T"
    if _differ(T @ B, B_r, np.abs(T) @ np.abs(B)):
        return "B_r = T B"
    for m in full.measurements:
        H = full.H(m.name).coefficient.evaluate(before)
        H_r = model.H(m.name).coefficient.evaluate(after)
        if len(H) != len(H_r) or _differ(H, H_r @ T, np.abs(H) + np.abs(H_r) @ np.abs(T)):
            return f"H = H_r T of {m.name}"
    return ""


def _differ(left: FloatArray, right: FloatArray, size: FloatArray) -> bool:
    """Not by rounding: against the size of the products in the same row and the same column."""
    if not left.size:
        return False
    scale = np.minimum(size.max(axis=1, keepdims=True), size.max(axis=0, keepdims=True))
    return bool(np.any(np.abs(left - right) > EXACT * scale))
