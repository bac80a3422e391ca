"""From parts to a model, with the checks that only the whole allows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from estimfw.errors import ConfigError
from estimfw.model.coefficient import identity
from estimfw.model.frame import Frame
from estimfw.model.model import Model, Source
from estimfw.model.parts import BlockParts, DerivedVariable, KnownInput, Measurement, Output, ProcessParts, StateBlock
from estimfw.model.prior import Prior, check_covariance
from estimfw.spelling import did_you_mean

__all__ = ["build_model"]


def build_model(
    blocks: Sequence[BlockParts],
    process: Sequence[ProcessParts] = (),
    measurements: Sequence[Measurement] = (),
    inputs: Sequence[KnownInput] = (),
    correlations: Mapping[tuple[str, str], float] | None = None,
    outputs: Sequence[Output] = (),
) -> Model:
    """Compose parts.

    Parameters
    ----------
    blocks, process, measurements, inputs
        Parts, in the order in which their states and labels are to stand.
    correlations : mapping of (state label, state label) to float
        Correlation coefficients of the prior across states, -1 to 1.
    outputs : sequence of Output
        Besides those of the blocks.

    Raises
    ------
    ConfigError
        Two parts with one name, terms that name what is not there, wrong shapes, or a prior that is no covariance.
    """
    terms = [t for b in blocks for t in b.terms] + [t for p in process for t in p.terms]
    noises = [n for b in blocks for n in b.noises] + [n for p in process for n in p.noises]
    frames = _unique_frames([f for b in blocks for f in b.frames] + [f for p in process for f in p.frames])
    derived = _unique_derived(
        [d for b in blocks for d in b.derived]
        + [d for p in process for d in p.derived]
        + [d for m in measurements for d in m.derived]
    )
    sources = [b.block.name for b in blocks] + [n.name for n in noises] + [k.name for k in inputs]
    _refuse_twice(sources, "block, noise or input")
    _refuse_twice([t.label for t in terms], "process term")
    _refuse_twice([m.name for m in measurements], "measurement")
    _refuse_twice([label for b in blocks for label in b.block.labels], "state")
    model = Model(
        frames=frames,
        blocks=tuple(b.block for b in blocks),
        terms=tuple(terms),
        noises=tuple(noises),
        inputs=tuple(inputs),
        measurements=tuple(measurements),
        prior=_prior(blocks, correlations or {}),
        outputs=(*(o for b in blocks for o in b.outputs), *outputs),
        derived=derived,
    )
    _check_frames(model)
    _check_shapes(model)
    _refuse_without_frame(model)
    return model


def _refuse_twice(names: Iterable[str], what: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise ConfigError(f"{count} times a {what} {name!r}", hint="give each its own name")


def _unique_frames(frames: Iterable[Frame]) -> tuple[Frame, ...]:
    known: dict[str, Frame] = {}
    for frame in frames:
        if known.setdefault(frame.name, frame) != frame:
            raise ConfigError(
                f"frame {frame.name!r} is defined twice, differently", hint=f"{known[frame.name]} and {frame}"
            )
    return tuple(known.values())


def _unique_derived(derived: Iterable[DerivedVariable]) -> tuple[DerivedVariable, ...]:
    """Each once, as several measurements may bring the same."""
    known: dict[str, DerivedVariable] = {}
    for variable in derived:
        if known.setdefault(variable.name, variable) != variable:
            raise ConfigError(
                f"the derived variable {variable.name!r} is defined twice, differently",
                hint="two parts brought it: give each its own name, such as that of the measurement before it",
            )
    return tuple(known.values())


def _prior(blocks: Sequence[BlockParts], correlations: Mapping[tuple[str, str], float]) -> Prior:
    labels = [label for b in blocks for label in b.block.labels]
    n = len(labels)
    covariance, at = np.zeros((n, n)), 0
    for b in blocks:
        size, live = len(b.block.axes), list(b.block.live)
        every = len(b.block.all_axes)
        covariance[at : at + size, at : at + size] = np.array(b.covariance).reshape(every, every)[np.ix_(live, live)]
        at += size
    for (first, second), value in correlations.items():
        for label in (first, second):
            if label not in labels:
                raise ConfigError(f"prior.correlations names the state {label!r}, which is not there")
        i, j = labels.index(first), labels.index(second)
        covariance[i, j] = covariance[j, i] = value * np.sqrt(covariance[i, i] * covariance[j, j])
    check_covariance(covariance, labels)
    mean = tuple(b.mean[i] for b in blocks for i in b.block.live)
    return Prior(mean, tuple(tuple(float(x) for x in row) for row in covariance), identity(n))


def _check_frames(model: Model) -> None:
    """Every frame that a part names is there, so that rotations can be found when a policy asks for them."""
    named = [(f"frame {f.name!r}", f.parent) for f in model.frames]
    named += [(f"block {b.name!r}", b.frame) for b in model.blocks]
    named += [(f"noise {n.name!r}", n.frame) for n in model.noises]
    named += [(f"term {t.label!r}", t.frame) for t in model.terms]
    named += [(f"measurement {m.name!r}", m.frame) for m in model.measurements]
    for what, frame in named:
        if frame is not None and frame not in model.frame_map:
            raise ConfigError(
                f"{what} names the frame {frame!r}, which is not there", hint=did_you_mean(frame, model.frame_map)
            )


def _check_shapes(model: Model) -> None:
    for term in model.terms:
        target, source = model.block(term.target), model.source(term.source)
        width = len(source.axes) if isinstance(source, KnownInput) else len(source.all_axes)
        if term.coefficient.shape != (len(target.all_axes), width):
            raise ConfigError(
                f"term {term.label!r}: its coefficient is {_size(term.coefficient.shape)}, "
                f"but {term.source} -> {term.target} needs {_size((len(target.all_axes), width))}"
            )
    for m in model.measurements:
        for part in m.terms:
            wanted = (len(m.all_rows), len(model.block(part.block).all_axes))
            if part.coefficient.shape != wanted:
                raise ConfigError(
                    f"measurement {m.name!r}: its coefficient of {part.block} is {_size(part.coefficient.shape)}, "
                    f"it needs {_size(wanted)}"
                )


def _refuse_without_frame(model: Model) -> None:
    """A triad without a frame would be read as one of the frame in which the coefficient acts: nobody said so."""
    for term in model.terms:
        if term.frame is not None and term.coefficient.shape == (3, 3):
            for name in (term.target, term.source):
                _refuse_frameless(model, model.source(name), f"term {term.label!r} acts in frame {term.frame!r}")
    for m in model.measurements:
        for part in m.terms:
            if m.frame is not None and part.coefficient.shape == (3, 3):
                _refuse_frameless(model, model.block(part.block), f"measurement {m.name!r} is in frame {m.frame!r}")


def _refuse_frameless(model: Model, triad: Source, why: str) -> None:
    if not isinstance(triad, StateBlock) or triad.frame is not None:
        return
    own = [frame.name for frame in model.frames if frame.axes == triad.all_axes] or [f.name for f in model.frames]
    raise ConfigError(
        f"block {triad.name!r} has no frame, but {why}",
        hint=f"give the block its frame: {' or '.join(f'`frame: {name}`' for name in own)}",
        within=("blocks", triad.name),
    )


def _size(shape: tuple[int, int]) -> str:
    return f"{shape[0]} x {shape[1]}"
