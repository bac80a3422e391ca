"""What a component built is what its role needs: the right kind of object, right shapes, finite numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from estimfw.model.parts import BlockParts, KnownInput, Measurement, NoiseInput, ProcessParts
from estimfw.registry.component import Role
from estimfw.registry.contract import broken, wrong_number

__all__ = ["check_made"]

_METHODS: dict[Role, tuple[tuple[str, ...], ...]] = {
    "policy": (("apply",),),
    "nominal": (("variables", "reference", "start", "bind"),),
    "initial": (("find", "reference"),),
    "source": (("load",), ("load_for",)),
    "monitor": (("inspect",),),
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
            raise broken(owner, what, f"is a {type(made).__name__} without {wanted}")
        return
    if role not in _TYPES:
        return
    several = made if role == "block" and isinstance(made, tuple) and made else (made,)
    for one in several:
        if not isinstance(one, _TYPES[role]):
            raise broken(owner, what, f"is a {type(one).__name__}, a {_TYPES[role].__name__} is due")
        for name, values, shape in _numbers(one):
            fault = wrong_number(values, shape)
            if fault is not None:
                raise broken(owner, what, f"is wrong: its {name} {fault}")


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
    if isinstance(made, KnownInput):
        yield "values", made.values, (len(made.times), len(made.axes))


def _psd(noise: NoiseInput) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    yield f"PSD of the noise {noise.name!r}", noise.psd, (len(noise.all_axes),)
