"""Times of nodes stand beside the counted work; what they are made of adds up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimfw.analysis.speed_up import Link
from estimfw.analysis.suboptimal import LinearStep
from estimfw.config.compose import Problem
from estimfw.errors import DataError
from estimfw.report.cost_tables import measured_table
from estimfw.run.both_forms import both_forms
from estimfw.run.cost import cost_of_filter, nodes_by_groups, nodes_of
from estimfw.run.measured_cost import measure
from estimfw.run.node_time import node_times
from estimfw.run.partition import partition_filter

Example = Callable[..., Problem]
NETWORK = Link(50e-6, 64e-9, 1e-9)


def test_times_of_nodes_stand_beside_their_work(example: Example) -> None:
    problem = example("tracker", "source.duration=20 s", "source.rates={speed: 2 Hz}")
    costed = cost_of_filter(problem, NETWORK, nodes_by_groups(problem, partition_filter(problem, 2, price=False)))
    assert costed.cut is not None
    found = measure(problem, costed.cut)
    times = found.times
    assert 0.0 < times.busiest <= times.together and times.one > 0.0
    ratio = found.predicted_busiest / found.predicted_together
    assert ratio == pytest.approx(costed.cut.products("busiest") / costed.cut.products("decentralised"))
    assert found.product * found.products == pytest.approx(times.one)
    assert found.communication == pytest.approx(costed.cut.times.words + costed.cut.times.waiting)
    table = measured_table(costed, found)
    assert [row[1].text for row in table.rows][1:3] == [
        str(costed.cut.products(k)) for k in ("decentralised", "busiest")
    ]


def test_a_record_without_a_full_step_cannot_be_timed(example: Example) -> None:
    problem = example("tracker", "source.duration=0.9 s", "source.rates={speed: 5 Hz}")
    nodes = nodes_by_groups(problem, partition_filter(problem, 2, price=False))
    costed = cost_of_filter(problem, NETWORK, nodes)
    assert costed.cut is not None
    with pytest.raises(DataError, match="every row"):
        measure(problem, costed.cut)


def test_many_small_nodes_share_the_work_of_a_large_filter() -> None:
    # So large that products outweigh calls: each of four nodes has less to do than one that has all.
    n, rng = 240, np.random.default_rng(1)
    Phi = np.eye(n) + 0.01 * rng.normal(size=(n, n))
    H = np.zeros((4, n))
    H[[0, 1, 2, 3], [0, 60, 120, 180]] = 1.0
    step = LinearStep(Phi, 0.01 * np.eye(n), np.zeros(n), H, np.eye(4), (0, 1, 2, 3))
    groups = [range(60 * k, 60 * k + 60) for k in range(4)]
    times = node_times([step] * 2, groups, [[0], [1], [2], [3]], (np.zeros(n), np.eye(n)), 7)
    assert times.busiest < times.together
    assert times.busiest < 0.8 * times.one


def test_both_forms_keep_what_they_share(example: Example) -> None:
    own = example(
        "tracker_decentralised",
        "estimator.gate=0.99",
        "estimator.gates={fix@north: 0.9, speed: 0.95}",
        "estimator.loop=open",
    )
    nodes = nodes_of(own)
    assert nodes is not None
    one, several = both_forms(own, nodes)
    assert (one.kind, several.kind) == ("kalman", "decentralised")
    assert one.plan.whole.states == several.plan.whole.states
    assert {m.name: m.gate for m in one.plan.measurements} == {"fix": 0.99, "speed": 0.95}
    assert {m.name: m.gate for m in several.plan.measurements} == {"fix@east": 0.99, "fix@north": 0.99, "speed": 0.95}
    assert nodes_of(several) == nodes
