"""What ``estimfw observe`` found, for machines. NaN becomes null."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimfw.analysis.along_record import AlongRecord
from estimfw.analysis.directions import Direction
from estimfw.data.record import FloatArray
from estimfw.run.observe import Observed

__all__ = ["observed_json"]


def observed_json(found: Observed) -> dict[str, Any]:
    """The answer: ``states, rank, spectrum, directions, degrees, removable_sets, chosen``, and what stands beside them.

    ``degrees`` has for each state ``floor`` (what of its prior sigma even perfect knowledge of the observable part leaves),
    and along a record, at each of ``time``, ``posterior`` (sigma over prior sigma) and ``observable_part``.
    """
    spectrum = found.frozen.spectrum
    return {
        "name": found.name,
        "states": list(found.names.states),
        "units": list(found.names.units),
        "prior_sigma": list(found.prior_sigma),
        "time_invariant": found.time_invariant,
        "frozen_at": "the reference nominal",
        "rank": found.frozen.rank,
        "spectrum": {
            "kept": list(spectrum.accepted),
            "rejected": list(spectrum.rejected),
            "tolerance": spectrum.tolerance,
            "smallest_kept": spectrum.smallest_accepted,
            "largest_rejected": spectrum.largest_rejected,
            "gap": _number(spectrum.gap),
            "near_edge": spectrum.near_edge,
        },
        "directions": [_direction(d) for d in found.directions],
        "unseen_rates": list(found.rates),
        "degrees": _degrees(found),
        "removable_sets": [list(found.labels(s)) for s in found.removable.sets],
        "search": {"complete": found.removable.complete, "tried": found.removable.tried},
        "protected": list(found.protected),
        "protected_sets": [list(s) for s in found.hit],
        "chosen": list(found.chosen) if found.chosen is not None else None,
        "record": _record(found, found.record) if found.record is not None else None,
        "record_left_out": found.record_left_out or None,
    }


def _direction(one: Direction) -> dict[str, Any]:
    terms = [{"state": t.state, "coefficient": t.coefficient, "unit": t.unit} for t in one.terms]
    return {"text": one.text, "example": one.example, "terms": terms}


def _degrees(found: Observed) -> dict[str, Any]:
    made: dict[str, Any] = {"floor": dict(zip(found.names.states, _list(found.frozen.degree), strict=True))}
    if found.record is not None:
        degrees = found.record.degrees
        made["time"] = _list(degrees.time)
        for name, values in (("posterior", degrees.posterior), ("observable_part", degrees.observable_part)):
            made[name] = {s: _list(values[:, i]) for i, s in enumerate(found.names.states)}
    return made


def _record(found: Observed, record: AlongRecord) -> dict[str, Any]:
    last = record.segments[-1].gramian
    return {
        "piecewise_rank": record.piecewise.rank,
        "piecewise_sizes": list(record.piecewise.spectrum.accepted),
        "piecewise_rejected": list(record.piecewise.spectrum.rejected),
        "stripped": record.stripped,
        "gramian_rank": last.rank,
        "informed": last.informed,
        "hardly_seen": [_direction(d) for d in found.record_directions],
        "segments": [
            {
                "start": s.start,
                "end": s.end,
                "begins_anew": s.begins_anew,
                "piecewise_rank": s.rank,
                "gramian_rank": s.gramian.rank,
                "informed": s.gramian.informed,
                "singular_values": _list(s.gramian.singular),
                "tolerance": s.gramian.tolerance,
            }
            for s in record.segments
        ],
    }


def _list(values: FloatArray) -> list[float | None]:
    return [_number(v) for v in np.asarray(values).tolist()]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
