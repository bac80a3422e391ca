"""Claims about single runs, judged: each filter of a file of claims runs once, and figures are held against bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from estimfw.config.compose import compose
from estimfw.config.load import load_document
from estimfw.errors import EstimfwError
from estimfw.registry.registry import Registry
from estimfw.run.claim_figure import figure_of, unit_of
from estimfw.run.claim_file import Claim, ClaimFile, Part, StatedFilter
from estimfw.run.dataset import result_dataset
from estimfw.run.run import run_problem

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["JudgedClaim", "JudgedPart", "judge_claims", "run_filters"]


@dataclass(frozen=True, slots=True)
class JudgedPart:
    """A part of a claim, its figure with its unit, and whether it lies within the bounds."""

    part: Part
    figure: float
    unit: str
    holds: bool


@dataclass(frozen=True, slots=True)
class JudgedClaim:
    """A claim and what became of its parts."""

    claim: Claim
    parts: tuple[JudgedPart, ...]

    @property
    def verdict(self) -> str:
        """``holds``, ``holds partly`` or ``does not hold``."""
        held = sum(part.holds for part in self.parts)
        return "holds" if held == len(self.parts) else "holds partly" if held else "does not hold"


def run_filters(
    stated: ClaimFile, folder: Path, registry: Registry, progress: Callable[[int, int], None] | None = None
) -> dict[str, xr.Dataset]:
    """The result of each filter, by its name.

    Parameters
    ----------
    stated : ClaimFile
    folder : Path
        Of the claims, from which the paths of the configs go.
    registry : Registry
    progress : callable, optional
        Called with filters done and filters in all.

    Raises
    ------
    EstimfwError
        Of any kind, which names the filter.
    """
    results = {}
    for done, (name, one) in enumerate(stated.filters.items(), start=1):
        try:
            results[name] = _result(one, stated, folder, registry)
        except EstimfwError as error:
            error.message = f"filter {name}: {error.message}"
            raise
        if progress is not None:
            progress(done, len(stated.filters))
    return results


def judge_claims(stated: ClaimFile, results: Mapping[str, xr.Dataset]) -> tuple[JudgedClaim, ...]:
    """Each claim; UsageError where one asks for what a result does not have."""
    return tuple(JudgedClaim(claim, tuple(_judged(part, results) for part in claim.parts)) for claim in stated.claims)


def _result(one: StatedFilter, stated: ClaimFile, folder: Path, registry: Registry) -> xr.Dataset:
    document = load_document(folder / one.config, (*stated.set, *one.set))
    return result_dataset(run_problem(compose(document, registry)))


def _judged(part: Part, results: Mapping[str, xr.Dataset]) -> JudgedPart:
    figure = figure_of(part, results)
    low, high = (-np.inf if part.above is None else part.above), (np.inf if part.below is None else part.below)
    return JudgedPart(part, figure, unit_of(part, results), bool(low < figure < high))
