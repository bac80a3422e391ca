"""One step of nodes that exchange words against a global filter written down here, on random systems."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.counted_number import Tally, counted, values_of
from estimfw.analysis.dense_cost import CutSizes, decentralised_cost
from estimfw.analysis.filter_forms import inverse
from estimfw.estimators.decentralised.exchange import InProcessExchange, Program, lockstep
from estimfw.estimators.decentralised.judge import judge, symmetric_product
from estimfw.estimators.decentralised.ledger import Ledger
from estimfw.estimators.decentralised.node import Node
from estimfw.estimators.decentralised.shares import Snapshot, shares
from estimfw.estimators.decentralised.work import Arithmetic, Done, Judgement, Stage, Work

FloatArray = NDArray[np.float64]


@dataclass
class System:
    """x' = Phi x + d + w, y = H x + v: groups of states, groups of rows."""

    groups: list[list[int]]
    rows: list[list[int]]
    Phi: FloatArray
    Q: FloatArray
    d: FloatArray
    H: FloatArray
    R: FloatArray
    x: FloatArray
    P: FloatArray
    y: FloatArray


def positive(rng: np.random.Generator, n: int) -> FloatArray:
    """Correlated, and of a condition that leaves a filter in double precision 13 digits."""
    A = rng.standard_normal((n, n)) / np.sqrt(n)
    return np.asarray(A @ A.T + 0.3 * np.eye(n))


def random_system(rng: np.random.Generator, nodes: int, *, local: bool = False, full_R: bool = True) -> System:
    """Unequal blocks in any order of the states, and from two nodes on one of them without a measurement."""
    sizes = rng.integers(1, 5, nodes)
    counts = rng.integers(1, 4, nodes)
    counts[int(rng.integers(nodes))] *= nodes == 1
    n, m = int(sizes.sum()), int(counts.sum())
    groups = [sorted(g.tolist()) for g in np.split(rng.permutation(n), np.cumsum(sizes)[:-1])]
    rows = [g.tolist() for g in np.split(np.arange(m), np.cumsum(counts)[:-1])]
    H, R = rng.standard_normal((m, n)) / np.sqrt(n), positive(rng, m)
    for group, own in zip(groups, rows, strict=True):
        others = [i for i in range(n) if i not in group]
        if local:
            H[np.ix_(own, others)] = 0.0
        if not full_R:
            R[np.ix_(own, [i for i in range(m) if i not in own])] = 0.0
    return System(
        groups, rows, rng.standard_normal((n, n)) / np.sqrt(n), positive(rng, n), rng.standard_normal(n), H, R,
        rng.standard_normal(n), positive(rng, n), rng.standard_normal(m),
    )  # fmt: skip


def work_of(system: System, *, gate: Sequence[float | None] = ()) -> tuple[Work, list[dict[int, FloatArray]]]:
    """The step as work, a stage for each node that has rows, and the readings of each node."""
    stages, readings = [], [dict[int, FloatArray]() for _ in system.groups]
    for node, own in enumerate(system.rows):
        if own:
            H, limit = system.H[own], gate[node] if gate else None
            thresholds = None if limit is None else np.full(len(own) + 1, limit)
            stages.append(Stage(node, node, H, system.R[np.ix_(own, own)], H != 0.0, thresholds))
            readings[node][node] = system.y[own]
    noise = {
        (a.place, b.place): system.R[np.ix_(system.rows[a.place], system.rows[b.place])]
        for i, a in enumerate(stages)
        for b in stages[i + 1 :]
    }
    kept = {key: R for key, R in noise.items() if np.any(R)}
    return Work((system.Phi, system.Q, system.d), tuple(stages), kept), readings


def step(system: System, *, gate: Sequence[float | None] = ()) -> tuple[Sequence[Done], InProcessExchange]:
    work, readings = work_of(system, gate=gate)
    nodes = [Node(i, shares(system.groups)) for i in range(len(system.groups))]
    exchange = InProcessExchange([str(i) for i in range(len(nodes))])
    return exchange.step(0.0, nodes, Snapshot(system.x, system.P), work, readings), exchange


def global_update(system: System, rows: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """The textbook filter with these rows at once."""
    x = system.Phi @ system.x + system.d
    P = system.Phi @ system.P @ system.Phi.T + system.Q
    H, R = system.H[rows], system.R[np.ix_(rows, rows)]
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    A = np.eye(len(x)) - K @ H
    return x + K @ (system.y[rows] - H @ x), A @ P @ A.T + K @ R @ K.T


def assert_equal(found: Snapshot, x: FloatArray, P: FloatArray, tolerance: float = 1e-11) -> None:
    """Differences in sigmas, and in products of sigmas."""
    sigma = np.sqrt(np.diag(P))
    assert np.abs((found.x - x) / sigma).max() < tolerance
    assert np.abs((found.P - P) / np.outer(sigma, sigma)).max() < tolerance


seeds = st.integers(0, 10_000)


@settings(max_examples=60, deadline=None)
@given(seed=seeds, nodes=st.integers(1, 5), local=st.booleans(), full_R=st.booleans())
def test_all_nodes_end_with_the_global_filter(seed: int, nodes: int, local: bool, full_R: bool) -> None:
    """N = 1 .. 5, unequal blocks, a node without a measurement, rows over all states, noises of all nodes correlated."""
    system = random_system(np.random.default_rng(seed), nodes, local=local, full_R=full_R)
    done, _ = step(system)
    x, P = global_update(system, range(len(system.y)))
    for one in done:
        assert_equal(one.snapshot, x, P)
        assert np.array_equal(one.snapshot.P, one.snapshot.P.T)
        assert np.array_equal(one.snapshot.P, done[0].snapshot.P)  # the same words make the same numbers everywhere


@settings(max_examples=30, deadline=None)
@given(seed=seeds, nodes=st.integers(2, 5), lost=st.sets(st.integers(0, 14), min_size=1, max_size=4))
def test_missing_components_are_left_out(seed: int, nodes: int, lost: set[int]) -> None:
    system = random_system(np.random.default_rng(seed), nodes)
    system.y[[i for i in lost if i < len(system.y)]] = np.nan
    done, _ = step(system)
    x, P = global_update(system, np.flatnonzero(np.isfinite(system.y)).tolist())
    assert_equal(done[0].snapshot, x, P)
    for one in done:
        for place, judged in one.judged.items():
            own = np.isfinite(system.y[system.rows[place]])
            assert judged.disposition == (0 if own.any() else 3)
            assert judged.used == own.sum()
            assert np.array_equal(np.isfinite(judged.innovation), own)


def block_sequential(
    system: System, limits: Sequence[float | None]
) -> tuple[FloatArray, FloatArray, list[bool], list[float]]:
    """The global filter, node after node with a gate; noise is rid of what was fused before, by the joint R of these rows."""
    x = system.Phi @ system.x + system.d
    P = system.Phi @ system.P @ system.Phi.T + system.Q
    fused, kept, values = list[int](), [], []
    for own, limit in zip(system.rows, limits, strict=True):
        if not own:
            continue
        before_x, before_P = global_update(system, fused) if fused else (x, P)
        H, y, R = system.H[own], system.y[own], system.R[np.ix_(own, own)]
        if fused:
            B = system.R[np.ix_(own, fused)] @ np.linalg.inv(system.R[np.ix_(fused, fused)])
            y, H = y - B @ system.y[fused], H - B @ system.H[fused]
            R = R - B @ system.R[np.ix_(fused, own)]
        nu, S = y - H @ before_x, H @ before_P @ H.T + R
        nis = float(nu @ np.linalg.inv(S) @ nu)
        values.append(nis)
        kept.append(limit is None or nis <= limit)
        if kept[-1]:
            fused += own
    return *(global_update(system, fused) if fused else (x, P)), kept, values


@settings(max_examples=40, deadline=None)
@given(seed=seeds, nodes=st.integers(2, 5), full_R=st.booleans(), limit=st.floats(0.3, 4.0))
def test_gates_are_those_of_the_block_sequential_filter(seed: int, nodes: int, full_R: bool, limit: float) -> None:
    system = random_system(np.random.default_rng(seed), nodes, full_R=full_R)
    limits = [None if i % 3 == 2 else limit for i in range(nodes)]
    x, P, kept, nis = block_sequential(system, limits)
    done, _ = step(system, gate=limits)
    assert_equal(done[0].snapshot, x, P)
    found = {place: judged for one in done for place, judged in one.judged.items()}
    assert [found[place].disposition == 0 for place in sorted(found)] == kept
    assert np.allclose([found[place].nis for place in sorted(found)], nis, rtol=1e-8)


def test_a_perfect_reading_takes_its_part_from_another_nodes_noise() -> None:
    """R of full size but rank one: the second reading, rid of the first one, is perfect too."""
    rng = np.random.default_rng(2)
    system = random_system(rng, 2)
    system.groups, system.rows = [[0], [1]], [[0], [1]]
    n = 2
    system.Phi, system.Q, system.d = np.eye(n), np.zeros((n, n)), np.zeros(n)
    system.H, system.R = np.eye(n), np.array([[1.0, 1.0], [1.0, 1.0]])
    system.x, system.P, system.y = np.zeros(n), np.diag([4.0, 9.0]), np.array([1.0, 3.0])
    done, _ = step(system)
    K = system.P @ np.linalg.inv(system.P + system.R)
    assert_equal(done[1].snapshot, K @ system.y, system.P - K @ system.P)


def test_a_singular_innovation_covariance_is_told_and_skipped() -> None:
    system = random_system(np.random.default_rng(4), 2, local=True, full_R=False)
    system.groups, system.rows = [[0], [1]], [[0], [1]]
    system.Phi, system.Q, system.d = np.eye(2), np.zeros((2, 2)), np.zeros(2)
    system.H, system.R = np.eye(2), np.diag([0.0, 1.0])
    system.x, system.P, system.y = np.zeros(2), np.diag([0.0, 1.0]), np.ones(2)
    done, _ = step(system)
    assert done[0].judged[0].disposition == 4
    assert done[1].judged[1].disposition == 0
    assert np.allclose(done[0].snapshot.x, [0.0, 0.5])


@pytest.mark.parametrize("sigma", np.geomspace(1e4, 1e9, 11).tolist())
def test_a_huge_prior_under_a_small_noise_leaves_no_variance_of_zero(sigma: float) -> None:
    """P - K S K' keeps no digit of what is left here; the true sigma is that of the noise, 1 m."""
    system = selector_system(4, 2, 2)
    system.Phi, system.Q, system.P = np.eye(4), np.zeros((4, 4)), np.diag([sigma**2, 1.0, sigma**2, 1.0]) / 1.7
    done, _ = step(system)
    found = np.sqrt(np.diag(done[0].snapshot.P))[[0, 2]]
    assert np.all(found > 1.0 - 1e-4)
    assert np.all(found < 1.0 + 1e-4 if sigma < 1e6 else found < 2e-8 * sigma + 1.0 + 1e-4)


def selector_system(n: int, m: int, nodes: int) -> System:
    """Equal blocks; each row reads one state of its node."""
    rng = np.random.default_rng(n)
    groups = [list(range(i * n // nodes, (i + 1) * n // nodes)) for i in range(nodes)]
    rows = [list(range(i * m // nodes, (i + 1) * m // nodes)) for i in range(nodes)]
    H = np.zeros((m, n))
    for group, own in zip(groups, rows, strict=True):
        H[own, group[: len(own)]] = 1.0
    return System(
        groups, rows, rng.standard_normal((n, n)), positive(rng, n), np.zeros(n), H, np.eye(m),
        np.zeros(n), positive(rng, n), rng.standard_normal(m),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("n", "m", "nodes", "words"), [(10, 2, 2, 89), (20, 4, 4, 318), (40, 8, 4, 1200), (100, 10, 5, 6175)]
)
def test_words_of_a_step_are_the_published_ones(n: int, m: int, nodes: int, words: int) -> None:
    _, exchange = step(selector_system(n, m, nodes))
    ledger = exchange.ledger
    assert ledger.total == words
    assert ledger.rounds == nodes + 1  # one a measurement, and the gathering
    assert sum(own["state"] + own["covariance"] for own in ledger.words) == n + n * (n + 1) // 2


def test_words_of_rows_over_all_states_are_counted_as_they_are_sent() -> None:
    """Each holder of entries of P sends its part of the sum: more words than for rows that read one state."""
    system = random_system(np.random.default_rng(1), 2, full_R=True)
    system.groups, system.rows = [[0, 1], [2, 3]], [[0], [1]]
    system.Phi, system.Q, system.d = np.eye(4), np.eye(4), np.zeros(4)
    rng = np.random.default_rng(6)
    system.H, system.R, system.y = rng.standard_normal((2, 4)), np.array([[1.0, 0.5], [0.5, 1.0]]), np.ones(2)
    system.x, system.P = np.zeros(4), np.eye(4)
    _, exchange = step(system)
    total = {
        kind: sum(own[kind] for own in exchange.ledger.words) for kind in ("projection", "predicted reading", "reading")
    }
    # Node 0 holds P_00 and the first row of P_01, node 1 P_11 and the second: parts of 4 and of 3 entries of M.
    assert total["projection"] == 2 * (4 + 3)
    assert total["predicted reading"] == 2  # what the other node's states make of each reading
    assert total["reading"] == 1  # the second measurement has to know the first one's reading
    assert exchange.ledger.total == 2 * (4 + 3 + 1 + 1 + 1) + 1 + 4 + 10  # nu and S^-1 of each, and x and P at the end
    assert exchange.ledger.rounds == 5  # two a measurement: S needs what the other holds


def triangular(A: FloatArray, B: FloatArray) -> FloatArray:
    """A B' where only the upper triangle is computed."""
    made = np.empty((len(A), len(B)), dtype=A.dtype)
    for i in range(len(A)):
        made[i, i:] = A[i] @ B[i:].T
        made[i:, i] = made[i, i:]
    return made


class Counting:
    """The arithmetic of a node whose numbers count its products."""

    def __init__(self, symmetric: Callable[[FloatArray, FloatArray], FloatArray]) -> None:
        self.tally, self.symmetric = Tally(), symmetric

    def number(self, values: FloatArray) -> Any:
        return counted(values, self.tally)

    def arithmetic(self) -> Arithmetic:
        return Arithmetic(inverse, self.symmetric, self._judge, self._zeros, self._finite)

    def program(self, program: Program) -> Program:
        """What comes from other nodes is from then on this node's to count."""
        message = next(program)
        while True:
            mailbox = yield message
            own = [replace(m, words={k: self.number(values_of(a)) for k, a in m.words.items()}) for m in mailbox]
            try:
                message = program.send(own)
            except StopIteration as end:
                return end.value  # type: ignore[no-any-return]

    def _zeros(self, shape: tuple[int, ...]) -> Any:
        return counted(np.zeros(shape), self.tally, known=True)

    def _finite(self, y: FloatArray) -> NDArray[np.bool_]:
        return np.isfinite(values_of(y))

    def _judge(self, nu: Any, S: Any, R: Any, usable: NDArray[np.bool_], limits: FloatArray | None) -> Judgement:
        return judge(values_of(nu), values_of(S), values_of(R), usable, limits)


def products(system: System, symmetric: Callable[[FloatArray, FloatArray], FloatArray]) -> list[int]:
    """What each node multiplies in a step, run on numbers that count."""
    work, readings = work_of(system)
    counting, programs = [Counting(symmetric) for _ in system.groups], []
    for i, one in enumerate(counting):
        Phi, Q, d = (one.number(a) for a in (system.Phi, system.Q, system.d))
        stages = tuple(replace(s, H=one.number(s.H), R=one.number(s.R)) for s in work.stages)
        node = Node(i, shares(system.groups), one.arithmetic())
        start = Snapshot(one.number(system.x), one.number(system.P))
        mine = {place: one.number(y) for place, y in readings[i].items()}
        programs.append(one.program(node.program(start, Work((Phi, Q, d), stages), mine)))
    done = lockstep(programs, range(len(programs)), Ledger(tuple("abcdefg"[: len(programs)])))
    x, P = global_update(system, range(len(system.y)))
    assert_equal(Snapshot(values_of(done[0].snapshot.x), values_of(done[0].snapshot.P)), x, P)
    return [one.tally.products for one in counting]


@pytest.mark.parametrize(
    ("n", "m", "nodes", "whole", "half"), [(10, 2, 2, 2162, 1922), (20, 4, 4, 15004, 14044), (40, 8, 4, 118032, 109392)]
)
def test_multiplications_of_all_nodes_are_the_published_ones(n: int, m: int, nodes: int, whole: int, half: int) -> None:
    system = selector_system(n, m, nodes)
    assert sum(products(system, symmetric_product)) == whole
    assert sum(products(system, triangular)) == half


def test_each_node_multiplies_what_the_critical_path_leaves_it() -> None:
    """40 states, 8 rows, 4 nodes: 29712 on the critical path, of which S, its inverse and nu of three others are not its own."""
    others = 3 * (10 * 2**2 + 2**3 + 10 * 2)
    assert products(selector_system(40, 8, 4), symmetric_product) == [29712 - others] * 4


@settings(max_examples=8, deadline=None)
@given(seed=seeds, nodes=st.integers(2, 4), local=st.booleans())
def test_unequal_nodes_multiply_what_the_closed_form_says(seed: int, nodes: int, local: bool) -> None:
    """Rows over all states cost a node what they read of others, which the closed form counts too."""
    system = random_system(np.random.default_rng(seed), nodes, local=local, full_R=False)
    sizes, rows = [len(g) for g in system.groups], [len(r) for r in system.rows]
    n = sum(sizes)
    cut = CutSizes(tuple(sizes), tuple(rows), tuple(sizes) if local else (n,) * nodes)
    assert sum(products(system, symmetric_product)) == decentralised_cost(cut)
