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


def test_55_where_no_node_answers_the_states_are_predicted_until_one_is_back(check: Check, tracker: Tracker) -> None:
    both = f"{NORTH}, {{node: east, from: 5 s, until: 8 s}}"
    told = check(tracker(ESTIMATOR, NODES % both), "--json", command="run")
    assert told.code == 0
    answer = json.loads(told.out)
    assert sorted((e["source"], e["time"], e["count"]) for e in answer["events"] if e["kind"] == "node silent") == [
        ("node east", 5.0, 6),
        ("node north", 3.0, 6),
    ]
    for state in answer["states"].values():
        assert abs(state["error"]) < 4.0 * state["sigma"]


def test_55_a_silence_at_which_there_is_no_step_is_told(check: Check, tracker: Tracker) -> None:
    told = check(tracker(ESTIMATOR, NODES % "{node: north, from: 300 s, until: 400 s}"), "--json", command="run")
    assert told.code == 0
    (event,) = json.loads(told.out)["events"]
    assert (event["source"], event["kind"]) == ("node north", "silence without steps")
    assert "the run goes from 0 to 10 s" in event["text"]


def test_55_a_node_that_is_none_is_refused_with_the_nearest(check: Check, tracker: Tracker) -> None:
    told = check(tracker(ESTIMATOR, NODES % NORTH.replace("north", "norht")), command="run")
    assert told.code == 3
    told.says("there is no node 'norht'")
    told.says("did you mean 'north'")
