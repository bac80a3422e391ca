"""Judged claims about single runs as a table and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from estimfw.report.numbers import UNKNOWN, plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.claim_file import Part
from estimfw.run.claims import JudgedClaim, JudgedPart

__all__ = ["TONES", "claims_json", "part_table", "verdict_table"]

TONES = {"holds": "good", "holds partly": "warn", "does not hold": "bad"}


def verdict_table(judged: Sequence[JudgedClaim]) -> Table:
    """A line for each claim: the claim, its verdict, how many of its parts hold."""
    rows = tuple(
        (
            Cell(one.claim.text),
            Cell(one.verdict, TONES[one.verdict]),
            Cell(f"{sum(p.holds for p in one.parts)} of {len(one.parts)}"),
        )
        for one in judged
    )
    return Table(("claim", "verdict", "parts that hold"), rows)


def part_table(one: JudgedClaim) -> Table:
    """The parts of a claim: figure, bounds, verdict, and what the figure is of."""
    rows = tuple(_row(part) for part in one.parts)
    return Table(("", "figure", "claimed", "verdict", "figure of"), rows, frozenset({1}))


def claims_json(judged: Sequence[JudgedClaim]) -> list[dict[str, Any]]:
    """Each claim with its verdict and its parts; a figure that is not finite is None."""
    return [
        {
            "text": one.claim.text,
            "verdict": one.verdict,
            "parts": [
                {
                    "text": part.part.text,
                    "figure": part.figure if math.isfinite(part.figure) else None,
                    "unit": part.unit,
                    "above": part.part.above,
                    "below": part.part.below,
                    "holds": part.holds,
                }
                for part in one.parts
            ],
        }
        for one in judged
    ]


def _row(one: JudgedPart) -> tuple[Cell, ...]:
    part = one.part
    bounds = [f"{word} {plain(x)}" for word, x in (("above", part.above), ("below", part.below)) if x is not None]
    verdict = "holds" if one.holds else "does not hold"
    return (
        Cell(part.text), Cell(_figure(one)), Cell(" and ".join(bounds)), Cell(verdict, TONES[verdict]), Cell(_of(part)),
    )  # fmt: skip


def _figure(one: JudgedPart) -> str:
    if not math.isfinite(one.figure):
        return UNKNOWN
    counted = one.part.statistic in ("turns", "undetermined")
    return f"{plain(one.figure) if counted else significant(one.figure, 4)} {one.unit}".strip()


def _of(part: Part) -> str:
    """What the figure is, in words: ``σ of gyro_bias[E], 4 h over 0 s: constants``."""
    if part.statistic == "undetermined":
        return f"undetermined combinations: {part.of[0]}"
    what = {
        "sigma": "σ", "honest_sigma": "honest σ", "overconfidence": "honest σ / own σ", "error": "error",
        "exponent": "exponent of the growth of σ", "turns": "turns of σ",
    }[part.statistic]  # fmt: skip
    end = _time(part.at) if part.at is not None else "the end"
    if part.since is None:
        when = end
    elif part.statistic in ("exponent", "turns"):
        when = f"{_time(part.since)} to {end}"
    else:
        when = f"{end} over {_time(part.since)}"
    return f"{what} of {part.quantity}, {when}: {' over '.join(part.of)}"


def _time(seconds: float) -> str:
    """In h where that is short."""
    hours = seconds / 3600.0
    return (
        f"{plain(hours)} h" if seconds >= 3600.0 and abs(hours * 2 - round(hours * 2)) < 1e-9 else f"{plain(seconds)} s"
    )
