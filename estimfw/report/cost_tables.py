"""What a step costs as tables and sentences, for the terminal and the page alike, and as JSON."""

from __future__ import annotations

from typing import Any

from estimfw.report.numbers import UNKNOWN, count, plain, significant
from estimfw.report.tables import Cell, Table
from estimfw.run.cost import Costed, CutCost, FormCost
from estimfw.run.measured_cost import TURNS, Measured
from estimfw.units.data_rate import WORD_BYTES

__all__ = [
    "cost_json",
    "cost_notes",
    "duration",
    "exchange_table",
    "form_table",
    "link_text",
    "times_table",
    "verdicts",
]

FORM_TEXTS = {
    "textbook": "textbook: Phi P Phi', (I - K H) P",
    "joseph_at_once": "Joseph's form, all rows at once",
    "symmetric": "symmetric P, a row at a time, any rows",
    "selecting": "the same, rows that read one state each",
    "pattern": "the same, zeros of this Phi and H left out",
    "ud": "as this config runs it: UD, dense",
    "joseph": "as this config runs it: Joseph's form, a row at a time, dense",
    "decentralised": "{nodes} nodes, all together",
    "triangular": "the same, half of each node's own P",
    "decentralised_selecting": "the same, rows that read one state each",
    "decentralised_pattern": "the same, zeros of this Phi and H left out",
    "busiest": "busiest of {nodes} processors",
}
NOTE = (
    "Multiplications and divisions of one step in which every row is fused, R diagonal; an inverse of m rows counts as m^3. "
    "Counted: by a run on numbers that count."
)
NOT_COUNTED = "Not counted there: more than 40 states (--count counts them)."
HALVES = "Of an odd block P_ij one node has more than half: so the busiest has more than the formula's exact half."
WORD = "A word is a number of 8 bytes that goes to all other nodes, and is counted once."
PARTIAL = "Rows that read several states of a node send parts of sums: more words than by formula."


def form_table(costed: Costed) -> Table:
    """Each form: its multiplications, and how they stand to the textbook's and to the symmetric filter's."""
    textbook, symmetric = costed.products("textbook"), costed.products("symmetric")
    cut = costed.cut
    forms = [*costed.forms, *(cut.forms if cut is not None else ())]
    rows = []
    for form in forms:
        text = FORM_TEXTS[form.key].format(nodes=len(cut.nodes.names) if cut is not None else 0)
        counted = count(form.counted) if form.counted is not None else UNKNOWN
        ratios = (f"{100.0 * form.products / textbook:.1f} %", f"{form.products / symmetric:.2f}")
        rows.append((Cell(text), Cell(count(form.products)), Cell(counted), *(Cell(r) for r in ratios)))
    head = ("form", "multiplications", "counted", "of the textbook's", "to the symmetric")
    return Table(head, tuple(rows), frozenset(range(1, 5)), " ".join(cost_notes(costed)))


def cost_notes(costed: Costed) -> list[str]:
    """What the numbers are."""
    cut, ran = costed.cut, costed.forms[0].counted is not None
    told = [NOTE if ran else f"{NOTE} {NOT_COUNTED}"]
    busiest = [f for f in cut.forms if f.key == "busiest"] if cut is not None else []
    if any(f.counted is not None and f.counted != f.products for f in busiest):
        told.append(HALVES)
    if costed.members:
        told.append("Of one member of the bank.")
    if costed.correlated:
        told.append("Noises of rows are correlated here: telling them apart is not counted.")
    if costed.varying:
        told.append(f"Phi and Q are made anew at each step, which is not counted here ({costed.varying}).")
    return told


def exchange_table(cut: CutCost) -> Table:
    """Nodes, what they own, and what goes between them in a step."""
    sizes = cut.sizes
    rows = tuple(
        (Cell(name), Cell(str(n)), Cell(str(m)), Cell("own" if reads in (n, 0) else f"{reads} states"))
        for name, n, m, reads in zip(cut.nodes.names, sizes.sizes, sizes.rows, sizes.reads, strict=True)
    )
    words = f"{count(cut.words)} words in {sizes.stages + 1} exchanges a step by formula"
    if cut.counted_words is not None:
        words += f", {count(cut.counted_words)} in {cut.counted_rounds} as the nodes send them"
    partial = f" {PARTIAL}" if cut.counted_words is not None and cut.counted_words > cut.words else ""
    return Table(("node", "states", "rows", "rows read"), rows, frozenset({1, 2}), f"{words}. {WORD}{partial}")


def link_text(cut: CutCost) -> str:
    """What the prediction rests on."""
    return f"latency {duration(cut.link.latency)}, {speed_text(cut)}"


def speed_text(cut: CutCost) -> str:
    """The same without the latency."""
    rate, each = significant(WORD_BYTES * 1e-6 / cut.link.word, 3), duration(cut.link.multiplication)
    return f"{rate} MB/s, {each} a multiplication"


def times_table(cut: CutCost) -> Table:
    """Predicted time of a step on one processor and on several."""
    times = cut.times
    rows = (
        (Cell("one processor, symmetric global filter"), Cell(duration(times.one)), Cell("1")),
        (Cell("busiest processor alone"), Cell(duration(times.busiest)), Cell(_ratio(times.without_communication))),
        (Cell(f"{count(cut.words)} words"), Cell(duration(times.words)), Cell("")),
        (Cell(f"{cut.sizes.stages + 1} synchronisations"), Cell(duration(times.waiting)), Cell("")),
        (Cell(f"{len(cut.nodes.names)} processors"), Cell(duration(times.several)), Cell(_ratio(times.ratio))),
    )
    return Table(("a step takes", "predicted", "times quicker"), rows, frozenset({1, 2}), link_text(cut))


def measured_table(costed: Costed, measured: Measured) -> Table:
    """Counted work beside measured time."""
    cut, times = costed.cut, measured.times
    assert cut is not None
    parts, link = len(cut.nodes.names), measured.communication
    whole, nodes = measured.as_run
    lines = (
        ("one node that owns all", measured.products, times.one, times.one),
        (
            f"{parts} nodes, one after the other",
            cut.products("decentralised"),
            measured.predicted_together,
            times.together,
        ),
        ("busiest node alone", cut.products("busiest"), measured.predicted_busiest, times.busiest),
        (f"{parts} processors with this link", None, measured.predicted_busiest + link, times.busiest + link),
    )
    rows = [
        (
            Cell(text),
            Cell(count(products) if products is not None else ""),
            Cell(duration(predicted)),
            Cell(duration(found)),
            Cell(_ratio(times.one / predicted)),
            Cell(_ratio(times.one / found)),
        )
        for text, products, predicted, found in lines
    ]
    head = ("a step of", "multiplications", "predicted", "measured", "times quicker, predicted", "measured")
    note = (
        f"NumPy on one thread of this machine, the shortest of {TURNS} turns; predicted: the products, each "
        f"{duration(measured.product)} as with one node. {_calls(measured)}The words take {duration(link)} by the link as "
        f"given: that is not measured. As they run over the record, with all that is around the nodes: the global filter in "
        f"Joseph's form {duration(whole.seconds)} a step, the decentralised one {duration(nodes.seconds)}; their estimates "
        f"differ by {measured.apart:.1g} σ at most."
    )
    return Table(head, tuple(rows), frozenset(range(1, 6)), note)


def _calls(measured: Measured) -> str:
    """What the busiest node spends on something else than products."""
    beyond = measured.times.busiest - measured.predicted_busiest
    if beyond < 0.5 * measured.predicted_busiest:
        return ""
    spent = f"{duration(beyond)} of the busiest node's {duration(measured.times.busiest)}"
    return f"Calls of NumPy for small blocks take the rest, {spent}: larger nodes have less of it. "


def _ratio(ratio: float) -> str:
    return significant(ratio, 3)


def verdicts(costed: Costed, measured: Measured | None = None) -> list[str]:
    """Whether decentralising pays, in plain sentences; none where there are no nodes."""
    cut = costed.cut
    if cut is None:
        return []
    found = [_as_measured(measured)] if measured is not None else []
    return [_on_one(costed, cut), _on_several(cut), *found, *_better(costed, cut)]


def _as_measured(measured: Measured) -> str:
    gain = measured.speed_up
    told = f"{_ratio(gain)} times quicker" if gain > 1.0 else f"{_ratio(1.0 / gain)} times slower"
    return (
        f"Measured here, in NumPy: the busiest node takes {duration(measured.times.busiest)} where one that owns all takes "
        f"{duration(measured.times.one)}; with this link several processors would be {told} with this code."
    )


def _on_one(costed: Costed, cut: CutCost) -> str:
    symmetric, textbook = costed.products("symmetric"), costed.products("textbook")
    whole, half = cut.products("decentralised"), cut.products("triangular")
    one, several = costed.products("selecting"), cut.products("decentralised_selecting")
    own, pattern = cut.products("decentralised_pattern"), costed.products("pattern")
    return (
        f"On one processor it does not pay: {count(whole)} multiplications a step ({count(half)} with half of each node's P) "
        f"against {count(symmetric)} of a global filter that keeps P symmetric. Like with like: {count(several)} against "
        f"{count(one)} where rows read one state each, {count(own)} against {count(pattern)} with zeros left out. The "
        f"{count(whole)} are {100.0 * whole / textbook:.1f} % of the textbook filter's {count(textbook)}, but what saves the "
        "rest is not the cut: blocks that are kept once, and rows taken one after the other."
    )


def _on_several(cut: CutCost) -> str:
    times, parts = cut.times, len(cut.nodes.names)
    if times.ratio > 1.0:
        told = (
            f"On {parts} processors it pays with this link: {_ratio(times.ratio)} times quicker (without communication "
            f"{_ratio(times.without_communication)}), as long as the latency is below {duration(cut.break_even_latency)}."
        )
    else:
        told = f"On {parts} processors it does not pay with this link: {_ratio(1.0 / times.ratio)} times slower. "
        if cut.break_even_latency > 0.0:
            told += f"It would below a latency of {duration(cut.break_even_latency)}."
        else:
            saved = max(0.0, times.one - times.busiest)
            told += (
                f"No latency would do: {count(cut.words)} words take {duration(times.words)}, and all that is saved is "
                f"{duration(saved)}."
            )
    states = cut.break_even_states
    if states is None:
        return f"{told} No number of states changes that."
    return (
        f"{told} With {parts} equal nodes and as many rows a state it pays from {count(states)} states on; for very many it "
        f"gains {_ratio(cut.largest)} times."
    )


def _better(costed: Costed, cut: CutCost) -> list[str]:
    pattern, busiest = costed.products("pattern"), cut.products("busiest")
    if pattern > busiest:
        return []
    return [
        f"One processor that leaves out the zeros of Phi and H needs {count(pattern)}: no more than the busiest of "
        f"{len(cut.nodes.names)} that do not ({count(busiest)})."
    ]


def duration(seconds: float) -> str:
    """A time with three digits in ns, µs, ms or s."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if abs(seconds) * factor >= 1.0:
            return f"{plain(float(f'{seconds * factor:.3g}'))} {unit}"
    return f"{plain(float(f'{seconds * 1e9:.3g}'))} ns"


def cost_json(costed: Costed, measured: Measured | None = None) -> dict[str, Any]:
    """All of it as plain JSON values, SI units."""
    cut = costed.cut
    return {
        "name": costed.name,
        "states": costed.states,
        "rows": costed.rows,
        "kernel": costed.kernel,
        "rows_select_states": costed.selecting,
        "noises_correlated": costed.correlated,
        "made_anew_at_each_step": costed.varying,
        "forms": [_form_json(costed, form) for form in costed.forms],
        "nodes": _cut_json(costed, cut) if cut is not None else None,
        "measured": _measured_json(measured) if measured is not None else None,
        "verdicts": verdicts(costed, measured),
    }


def _measured_json(measured: Measured) -> dict[str, Any]:
    times = measured.times
    return {
        "one_node": {"multiplications": measured.products, "measured": times.one},
        "together": {"predicted": measured.predicted_together, "measured": times.together},
        "busiest": {"predicted": measured.predicted_busiest, "measured": times.busiest},
        "communication": measured.communication,
        "speed_up": measured.speed_up,
        "multiplication": measured.product,
        "as_run": {"global": measured.as_run[0].seconds, "decentralised": measured.as_run[1].seconds},
        "largest_difference_in_sigmas": measured.apart,
    }


def _form_json(costed: Costed, form: FormCost) -> dict[str, Any]:
    return {
        "form": form.key,
        "multiplications": form.products,
        "counted": form.counted,
        "to_textbook": form.products / costed.products("textbook"),
        "to_symmetric": form.products / costed.products("symmetric"),
    }


def _cut_json(costed: Costed, cut: CutCost) -> dict[str, Any]:
    sizes, link, times = cut.sizes, cut.link, cut.times
    return {
        "names": list(cut.nodes.names),
        "sizes": list(sizes.sizes),
        "rows": list(sizes.rows),
        "rows_read_states": list(sizes.reads),
        "forms": [_form_json(costed, form) for form in cut.forms],
        "words": {"formula": cut.words, "sent": cut.counted_words},
        "exchanges": {"formula": sizes.stages + 1, "made": cut.counted_rounds},
        "link": {"latency": link.latency, "word": link.word, "multiplication": link.multiplication},
        "predicted": {
            "one_processor": times.one,
            "busiest": times.busiest,
            "words": times.words,
            "waiting": times.waiting,
            "several_processors": times.several,
            "speed_up": times.ratio,
            "speed_up_without_communication": times.without_communication,
            "largest_speed_up": cut.largest,
            "break_even_latency": cut.break_even_latency,
            "break_even_states": cut.break_even_states,
        },
    }
