"""Derived variables: their values, and what becomes of them where a policy holds what they are made of.

A coefficient that reads a derived variable shall see the held values too, while outputs and innovations go on with what the
provider really computed. So a held variable does not change its derived ones: it makes twins of them for the coefficients, a
number where nothing is left to vary, else a variable ``fixed.<name>`` of what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimfw.errors import PluginError
from estimfw.model.coefficient import Coefficient, constant
from estimfw.model.polynomial import Factor, Polynomial, canonical

__all__ = ["CompiledFunction", "DerivedVariable", "HeldArgument", "derived_value", "held_variables"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CompiledFunction:
    """Where the numba twin of a derived variable's function lives, so that generated code can call it inside the scan.

    ``module`` is importable and stands alone (code cached for it is made anew when its text changes, not when that of what it
    imports does). ``name`` is an ``@njit(cache=True)`` function of one flat float64 array (C order) for each of ``needs``, in
    their order, and a last one for the value, in which it writes: ``range_to(position, beacon, out)``.
    """

    module: str
    name: str


@dataclass(frozen=True, slots=True)
class HeldArgument:
    """An argument of a derived variable's function that is not read from the nominal but held.

    ``value`` (size, 1) lists its scalars (C order): numbers, or other scalars of the nominal.
    """

    name: str
    shape: tuple[int, ...]
    value: Coefficient

    @classmethod
    def of(cls, name: str, numbers: ArrayLike) -> HeldArgument:
        """A setting as an argument: the place of a beacon, a table of a calibration."""
        array = np.asarray(numbers, dtype=float)
        return cls(name, array.shape, constant(array.reshape(-1, 1)))

    def substituted(self, known: Mapping[Factor, Polynomial]) -> HeldArgument:
        return replace(self, value=self.value.substitute(dict(known)))

    def evaluate(self, values: Mapping[str, ArrayLike], leading: tuple[int, ...]) -> FloatArray:
        """The argument (..., *shape)."""
        scalars = self.value.evaluate(values)[..., 0]
        return np.broadcast_to(scalars, (*leading, scalars.shape[-1])).reshape((*leading, *self.shape))


@dataclass(frozen=True, slots=True)
class DerivedVariable:
    """A variable computed from others by a plugin's module-level function on arrays with leading axes.

    ``function(**{name: array for name in needs}) -> array`` of ``shape`` behind the leading axes. ``held`` are those of
    ``needs`` that are settings (`HeldArgument.of`), or that a policy holds. Without ``compiled``, a numba twin that gives the
    same value, a filter that needs the variable in its loop runs in NumPy, which is slower, and says so.
    """

    name: str
    shape: tuple[int, ...]
    needs: tuple[str, ...]
    function: Callable[..., Any]
    unit: str = ""
    latex: str = ""
    held: tuple[HeldArgument, ...] = ()
    compiled: CompiledFunction | None = None

    @property
    def reads(self) -> tuple[str, ...]:
        """Variables of the nominal that its value depends on."""
        inside = {held.name: sorted(held.value.needs) for held in self.held}
        return tuple(dict.fromkeys(name for need in self.needs for name in inside.get(need, [need])))


def derived_value(d: DerivedVariable, values: Mapping[str, ArrayLike], leading: tuple[int, ...]) -> FloatArray:
    """The variable (..., *shape).

    Raises
    ------
    PluginError
        The plugin's function fails, or makes another shape, or NaN of numbers.
    """
    held = {h.name: h.evaluate(values, leading) for h in d.held}
    needed = {need: held[need] if need in held else np.asarray(values[need], dtype=float) for need in d.needs}
    what = f"the derived variable {d.name!r} ({d.function.__module__}.{d.function.__qualname__})"
    try:
        value = np.asarray(d.function(**needed), dtype=float)
    except Exception as cause:
        raise PluginError(f"{what} raised {type(cause).__name__}: {cause}") from cause
    if value.shape != (*leading, *d.shape):
        hint = "arrays come with leading axes (epochs, runs), the value needs them too"
        raise PluginError(f"{what} has the shape {value.shape}, {(*leading, *d.shape)} is due", hint=hint)
    if not np.all(np.isfinite(value)) and all(np.all(np.isfinite(v)) for v in needed.values()):
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(value))[0])
        raise PluginError(f"{what} is {value[at]}", hint=f"at {list(at)}, for {needed}"[:300] if at else None)
    return value


def held_variables(
    derived: Iterable[DerivedVariable], fixed: Mapping[Factor, Polynomial]
) -> tuple[dict[Factor, Polynomial], tuple[DerivedVariable, ...]]:
    """What stands for the scalars of derived variables in coefficients, and the twins that this needs.

    Parameters
    ----------
    derived : iterable of DerivedVariable
        In an order in which each needs earlier ones only.
    fixed : mapping of factor to polynomial
        All scalars of the variables that are held.
    """
    known: dict[Factor, Polynomial] = dict(fixed)
    twins: list[DerivedVariable] = []
    for d in derived:
        names, settings = {name for name, _ in known}, {h.name for h in d.held}
        own = tuple(h.substituted(known) for h in d.held)
        held = (*own, *(_held(need, known) for need in d.needs if need in names - settings))
        if held == d.held or d.name in names:
            continue
        twin = replace(d, name=f"fixed.{d.name}", latex="", held=held)
        if twin.reads:
            twins.append(twin)
            known |= {(d.name, i): ((1.0, ((twin.name, i),)),) for i in np.ndindex(*d.shape)}
        else:
            value = derived_value(twin, {}, ())
            known |= {(d.name, i): canonical([(float(value[i]), ())]) for i in np.ndindex(*d.shape)}
    return {factor: p for factor, p in known.items() if factor not in fixed}, tuple(twins)


def _held(name: str, known: Mapping[Factor, Polynomial]) -> HeldArgument:
    own = sorted((index, p) for (variable, index), p in known.items() if variable == name)
    shape = tuple(int(n) + 1 for n in own[-1][0])
    return HeldArgument(name, shape, Coefficient((len(own), 1), tuple((i, 0, p) for i, (_, p) in enumerate(own) if p)))
