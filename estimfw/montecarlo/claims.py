"""Claims about filters, as data: a figure of a trial against a bound, and the verdict that follows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from estimfw.analysis.rivals import closer, settled
from estimfw.config.load import load_document
from estimfw.config.types import Names, Number, Settings, positive_quantity
from estimfw.config.validate import validate
from estimfw.montecarlo.trial import Trial

__all__ = ["Claim", "Claims", "Verdict", "figure_of", "judge", "read_claims"]


class Claim(Settings):
    """A statement, the figure that it is about, and the bounds between which it holds.

    ``of`` one filter, or two: their ratio (rms, median, settled), or the share of runs in which the first is ``closer``.
    """

    text: Annotated[str, Field(description="the statement, in words")]
    of: Annotated[Names, Field(description="one filter, or two for a ratio", min_length=1, max_length=2)]
    output: Annotated[str, Field(description="such as attitude.yaw")]
    statistic: Annotated[Literal["rms", "median", "closer", "settled"], Field(description="over the runs")] = "rms"
    at: Annotated[float, positive_quantity("s"), Field(description="instant of rms, median, closer")] | None = None
    within: Annotated[Number | None, Field(description="bound of settled, in the unit of the output")] = None
    above: Annotated[Number | None, Field(description="holds where the figure is larger")] = None
    below: Annotated[Number | None, Field(description="holds where the figure is smaller")] = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.above is None and self.below is None:
            raise ValueError("a claim needs above, below, or both")
        if self.statistic == "closer" and len(self.of) != 2:
            raise ValueError("closer compares two filters")
        if (self.within is None) == (self.statistic == "settled"):
            raise ValueError("settled needs within, the others have none")
        return self


class Claims(Settings):
    """A file of claims."""

    claims: Annotated[tuple[Claim, ...], Strict(False), Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a claim: its figure, in the unit of the output or as a plain ratio, and whether it holds."""

    claim: Claim
    figure: float
    unit: str
    holds: bool


def read_claims(path: Path) -> tuple[Claim, ...]:
    """The claims of a file; ConfigError with the place of a fault."""
    document = load_document(path, begins="claims:")
    return validate(Claims, document.data, document, ()).claims


def judge(claims: tuple[Claim, ...], trial: Trial) -> tuple[Verdict, ...]:
    """Compute the figure of each claim, and see whether it holds.

    Raises
    ------
    UsageError
        A claim names a filter, an output or an instant that is not there.
    """
    verdicts = []
    for claim in claims:
        figure = figure_of(claim, trial)
        low, high = (-np.inf if claim.above is None else claim.above), (np.inf if claim.below is None else claim.below)
        unit = (
            ""
            if len(claim.of) == 2
            else "s"
            if claim.statistic == "settled"
            else trial.units[trial.quantity(claim.output)]
        )
        verdicts.append(Verdict(claim, figure, unit, bool(low < figure < high)))
    return tuple(verdicts)


def figure_of(claim: Claim, trial: Trial) -> float:
    """The figure that a claim is about."""
    quantity = trial.quantity(claim.output)
    row = trial.at(claim.at) if claim.at is not None else trial.time.size - 1
    errors = [trial.error[trial.filter(name), :, :, quantity] * trial.scales[quantity] for name in claim.of]
    if claim.statistic == "closer":
        return closer(errors[0][:, row], errors[1][:, row]) / trial.runs
    figures = []
    for error in errors:
        if claim.statistic == "settled":
            figures.append(float(np.median(settled(trial.time, error, float(claim.within or 0.0)))))
        elif claim.statistic == "rms":
            figures.append(float(np.sqrt(np.mean(error[:, row] ** 2))))
        else:
            figures.append(float(np.median(np.abs(error[:, row]))))
    if len(figures) == 1:
        return figures[0]
    return figures[0] / figures[1] if figures[1] else np.inf
