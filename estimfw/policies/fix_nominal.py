"""Hold a nominal variable at a constant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimfw.errors import ConfigError
from estimfw.model.model import Model
from estimfw.model.polynomial import Factor, Polynomial, canonical, substitute
from estimfw.policies.change import Change, FloatArray, Measure, compare
from estimfw.spelling import did_you_mean

__all__ = ["FixNominal"]


@dataclass(frozen=True, slots=True)
class FixNominal:
    """Put numbers, or other scalar variables by name, for a variable in every coefficient of the model.

    An approximation of the error model alone: the provider goes on as it was.

    Attributes
    ----------
    variable : str
    values : tuple of float or str
        Row by row; a name such as ``gravity`` stands for that scalar variable.
    """

    variable: str
    values: tuple[float | str, ...]

    @property
    def label(self) -> str:
        return f"fix_nominal {self.variable} = [{', '.join(str(v) for v in self.values)}]"

    def apply(self, model: Model, reference: Mapping[str, FloatArray]) -> tuple[Model, Change]:
        if self.variable not in reference:
            raise ConfigError(
                f"there is no nominal variable {self.variable!r}", hint=did_you_mean(self.variable, reference)
            )
        shape = np.shape(reference[self.variable])
        if len(self.values) != int(np.prod(shape, dtype=int)):
            raise ConfigError(f"{self.variable} has shape {shape}, {len(self.values)} values were given")
        for value in self.values:
            if isinstance(value, str) and np.shape(reference.get(value, np.zeros(2))) != ():
                raise ConfigError(
                    f"{value!r} is no scalar variable of the nominal", hint=did_you_mean(value, reference)
                )
        fixed = tuple(
            ((self.variable, tuple(int(i) for i in index)), _polynomial(value))
            for index, value in zip(np.ndindex(*shape), self.values, strict=True)
        )
        known = {factor: p for factor, p in model.fixed if factor[0] != self.variable}
        own = {factor: substitute(p, known) for factor, p in fixed}
        after = model.with_parts(fixed=tuple({**{f: substitute(p, own) for f, p in known.items()}, **own}.items()))
        return after, self._change(model, after, reference)

    def _change(self, model: Model, after: Model, reference: Mapping[str, FloatArray]) -> Change:
        numbers = [float(reference[v]) if isinstance(v, str) else v for v in self.values]
        away = float(np.max(np.abs(np.ravel(reference[self.variable]) - numbers)))
        measure = Measure(f"largest difference from the reference nominal's {self.variable}", away, "SI")
        return compare(
            self.label, "approximate", model, after, f"{self.variable} stays at that value", measures=(measure,)
        )


def _polynomial(value: float | str) -> Polynomial:
    factors: tuple[Factor, ...] = ((value, ()),) if isinstance(value, str) else ()
    return canonical([(1.0 if isinstance(value, str) else float(value), factors)])
