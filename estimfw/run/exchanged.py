"""What the exchange of a decentralised run counted, and which nodes did not answer: events, and plain values for the result."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimfw.config.generic.decentralised import DecentralisedConfig
from estimfw.data.record import SAME, Event
from estimfw.estimators.decentralised.ledger import Ledger
from estimfw.estimators.decentralised.scan import DecentralisedScan
from estimfw.run.prepare import Prepared

__all__ = ["answered", "exchange_json", "silence_events", "silences_begun"]

IntArray = NDArray[np.int64]


def _ledger(prepared: Prepared) -> Ledger | None:
    return prepared.scan.exchange.ledger if isinstance(prepared.scan, DecentralisedScan) else None


def silence_events(prepared: Prepared) -> Iterator[Event]:
    """One for each time in which a node did not answer; none where the filter has no nodes."""
    ledger = _ledger(prepared)
    if ledger is None:
        return
    for absence in ledger.absences:
        deputies = " and ".join(ledger.names[i] for i in absence.deputies)
        carried = (
            f"{deputies} carried its states on" if deputies else "its states were predicted from the last snapshot"
        )
        text = (
            f"did not answer at the steps from {absence.first:.10g} to {absence.last:.10g} s: "
            f"its measurements are missing, {carried}"
        )
        yield Event(absence.first, f"node {ledger.names[absence.node]}", "node silent", text, absence.steps)
    yield from _without_steps(prepared)


def _without_steps(prepared: Prepared) -> Iterator[Event]:
    """Silences that the config asks for at a time at which there is no step."""
    time = prepared.steps.time
    estimator = prepared.problem.estimator
    for one in estimator.exchange.silent if isinstance(estimator, DecentralisedConfig) else ():
        if not np.any((time >= one.begin - SAME) & (time < one.until - SAME)):
            text = (
                f"should not answer from {one.begin:.10g} to {one.until:.10g} s, but no step ends then: "
                f"the run goes from {prepared.steps.start:.10g} to {time[-1]:.10g} s"
            )
            yield Event(one.begin, f"node {one.node}", "silence without steps", text)


def silences_begun(scan: object, time: float) -> Iterator[Event]:
    """One for each node that did not answer for the first time at the step that ends at this time, s."""
    if isinstance(scan, DecentralisedScan):
        ledger = scan.exchange.ledger
        for absence in ledger.absences:
            if absence.first == time:
                others = (
                    "the others carry its states on" if absence.deputies else "no node is there to carry its states on"
                )
                text = f"does not answer: its measurements are missing, {others}"
                yield Event(time, f"node {ledger.names[absence.node]}", "node silent", text)


def answered(prepared: Prepared, disposition: IntArray) -> IntArray:
    """Dispositions (K, measurements) without those of nodes that did not answer (-1 there), of which there is one event."""
    ledger, subsystems = _ledger(prepared), prepared.plan.subsystems
    if ledger is None or subsystems is None or not ledger.absences:
        return disposition
    left, time = disposition.copy(), prepared.steps.time
    for absence in ledger.absences:
        away = np.flatnonzero((time >= absence.first - SAME) & (time <= absence.last + SAME))
        left[np.ix_(away, np.array(subsystems.nodes[absence.node].measurements, dtype=np.int64))] = -1
    return left


def exchange_json(prepared: Prepared) -> dict[str, Any] | None:
    """Nodes, what they own, and what each sent; None where the filter has no nodes."""
    ledger, plan = _ledger(prepared), prepared.plan
    if ledger is None or plan.subsystems is None:
        return None
    return {
        "cross_covariance": "exact" if plan.separation is None else plan.separation.form,
        "steps": ledger.steps,
        "rounds": ledger.rounds,
        "words": ledger.total,
        "nodes": [
            {
                "name": node.name,
                "states": [plan.states[i] for i in node.states],
                "measurements": [plan.measurements[j].name for j in node.measurements],
                "messages": ledger.messages[i],
                "words": dict(sorted(ledger.words[i].items())),
                "silent_steps": sum(a.steps for a in ledger.absences if a.node == i),
            }
            for i, node in enumerate(plan.subsystems.nodes)
        ],
    }
