"""What a component built is what its role needs: the right kind of object, right shapes, finite numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from estimfw.model.coefficient import Coefficient
from estimfw.model.parts import BlockParts, KnownInput, Measurement, NoiseInput, ProcessParts
from estimfw.registry.component import Role
from estimfw.registry.contract import broken, wrong_number

__all__ = ["check_made", "check_sizes"]

_METHODS: dict[Role, tuple[tuple[str, ...], ...]] = {
    "policy": (("apply",),),
    "nominal": (("variables", "reference", "start", "bind"),),
    "initial": (("find", "reference"),),
    "source": (("load",), ("load_for",), ("load_wanted",)),
    "preprocess": (("apply",),),
    "monitor": (("inspect",), ("inspect_for",)),
}
_TYPES: dict[Role, type] = {
    "block": BlockParts, "process": ProcessParts, "measurement": Measurement, "input": KnownInput,
}  # fmt: skip


def check_made(role: Role, made: Any, owner: str | None, what: str) -> None:
    """Raise `PluginError` where ``made`` is not what a component of this role hands over.

    Parameters
    ----------
    role : str
    made : object
    owner : str or None
        The plugin that made it.
    what : str
        For people: ``block 'blocks.position'``.
    """
    if role in _METHODS:
        if not any(all(callable(getattr(made, m, None)) for m in methods) for methods in _METHODS[role]):
            wanted = " or ".join(", ".join(f"{m}()" for m in methods) for methods in _METHODS[role])
            raise broken(owner, what, f"is an object of type {type(made).__name__} without {wanted}")
        return
    if role not in _TYPES:
        return
    several = made if role == "block" and isinstance(made, tuple) and made else (made,)
    for one in several:
        if not isinstance(one, _TYPES[role]):
            raise broken(owner, what, f"is of type {type(one).__name__}, {_TYPES[role].__name__} is due")
        for name, values, shape in _numbers(one):
            fault = wrong_number(values, shape)
            if fault is not None:
                raise broken(owner, what, f"is wrong: its {name} {fault}")
        for label, coefficient in _coefficients(one):
            if not all(math.isfinite(c) for _, _, p in coefficient.entries for c, _ in p):
                raise broken(owner, what, f"is wrong: the coefficient of {label} is not finite")


def check_sizes(made: ProcessParts | Measurement, widths: Mapping[str, int], owner: str | None, what: str) -> None:
    """Raise `PluginError` where a coefficient does not fit the blocks and sources (``widths``, axes by name) it couples.

    A name that is not there is left to the model, which tells the nearest.
    """
    sizes: list[tuple[str, tuple[int, int], tuple[int | None, int | None]]]
    if isinstance(made, Measurement):
        sizes = [(p.block, p.coefficient.shape, (len(made.all_rows), widths.get(p.block))) for p in made.terms]
    else:
        sizes = [(t.label, t.coefficient.shape, (widths.get(t.target), widths.get(t.source))) for t in made.terms]
    for label, found, due in sizes:
        if None not in due and found != due:
            text = f"is wrong: the coefficient of {label} is {found[0]} x {found[1]}, {due[0]} x {due[1]} is due"
            raise broken(owner, what, text)


def _coefficients(made: Any) -> Iterator[tuple[str, Coefficient]]:
    if isinstance(made, (BlockParts, ProcessParts)):
        yield from ((t.label, t.coefficient) for t in made.terms)
    if isinstance(made, Measurement):
        yield from ((t.block, t.coefficient) for t in made.terms)
        if made.innovation is not None:
            yield "the innovation", made.innovation


def _numbers(made: Any) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    """Name, numbers and due shape of all that it holds."""
    if isinstance(made, BlockParts):
        n = len(made.block.all_axes)
        yield "mean", made.mean, (n,)
        yield "covariance", made.covariance, (n, n)
    if isinstance(made, (BlockParts, ProcessParts)):
        for noise in made.noises:
            yield from _psd(noise)
    if isinstance(made, Measurement):
        n = len(made.all_rows)
        yield "covariance", made.covariance, (n, n)
    if isinstance(made, KnownInput) and made.stream is None:
        yield "values", made.values, (len(made.times), len(made.axes))


def _psd(noise: NoiseInput) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    yield f"PSD of the noise {noise.name!r}", noise.psd, (len(noise.all_axes),)
