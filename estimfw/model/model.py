"""The model: parts by name, and the labelled matrices that they assemble to.

``x' = F x + G w + B u``, ``z = H x + v``. A model is immutable; policies make new ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.coefficient import Coefficient, constant, zeros
from estimfw.model.derived import DerivedVariable, derived_value, held_variables
from estimfw.model.frame import Frame, between_frames, rotation
from estimfw.model.parts import (
    KnownInput,
    Measurement,
    NoiseInput,
    Output,
    ProcessTerm,
    StateBlock,
)
from estimfw.model.polynomial import Factor, Polynomial
from estimfw.model.prior import Prior
from estimfw.model.quotient import Quotient
from estimfw.model.structure import Structure
from estimfw.spelling import did_you_mean

__all__ = ["LabelledMatrix", "Model", "Source", "Structure"]

FloatArray = NDArray[np.float64]
Source = StateBlock | NoiseInput | KnownInput
Part = TypeVar("Part", StateBlock, Measurement, Source)


@dataclass(frozen=True, slots=True)
class LabelledMatrix:
    """A coefficient with the names of its rows and columns."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    coefficient: Coefficient


@dataclass(frozen=True)
class Model:
    """A filter as data.

    Attributes
    ----------
    frames, blocks, terms, noises, inputs, measurements, outputs, derived : tuples of parts
    prior : Prior
    fixed : tuple of (factor, polynomial)
        Nominal scalars that a policy holds at constants.
    quotient : Quotient or None
        What the states stand for, where they are combinations of those of another model.
    """

    frames: tuple[Frame, ...]
    blocks: tuple[StateBlock, ...]
    terms: tuple[ProcessTerm, ...]
    noises: tuple[NoiseInput, ...]
    inputs: tuple[KnownInput, ...]
    measurements: tuple[Measurement, ...]
    prior: Prior
    outputs: tuple[Output, ...] = ()
    derived: tuple[DerivedVariable, ...] = ()
    fixed: tuple[tuple[Factor, Polynomial], ...] = ()
    quotient: Quotient | None = None

    # -- names ---------------------------------------------------------------------------------------------------

    @cached_property
    def states(self) -> tuple[str, ...]:
        """State labels in order."""
        return tuple(label for block in self.blocks for label in block.labels)

    @property
    def state_meanings(self) -> tuple[str, ...]:
        """What each state stands for, see `Quotient`; its label where it is what its name says."""
        return self.quotient.meanings if self.quotient is not None else self.states

    @cached_property
    def offsets(self) -> Mapping[str, int]:
        """Position of each block's first state."""
        result, position = {}, 0
        for block in self.blocks:
            result[block.name] = position
            position += len(block.axes)
        return result

    @cached_property
    def frame_map(self) -> Mapping[str, Frame]:
        return {f.name: f for f in self.frames}

    def block(self, name: str) -> StateBlock:
        """The block of that name; ConfigError with the nearest names."""
        return _find(self.blocks, name, "block")

    def measurement(self, name: str) -> Measurement:
        return _find(self.measurements, name, "measurement")

    def term(self, label: str) -> ProcessTerm:
        """The process term of that label, else of that alias; ConfigError with the nearest labels."""
        own = [t for t in self.terms if t.label == label] or [t for t in self.terms if label in t.aliases]
        if own:
            return own[0]
        hint = did_you_mean(label, (t.label for t in self.terms))
        raise ConfigError(f"the model has no process term {label!r}", hint=hint)

    def source(self, name: str) -> Source:
        """The block, noise input or known input of that name."""
        sources: tuple[Source, ...] = (*self.blocks, *self.noises, *self.inputs)
        return _find(sources, name, "block, noise or input")

    @property
    def structure(self) -> Structure:
        """A renamed term lives under its aliases too: a provider may still mirror it by an old one."""
        live = (t for t in self.terms if not self.term_matrix(t).is_zero)
        return Structure(
            frozenset(name for t in live for name in (t.label, *t.aliases)),
            frozenset((b.quantity, a) for b in self.blocks if b.quantity for a in b.axes),
        )

    # -- held variables ------------------------------------------------------------------------------------------

    @cached_property
    def _held(self) -> tuple[dict[Factor, Polynomial], tuple[DerivedVariable, ...]]:
        return held_variables(self.derived, dict(self.fixed))

    @property
    def _substitution(self) -> dict[Factor, Polynomial]:
        """What stands for the held scalars of the nominal in coefficients, derived ones included."""
        return {**dict(self.fixed), **self._held[0]}

    @cached_property
    def held(self) -> tuple[DerivedVariable, ...]:
        """Derived variables of held ones (``fixed.<name>``) that coefficients need, see `estimfw.model.derived`."""
        needed: set[str] = set(self.needs | self.G.coefficient.needs)
        kept: list[DerivedVariable] = []
        for twin in reversed(self._held[1]):
            if twin.name in needed:
                needed |= set(twin.reads)
                kept.append(twin)
        return tuple(reversed(kept))

    def nominal(self, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """A nominal (without leading axes) with what this model's coefficients need besides: `held`."""
        complete = dict(values)
        for twin in self.held:
            if all(name in complete for name in twin.reads):
                complete[twin.name] = derived_value(twin, complete, ())
        return complete

    # -- assembly ------------------------------------------------------------------------------------------------

    def term_matrix(self, term: ProcessTerm) -> Coefficient:
        """The term's coefficient between living axes, rotations inserted, fixed variables put in."""
        target, source = self.block(term.target), self.source(term.source)
        return self.whole_term(term).select(list(target.live), list(source.live)).substitute(self._substitution)

    def whole_term(self, term: ProcessTerm) -> Coefficient:
        """The term's coefficient between all axes of target and source, in the frames in which they live."""
        target, source = self.block(term.target), self.source(term.source)
        source_frame = self.noise_frame(source) if isinstance(source, NoiseInput) else None
        if isinstance(source, StateBlock):
            source_frame = source.frame
        return between_frames(term.coefficient, self._acting(term), target.frame, source_frame, self.frame_map)

    def _acting(self, term: ProcessTerm) -> str | None:
        """The frame in which a term's coefficient is written: its own, else the one its target (or source) was declared in."""
        return term.frame or self.block(term.target).declared_frame or self.source(term.source).declared_frame

    def noise_frame(self, noise: NoiseInput) -> str | None:
        """The frame in which a noise is written: an isotropic triad goes where its terms meet it, without a rotation."""
        if noise.frame is None or not noise.is_isotropic_triad:
            return noise.frame
        meet = {
            self.block(t.target).frame if t.coefficient.isotropic else self._acting(t)
            for t in self.terms
            if t.source == noise.name
        }
        return meet.pop() if len(meet) == 1 and None not in meet else noise.frame

    def settled(self, noise: NoiseInput) -> NoiseInput:
        """The noise written in the frame of `noise_frame`, with that frame's axes."""
        frame = self.noise_frame(noise)
        if frame is None or frame == noise.frame:
            return noise
        axes = self.frame_map[frame].axes
        return replace(noise, frame=frame, all_axes=axes, axes=axes)

    @cached_property
    def F(self) -> LabelledMatrix:
        """Dynamics, (states, states)."""
        n = len(self.states)
        names = {b.name for b in self.blocks}
        total = self._assemble((n, n), (t for t in self.terms if t.source in names), self.offsets)
        return LabelledMatrix(self.states, self.states, total)

    @cached_property
    def G(self) -> LabelledMatrix:
        """Noise coupling, (states, noise inputs)."""
        labels = tuple(label for noise in self.noises for label in self.settled(noise).labels)
        return self._inputs_matrix(self.noises, labels)

    @cached_property
    def B(self) -> LabelledMatrix:
        """Known-input coupling, (states, inputs)."""
        labels = tuple(label for known in self.inputs for label in known.labels)
        return self._inputs_matrix(self.inputs, labels)

    def _inputs_matrix(self, sources: Iterable[NoiseInput | KnownInput], labels: tuple[str, ...]) -> LabelledMatrix:
        columns, position = {}, 0
        for source in sources:
            columns[source.name] = position
            position += len(source.axes)
        shape = (len(self.states), len(labels))
        total = self._assemble(shape, (t for t in self.terms if t.source in columns), columns)
        return LabelledMatrix(self.states, labels, total)

    def _assemble(
        self, shape: tuple[int, int], terms: Iterable[ProcessTerm], columns: Mapping[str, int]
    ) -> Coefficient:
        total = zeros(*shape)
        for term in terms:
            total = total + self.term_matrix(term).embed(shape, self.offsets[term.target], columns[term.source])
        return total

    @cached_property
    def Q(self) -> FloatArray:
        """PSD of the noise inputs, (noise inputs, noise inputs), SI^2 s."""
        return np.diag([psd for noise in self.noises for psd in noise.living_psd])

    @cached_property
    def diffusion(self) -> Coefficient:
        """G Q G^T, (states, states): what decides whether the noise depends on the nominal."""
        g = self.G.coefficient
        return (
            g @ constant(self.Q.reshape(g.shape[1], g.shape[1])) @ g.T
            if g.shape[1]
            else zeros(*self.F.coefficient.shape)
        )

    def H(self, name: str) -> LabelledMatrix:
        """Design matrix of one measurement, (rows, states)."""
        m = self.measurement(name)
        shape = (len(m.rows), len(self.states))
        total = zeros(*shape)
        for term in m.terms:
            block = self.block(term.block)
            full = between_frames(
                term.coefficient, m.frame or block.declared_frame, m.frame, block.frame, self.frame_map
            )
            part = full.select(list(m.live), list(block.live)).substitute(self._substitution)
            total = total + part.embed(shape, 0, self.offsets[block.name])
        return LabelledMatrix(m.labels, self.states, total)

    def innovation(self, name: str) -> Coefficient:
        """The nominal's part of the innovation, (rows, 1)."""
        m = self.measurement(name)
        return m.innovation.select(list(m.live), [0]) if m.innovation else zeros(len(m.rows), 1)

    def R(self, name: str) -> FloatArray:
        """Noise of one measurement, (rows, rows); its kind is ``measurement(name).noise``."""
        m = self.measurement(name)
        full = np.array(m.covariance).reshape(len(m.all_rows), -1)
        return full[np.ix_(m.live, m.live)]

    def jacobian(self, output: Output) -> Coefficient:
        """d(output)/d(states), (components, states), over nominal and derived variables."""
        shape = (len(output.components), len(self.states))
        total = zeros(*shape)
        for name, coefficient, frame in output.jacobian:
            if name not in self.offsets:
                continue
            block = self.block(name)
            full = coefficient
            if frame is not None and block.frame is not None and frame != block.frame:
                full = coefficient @ rotation(block.frame, frame, self.frame_map)
            part = full.select(list(range(shape[0])), list(block.live))
            total = total + part.embed(shape, 0, self.offsets[name])
        return total

    @property
    def needs(self) -> frozenset[str]:
        """Nominal variables (derived ones included) that the dynamics and the measurements need."""
        live = self.F.coefficient.needs | self.diffusion.needs | self.B.coefficient.needs
        for m in self.measurements:
            live |= self.H(m.name).coefficient.needs
        return live

    def with_parts(self, **changes: Any) -> Model:
        """A copy with some parts replaced."""
        return replace(self, **changes)


def _find(items: Iterable[Part], name: str, what: str) -> Part:
    known = {item.name: item for item in items}
    if name not in known:
        raise ConfigError(f"the model has no {what} {name!r}", hint=did_you_mean(name, known))
    return known[name]
