"""Drop states; what is left without states goes with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.model.parts import Measurement, NoiseInput
from estimfw.policies.change import Change, ChangeKind, FloatArray, Measure, compare
from estimfw.spelling import did_you_mean

__all__ = ["DropStates", "without_states"]


@dataclass(frozen=True, slots=True)
class DropStates:
    """Drop states by label (``velocity_error[U]``) or whole blocks by name (``accel_bias``).

    The prior takes the marginal. Measurement rows and noise inputs that are left without states are removed. Exact where no
    coefficient, whatever the nominal, takes a dropped state into one that stays or into a row that stays.
    """

    states: tuple[str, ...]

    @property
    def label(self) -> str:
        return f"drop_states {', '.join(self.states)}"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        gone = expand(model, self.states)
        after = without_states(model, gone)
        lost = np.array([label in set(gone) for label in model.states])
        measures = [_lost_coupling(model, lost, reference)]
        acts = bool(np.any(model.F.coefficient.pattern[np.ix_(~lost, lost)]))
        for m in after.measurements:
            row = _lost_reading(model, m, lost, reference)
            if row is not None:
                measures.append(row)
        kind: ChangeKind = "approximate" if acts or len(measures) > 1 else "exact"
        condition = "the dropped states do not act on those that stay, nor on what is measured of them"
        return after, compare(self.label, kind, model, after, condition, measures=tuple(measures))


def expand(model: Model, names: Sequence[str]) -> tuple[str, ...]:
    """State labels for labels and block names; ConfigError with the nearest for what is neither."""
    result: list[str] = []
    for name in names:
        if name in model.states:
            result.append(name)
        elif name in model.offsets:
            result.extend(model.block(name).labels)
        else:
            hint = did_you_mean(name, [*model.states, *model.offsets])
            raise ConfigError(f"there is no state or block {name!r}", hint=hint)
    return tuple(dict.fromkeys(result))


def without_states(model: Model, gone: Sequence[str]) -> Model:
    """The model without these states, and without what they leave behind."""
    lost = set(gone)
    if not set(model.states) - lost:
        raise ConfigError("no state would be left", hint="drop fewer states")
    kept = [i for i, label in enumerate(model.states) if label not in lost]
    blocks = [
        replace(b, axes=tuple(a for a, s in zip(b.axes, b.labels, strict=True) if s not in lost)) for b in model.blocks
    ]
    blocks = [b for b in blocks if b.axes]
    names = {b.name for b in blocks}
    known = names | {n.name for n in model.noises} | {k.name for k in model.inputs}
    after = model.with_parts(
        blocks=tuple(blocks),
        terms=tuple(t for t in model.terms if t.target in names and t.source in known),
        noises=tuple(model.settled(n) for n in model.noises),
        prior=model.prior.select(kept),
        measurements=tuple(replace(m, terms=tuple(t for t in m.terms if t.block in names)) for m in model.measurements),
        outputs=tuple(o for o in model.outputs if any(name in names for name, _, _ in o.jacobian)),
    )
    return _without_idle(model, after)


def _without_idle(before: Model, after: Model) -> Model:
    """Remove noise axes that drive nothing, measurement rows that read nothing, terms without effect."""
    noises: list[NoiseInput] = []
    driven = np.any(after.G.coefficient.pattern, axis=0).tolist()
    position = 0
    for noise in after.noises:
        live = driven[position : position + len(noise.axes)]
        position += len(noise.axes)
        axes = tuple(a for a, keep in zip(noise.axes, live, strict=True) if keep)
        if axes:
            noises.append(replace(noise, axes=axes))
    measurements = [m for m in (_read_rows(before, after, m) for m in after.measurements) if m.rows]
    idle = {t.label for t in after.terms if after.term_matrix(t).is_zero and not before.term_matrix(t).is_zero}
    known = {n.name for n in noises} | set(after.offsets) | {k.name for k in after.inputs}
    terms = tuple(t for t in after.terms if t.label not in idle and t.source in known)
    if before.measurements and not measurements:
        raise ConfigError("no measurement would be left: none reads a state that stays", hint="keep a measured state")
    return after.with_parts(noises=tuple(noises), measurements=tuple(measurements), terms=terms)


def _read_rows(before: Model, after: Model, m: Measurement) -> Measurement:
    old, new = (np.any(x.H(m.name).coefficient.pattern, axis=1).tolist() for x in (before, after))
    return replace(m, rows=tuple(r for r, was, now in zip(m.rows, old, new, strict=True) if now or not was))


def _lost_reading(
    model: Model, m: Measurement, lost: NDArray[np.bool_], reference: Mapping[str, FloatArray]
) -> Measure | None:
    """How much of a dropped state at 1 sigma the rows that stay read, in sigmas of their noise; None if they read none."""
    before = model.measurement(m.name)
    rows = [before.rows.index(r) for r in m.rows]
    H = model.H(m.name).coefficient.select(rows, [int(i) for i in np.flatnonzero(lost)])
    if H.is_zero:
        return None
    sigma = np.sqrt(np.diag(model.prior.evaluate(reference)[1]))[lost]
    noise = np.sqrt(np.diag(model.R(m.name)))[rows, None]
    worst = float(np.max(np.abs(H.evaluate(model.nominal(reference))) * sigma / np.where(noise > 0.0, noise, 1.0)))
    return Measure(f"reading of a dropped state at 1 sigma by {m.name}, in sigmas of its noise:", worst, "")


def _lost_coupling(model: Model, lost: NDArray[np.bool_], reference: Mapping[str, FloatArray]) -> Measure:
    """The largest rate of a staying state by a dropped one at 1 sigma, against the staying state's own sigma."""
    f = model.F.coefficient.evaluate(model.nominal(reference))
    sigma = np.sqrt(np.diag(model.prior.evaluate(reference)[1]))
    rate = np.abs(f[np.ix_(~lost, lost)]) * sigma[lost]
    own = np.where(sigma[~lost] > 0.0, sigma[~lost], 1.0)[:, None]
    worst = float(np.max(rate / own, initial=0.0))
    return Measure("coupling of a dropped state at 1 sigma into one that stays, in its sigmas:", worst, "1/s")
