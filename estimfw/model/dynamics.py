"""What moves a model: state blocks, the noise and known inputs that drive them, and the terms that couple them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from estimfw.model.coefficient import Coefficient
from estimfw.model.frame import Frame

__all__ = ["KnownInput", "NoiseInput", "ProcessTerm", "StateBlock", "axis_labels"]


def axis_labels(name: str, axes: tuple[str, ...]) -> tuple[str, ...]:
    """``name[axis]``, or ``name`` alone for an axis without a name."""
    return tuple(f"{name}[{axis}]" if axis else name for axis in axes)


@dataclass(frozen=True, slots=True)
class StateBlock:
    """A named group of states.

    Attributes
    ----------
    name : str
        From the config; state labels are ``name[axis]``.
    all_axes : tuple of str
        Axes of the frame, or the block's own names; ``("",)`` for a single state.
    axes : tuple of str
        Those that live.
    unit, display_unit : str
        SI, and what people read (``deg/h``).
    frame : str or None
    home_frame : str or None
        The frame it was declared in (its truth is known there).
    quantity : str
        The physical quantity whose error it is (``velocity``, ``attitude``, ``position``), by which a provider
        knows what to correct; ``""`` where none does.
    latex : str
        Symbol.
    truth : str
        Name of the truth value (in ``home_frame``) that the state should equal; ``""`` if it is an error of the
        nominal, see ``truth_error``.
    truth_error : callable or None
        ``truth_error(nominal, truth) -> (..., axes)``, a module-level function: the true error of the nominal.
    """

    name: str
    all_axes: tuple[str, ...]
    axes: tuple[str, ...]
    unit: str
    display_unit: str = ""
    frame: str | None = None
    home_frame: str | None = None
    quantity: str = ""
    latex: str = ""
    truth: str = ""
    truth_error: Callable[..., Any] | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        return axis_labels(self.name, self.axes)

    @property
    def live(self) -> tuple[int, ...]:
        """Positions of the living axes among all axes."""
        return tuple(self.all_axes.index(a) for a in self.axes)

    @property
    def declared_frame(self) -> str | None:
        """The frame in which coefficients that name none are written."""
        return self.home_frame or self.frame

    def in_frame(self, frame: Frame) -> StateBlock:
        """The full triad in another frame."""
        return replace(self, frame=frame.name, home_frame=self.declared_frame, all_axes=frame.axes, axes=frame.axes)


@dataclass(frozen=True, slots=True)
class NoiseInput:
    """A white source: ``psd`` (SI^2 s) per axis, in its frame; axes that drive nothing are gone."""

    name: str
    all_axes: tuple[str, ...]
    axes: tuple[str, ...]
    psd: tuple[float, ...]
    unit: str
    frame: str | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        return axis_labels(self.name, self.axes)

    @property
    def live(self) -> tuple[int, ...]:
        return tuple(self.all_axes.index(a) for a in self.axes)

    @property
    def living_psd(self) -> tuple[float, ...]:
        return tuple(self.psd[i] for i in self.live)

    @property
    def declared_frame(self) -> str | None:
        return self.frame

    @property
    def is_isotropic_triad(self) -> bool:
        """A full triad with one PSD: a rotation does not change it."""
        return len(self.axes) == len(self.all_axes) == 3 and len(set(self.psd)) == 1


@dataclass(frozen=True, slots=True)
class KnownInput:
    """A source with known values: constant over steps of a schedule, or the last reading of a stream.

    ``times`` (s) are the instants from which ``values`` (one row an instant, SI) hold; before the first the input is zero.
    Readings belong to a record: of an input that is measured stand here the ``stream`` and its ``columns``, one an axis.
    """

    name: str
    axes: tuple[str, ...]
    unit: str
    times: tuple[float, ...] = ()
    values: tuple[tuple[float, ...], ...] = ()
    stream: str | None = None
    columns: tuple[str, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        return axis_labels(self.name, self.axes)

    @property
    def live(self) -> tuple[int, ...]:
        return tuple(range(len(self.axes)))

    @property
    def declared_frame(self) -> None:
        """Its values are numbers: no frame turns them."""
        return None


@dataclass(frozen=True, slots=True)
class ProcessTerm:
    """d(target)/dt += coefficient @ source, both taken to ``frame``.

    Attributes
    ----------
    label : str
        What policies name: ``coriolis``.
    target : str
        A block.
    source : str
        A block, a noise input or a known input.
    coefficient : Coefficient
        (all axes of target, all axes of source), acting in ``frame``.
    frame : str or None
        None: the frame that the target was declared in, if it has one, else the source's.
    text : str
        What it is, for people, with its source (paper, equation).
    aliases : tuple of str
        Former labels.
    """

    label: str
    target: str
    source: str
    coefficient: Coefficient
    frame: str | None = None
    text: str = ""
    aliases: tuple[str, ...] = ()
