"""What ``estimfw observe`` found, as sentences and tables, for the terminal and for the page alike."""

from __future__ import annotations

from estimfw.analysis.observability import Observability
from estimfw.report.numbers import UNKNOWN, plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.observe import Observed
from estimfw.units.unit_text import parse_unit

__all__ = [
    "DIRECTIONS_SHOWN", "chosen_text", "direction_note", "headline", "record_table", "record_texts", "removable_table",
    "spectrum_texts", "state_table",
]  # fmt: skip

KNOWN, UNKNOWN_LEFT = 0.1, 0.99
"""Of the prior sigma: below is well known, above the measurements tell nothing."""

NOTHING = 1e-9
ENDS = 8
SETS_SHOWN, DIRECTIONS_SHOWN = 30, 20


def headline(found: Observed) -> str:
    """The rank in a sentence."""
    states, rank = len(found.names.states), found.frozen.rank
    short = states - rank
    kind = "time-invariant plan" if found.time_invariant else "time-varying plan, frozen at the reference nominal"
    if not short:
        return f"all {states} states are observable ({kind})"
    many = "combinations of states are" if short > 1 else "combination of states is"
    return f"rank {rank} of {states}: {short} {many} not observable ({kind})"


def spectrum_texts(found: Observability) -> list[str]:
    """Kept and rejected values, and how clear the rank is."""
    spectrum = found.spectrum
    lines = [f"kept      {_listed([f'{v:.2g}' for v in spectrum.accepted])}"]
    lines.append(f"rejected  {_listed([f'{v:.1e}' for v in spectrum.rejected])}")
    edge = f"smallest kept {spectrum.smallest_accepted:.2g}, largest rejected {spectrum.largest_rejected:.1g}"
    edge += f", tolerance {spectrum.tolerance:.0e}"
    verdict = "the rank is near the edge: it hangs on the tolerance" if spectrum.near_edge else "the rank is clear"
    return [*lines, f"{edge}: {verdict}"]


def direction_note(found: Observed) -> str:
    """What is not shown of the directions, and how they evolve."""
    growing = [r for r in found.rates if r > 1e-9]
    fading = [r for r in found.rates if r < -1e-12]
    more = len(found.directions) - DIRECTIONS_SHOWN
    told = [f"{more} more: see --json"] if more > 0 else []
    if fading:
        told.append(f"{len(fading)} of them {'decays by itself' if len(fading) == 1 else 'decay by themselves'}")
    if growing:
        told.append(f"{len(growing)} of them {'grows' if len(growing) == 1 else 'grow'}: no measurement stops that")
    return "; ".join(told)


def state_table(found: Observed) -> Table:
    """Prior sigma and degrees of each state."""
    record, partly = found.record, found.frozen.rank < len(found.names.states)
    split = partly or not found.time_invariant
    head = ["state", "prior sigma", *(["floor"] if partly else [])]
    if record is not None:
        head += ["sigma / prior sigma", *(["of its observable part"] if split else []), "with time"]
    rows = []
    for i, state in enumerate(found.names.states):
        cells = [Cell(state), Cell(_sigma(found, i)), *([_degree(float(found.frozen.degree[i]))] if partly else [])]
        if record is not None:
            posterior, part = record.degrees.posterior[:, i], record.degrees.observable_part[:, i]
            cells += [_degree(float(posterior[-1])), *([_degree(float(part[-1]))] if split else [])]
            cells.append(Cell(_sparkline(posterior.tolist())))
        rows.append(tuple(cells))
    numeric = frozenset(range(1, len(head) - (record is not None)))
    return Table(tuple(head), tuple(rows), numeric, _state_note(found, partly=partly, split=split))


def _state_note(found: Observed, *, partly: bool, split: bool) -> str:
    told = ["floor: what of the prior sigma even perfect knowledge of the observable part leaves"] if partly else []
    if found.record is not None and split:
        unseen = "" if found.time_invariant else ", or that the record hardly shows"
        told.append(
            "the others at the end of the record. Small for the observable part, and large for the whole: known but for a "
            f"direction that is not observable{unseen}"
        )
    return "; ".join(told)


def removable_table(found: Observed) -> Table:
    """Sets whose removal leaves an observable rest."""
    rows: list[tuple[Cell, ...]] = []
    for chosen in found.removable.sets[:SETS_SHOWN]:
        names = found.labels(chosen)
        mark = Cell("chosen", "good") if names == found.chosen else Cell("")
        degrees = _each([float(found.frozen.degree[i]) for i in chosen])
        rows.append((Cell(", ".join(names)), Cell(degrees), mark))
    own = set(found.protected)
    for names in found.hit[: max(0, SETS_SHOWN - len(rows))]:
        at = [found.names.states.index(s) for s in names]
        degrees = _each([float(found.frozen.degree[i]) for i in at])
        hit = ", ".join(s for s in names if s in own)
        rows.append((Cell(", ".join(names)), Cell(degrees), Cell(f"protected: {hit}", "warn")))
    missing = len(found.removable.sets) + len(found.hit) - len(rows)
    notes = [f"{missing} more: see --json"] if missing > 0 else []
    tried = [r.tried for r in (found.removable, found.all_removable) if not r.complete]
    if tried:
        notes.append(f"the search was stopped after {max(tried)} candidates: there may be more")
    return Table(("remove", "keep, of the prior sigma", ""), tuple(rows), note="; ".join(notes))


def chosen_text(found: Observed) -> str:
    """Which set goes, and why."""
    guard = f"protected: {', '.join(found.protected)}" if found.protected else "nothing is protected"
    if found.frozen.rank == len(found.names.states):
        return "nothing to remove"
    if not found.frozen.rank:
        return "no measurement tells of any state: nothing would be left"
    if found.chosen is None:
        return f"no set can go without a protected state ({guard})"
    degrees = [float(found.frozen.degree[found.names.states.index(s)]) for s in found.chosen]
    kept = _each(degrees)
    only = len(found.removable.sets) == 1
    why = "the only set" if only else f"of {len(found.removable.sets)} sets the least determined"
    return (
        f"would remove {', '.join(found.chosen)}: {why}; even perfect knowledge of the observable part leaves {kept} of "
        f"their prior sigma. {guard[0].upper()}{guard[1:]}"
    )


def record_table(found: Observed) -> Table:
    """Ranks segment by segment."""
    assert found.record is not None
    head = (
        "from, s",
        "to, s",
        "piecewise rank",
        "Gramian rank",
        "told > prior",
        "smallest kept",
        "largest rejected",
        "",
    )
    rows = tuple(
        (
            Cell(plain(s.start)), Cell(plain(s.end)), Cell(str(s.rank)), Cell(str(s.gramian.rank)),
            Cell(str(s.gramian.informed)), Cell(f"{s.gramian.smallest_kept:.2g}"),
            Cell(f"{s.gramian.largest_rejected:.1g}"), Cell("begins anew" if s.begins_anew and k else ""),
        )
        for k, s in enumerate(found.record.segments)
    )  # fmt: skip
    note = (
        "piecewise: each segment frozen at its mean, with those before it since the start. Gramian: step by step as it was "
        "flown, in units of prior and measurement noise; told > prior: combinations with a singular value above 1"
    )
    return Table(head, rows, frozenset(range(7)), note)


def record_texts(found: Observed) -> list[str]:
    """The singular values of the Gramian, and what they say against the frozen rank."""
    assert found.record is not None
    last = found.record.segments[-1].gramian
    lines = [f"singular values of the Gramian at the end  {_listed([f'{s:.2g}' for s in last.singular])}"]
    if found.record.stripped and found.frozen.rank < len(found.names.states):
        lines.append(
            "what a segment does not see stays as it is: the stripped matrix, without transitions, has the same null space"
        )
    if last.rank > found.frozen.rank:
        lines.append(
            f"along the record {last.rank} combinations move the measurements, more than the {found.frozen.rank} of the frozen "
            f"model, for its coefficients vary (also with the noise of the nominal); {last.informed} are known better by the "
            "measurements than by the prior"
        )
    elif last.informed < last.rank:
        lines.append(
            f"of {last.rank} observable combinations {last.informed} are known better by the measurements than by the prior"
        )
    if found.record_directions:
        hardly = ["hardly seen along the record (the prior sigma shrinks by less than 0.5 %), such as"]
        lines += hardly + [f"  {d.example}" for d in found.record_directions]
    return lines


def _listed(values: list[str]) -> str:
    """All of a few; of many the first and the last."""
    if len(values) <= 2 * ENDS:
        return "  ".join(values) or "none"
    return f"{'  '.join(values[:ENDS])}  ... {len(values)} in all ...  {'  '.join(values[-ENDS:])}"


def _each(degrees: list[float]) -> str:
    if len(degrees) <= ENDS:
        return ", ".join(plain(round(d, 4)) for d in degrees)
    return f"{plain(round(min(degrees), 4))} to {plain(round(max(degrees), 4))}"


def _sigma(found: Observed, i: int) -> str:
    unit, display = found.names.units[i], found.names.display[i]
    scale = float(parse_unit(unit).scale) / float(parse_unit(display).scale)
    return f"{significant(found.prior_sigma[i] * scale, 3)} {display if display != '1' else ''}".strip()


def _degree(value: float) -> Cell:
    if value != value:  # NaN
        return Cell(UNKNOWN)
    value = 0.0 if value < NOTHING else value
    tone = "good" if value < KNOWN else "bad" if value > UNKNOWN_LEFT else ""
    return Cell(f"{value:.2g}" if value < 0.01 or value >= 1e3 else f"{value:.3f}", tone)


def _sparkline(values: list[float]) -> str:
    """Ten blocks: the height is the degree, 1 a full one."""
    blocks = " ▁▂▃▄▅▆▇█"
    own = [values[round(k * (len(values) - 1) / 9)] for k in range(10)]
    return "".join(" " if v != v else blocks[max(1, min(8, round(8 * min(v, 1.0))))] for v in own)
