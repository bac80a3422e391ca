"""Nodes of a decentralised filter that do not answer (55), as a user sees what became of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

Check = Callable[..., Any]
Tracker = Callable[..., str]

NODES = (
    "{kind: decentralised, nodes: ["
    "{name: east, blocks: ['position[x]', 'velocity[x]'], measurements: ['fix[x]']}, "
    "{name: north, blocks: ['position[y]', 'velocity[y]'], measurements: ['fix[y]']}], "
    "exchange: {silent: [%s]}}"
)
ESTIMATOR = "{kind: kalman, gate: 0.999}"
NORTH = "{node: north, from: 3 s, until: 6 s}"


def test_55_a_silent_node_is_flagged_and_the_others_go_on(check: Check, tracker: Tracker) -> None:
    told = check(tracker(ESTIMATOR, NODES % NORTH), "--json", command="run")
    assert told.code == 0
    answer = json.loads(told.out)
    (event,) = answer["events"]
    assert (event["source"], event["kind"], event["time"], event["count"]) == ("node north", "node silent", 3.0, 6)
    assert "its measurements are missing, east carried its states on" in event["text"]
    assert answer["measurements"]["fix@east"]["fused"] == 20
    assert answer["measurements"]["fix@north"] | {"fused": 14, "missing": 6} == answer["measurements"]["fix@north"]
    for state in answer["states"].values():
        assert abs(state["error"]) < 4.0 * state["sigma"]
    assert [node["silent_steps"] for node in answer["exchange"]["nodes"]] == [0, 6]


def test_55_a_filter_none_of_whose_nodes_answers_is_refused(check: Check, tracker: Tracker) -> None:
    both = f"{NORTH}, {{node: east, from: 5 s, until: 8 s}}"
    told = check(tracker(ESTIMATOR, NODES % both), command="run")
    assert told.code == 5
    told.says("no node answers at 5 s")


def test_55_a_node_that_is_none_is_refused_with_the_nearest(check: Check, tracker: Tracker) -> None:
    told = check(tracker(ESTIMATOR, NODES % NORTH.replace("north", "norht")), command="run")
    assert told.code == 3
    told.says("there is no node 'norht'")
    told.says("did you mean 'north'")
