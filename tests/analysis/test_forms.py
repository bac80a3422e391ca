"""Every form of the filter gives the same numbers, and takes exactly the products that its formula says."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.analysis.block_cost import cut_of, decentralised_pattern_cost
from estimfw.analysis.cost import predict_cost, update_cost
from estimfw.analysis.counted_nodes import CountedStep, counted_step
from estimfw.analysis.counted_number import Counted, Tally, counted, values_of
from estimfw.analysis.dense_cost import (
    CutSizes,
    balanced_sizes,
    busiest_processor_cost,
    decentralised_cost,
    joseph_at_once_cost,
    symmetric_cost,
    textbook_cost,
    words_sent,
)
from estimfw.analysis.filter_forms import (
    Numbers,
    StepArrays,
    inverse,
    joseph_step,
    symmetric_step,
    textbook_step,
)
from estimfw.analysis.zero_pattern import OTHER, UNIT, ZERO

FloatArray = NDArray[np.float64]
Groups = list[list[int]]
Step = Callable[[StepArrays], tuple[Numbers, Numbers]]

# The specification of the gravimeter's alignment, section 3: n, m, N, then textbook, scalar with dense rows, scalar with rows
# that select, decentralised, with triangular diagonal blocks, critical path, words.
TABLE = [
    (10, 2, 2, 3628, 2040, 1800, 2162, 1922, 1092, 89),
    (20, 4, 4, 28464, 15360, 13600, 15004, 14044, 3784, 318),
    (40, 8, 4, 225472, 119040, 105600, 118032, 109392, 29712, 1200),
    (100, 10, 5, 3233000, 1669500, 1567500, 1693640, 1589140, 339240, 6175),
]


def consecutive(sizes: Sequence[int]) -> Groups:
    ends = np.cumsum(sizes)
    return [list(range(int(e) - s, int(e))) for s, e in zip(sizes, ends, strict=True)]


def a_step(n: int, m: int, seed: int = 0) -> StepArrays:
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    return StepArrays(
        x=rng.normal(size=n), P=A @ A.T + np.eye(n), Phi=rng.normal(size=(n, n)), Q=B @ B.T, z=rng.normal(size=m),
        H=rng.normal(size=(m, n)), R=np.diag(rng.uniform(0.5, 2.0, m)),
    )  # fmt: skip


def counting(step: StepArrays, tally: Tally, absent: NDArray[np.bool_] | None = None, *known: str) -> StepArrays:
    """The same of numbers that count; entries of H that are ``absent`` are zero by structure, as is what is in ``known``."""
    made = {name: counted(getattr(step, name), tally, known=name in known) for name in StepArrays.__slots__}
    if absent is not None:
        for i, j in np.argwhere(absent):
            made["H"][i, j] = Counted(0.0, tally, known=True)
    return StepArrays(**made)


def products(run: Step, step: StepArrays, absent: NDArray[np.bool_] | None = None, *known: str) -> int:
    """How many were made; the outcome is that of the same form on floats."""
    tally = Tally()
    x, P = run(counting(step, tally, absent, *known))
    want_x, want_P = run(step)
    np.testing.assert_allclose(values_of(x), want_x.astype(float), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(values_of(P), want_P.astype(float), rtol=1e-9, atol=1e-9)
    return tally.products


def nodes_counted(
    step: StepArrays, groups: Groups, rows: Groups, reads: NDArray[np.bool_], *known: str, triangular: bool = False
) -> CountedStep:
    """A step of the nodes as they are; its outcome is that of the textbook."""
    tally = Tally()
    made = counted_step(counting(step, tally, None, *known), tally, groups, rows, reads, triangular=triangular)
    x, P = textbook_step(step)
    np.testing.assert_allclose(values_of(made.x), x.astype(float), rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(values_of(made.P), P.astype(float), rtol=1e-7, atol=1e-7)
    return made


def outside(groups: Groups, rows: Groups, n: int) -> NDArray[np.bool_]:
    """Entries of H that a local measurement does not have."""
    absent = np.ones((sum(map(len, rows)), n), dtype=bool)
    for group, own in zip(groups, rows, strict=True):
        absent[np.ix_(own, group)] = False
    return absent


@pytest.mark.parametrize("line", TABLE, ids=lambda line: f"{line[0]} states")
def test_formulas_are_the_published_table(line: tuple[int, ...]) -> None:
    n, m, parts, *want = line
    cut = CutSizes.local(balanced_sizes(n, parts), balanced_sizes(m, parts))
    found = [
        textbook_cost(n, m), symmetric_cost(n, m), symmetric_cost(n, m, selecting=True), decentralised_cost(cut),
        decentralised_cost(cut, triangular=True), busiest_processor_cost(cut), words_sent(cut),
    ]  # fmt: skip
    assert found == want


@pytest.mark.parametrize("line", TABLE[:3], ids=lambda line: f"{line[0]} states")
def test_the_table_is_what_runs_on_counting_numbers_take(line: tuple[int, ...]) -> None:
    n, m, parts, textbook, dense, selecting, decentralised, triangular, *_ = line
    groups, rows = consecutive(balanced_sizes(n, parts)), consecutive(balanced_sizes(m, parts))
    step = a_step(n, m)
    assert products(textbook_step, step) == textbook
    assert products(joseph_step, step) == joseph_at_once_cost(n, m)
    assert products(symmetric_step, step) == dense
    one_each = StepArrays(step.x, step.P, step.Phi, step.Q, step.z, np.eye(m, n), step.R)
    assert products(symmetric_step, one_each, None, "H") == selecting
    absent = outside(groups, rows, n)
    local = StepArrays(step.x, step.P, step.Phi, step.Q, step.z, np.where(absent, 0.0, step.H), step.R)
    assert nodes_counted(local, groups, rows, ~absent).total == decentralised
    assert nodes_counted(local, groups, rows, ~absent, triangular=True).total == triangular


cuts = st.lists(st.tuples(st.integers(1, 3), st.integers(0, 2)), min_size=1, max_size=4)


@settings(max_examples=40, deadline=None)
@given(cuts, st.booleans(), st.integers(0, 99))
def test_unequal_subsystems_take_what_the_formula_says(parts: list[tuple[int, int]], half: bool, seed: int) -> None:
    groups, rows = consecutive([s for s, _ in parts]), consecutive([m for _, m in parts])
    n, m = sum(map(len, groups)), sum(map(len, rows))
    step, absent = a_step(n, m, seed), outside(groups, rows, n)
    local = StepArrays(step.x, step.P, step.Phi, step.Q, step.z, np.where(absent, 0.0, step.H), step.R)
    cut = CutSizes.local([len(g) for g in groups], [len(r) for r in rows])
    assert nodes_counted(local, groups, rows, ~absent, triangular=half).total == decentralised_cost(
        cut, triangular=half
    )
    np.testing.assert_allclose(symmetric_step(local)[1], joseph_step(local)[1], rtol=1e-7, atol=1e-7)


kinds = st.sampled_from([ZERO, UNIT, OTHER])


@settings(max_examples=30, deadline=None)
@given(cuts, st.data(), st.integers(0, 99))
def test_zeros_that_are_left_out_are_those_that_structure_knows(
    parts: list[tuple[int, int]], data: st.DataObject, seed: int
) -> None:
    groups, rows = consecutive([s for s, _ in parts]), consecutive([m for _, m in parts])
    n, m = sum(map(len, groups)), sum(map(len, rows))
    Phi = np.array(data.draw(st.lists(kinds, min_size=n * n, max_size=n * n)), dtype=np.int8).reshape(n, n)
    Phi[np.diag_indices(n)] = np.maximum(Phi.diagonal(), UNIT)  # no Phi is singular
    H = np.array(data.draw(st.lists(kinds, min_size=n * m, max_size=n * m)), dtype=np.int8).reshape(m, n)
    H[:, 0] = OTHER  # a row that reads nothing is no measurement; this one reads other subsystems, too
    step = a_step(n, m, seed)
    made = StepArrays(
        step.x, step.P, np.where(Phi == OTHER, step.Phi, Phi), step.Q, step.z, np.where(H == OTHER, step.H, H), step.R
    )
    for half in (False, True):
        count = nodes_counted(made, groups, rows, H != ZERO, "Phi", "H", triangular=half).total
        assert decentralised_pattern_cost(Phi, H, groups, rows, triangular=half) == count
    found = products(symmetric_step, made, None, "Phi", "H")
    assert predict_cost(Phi) + sum(update_cost(h) for h in H) <= found


def test_a_measurement_of_other_subsystems_reads_their_states() -> None:
    H = np.array([[2, 0, 0, 0, 0], [0, 0, 0, 1, 0]], dtype=np.int8)
    groups = [[0, 1], [2, 3, 4]]
    assert cut_of(H, groups, [[0], [1]]) == CutSizes.local((2, 3), (1, 1))
    assert cut_of(H, groups, [[0, 1], []]).reads == (5, 0)


def test_busiest_node_and_words_of_a_run_are_near_the_formulas() -> None:
    # Halves of a P_ij of 5 x 5 are 15 and 10 entries where the formula has 12.5 each; rows that select a state send M once.
    groups, rows = consecutive((5, 5)), consecutive((1, 1))
    step = a_step(10, 2)
    H = np.zeros((2, 10))
    H[0, 0] = H[1, 5] = 1.0
    made = nodes_counted(StepArrays(step.x, step.P, step.Phi, step.Q, step.z, H, step.R), groups, rows, H != 0.0, "H")
    assert (made.words, made.rounds) == (words_sent(CutSizes.local((5, 5), (1, 1))), 3)
    dense = nodes_counted(step, groups, rows, np.ones((2, 10), dtype=bool))
    assert dense.total == decentralised_cost(CutSizes((5, 5), (1, 1), (10, 10)))
    assert dense.longest == pytest.approx(busiest_processor_cost(CutSizes((5, 5), (1, 1), (10, 10))), rel=0.08)


def test_a_half_of_a_product_is_rounded_once() -> None:
    # 2 states of 3: 4 + 1 = 5 words of P; 1 of 3: 1 + 1 = 2. 1 of 4 (three others): 1 + 1.5 = 2.5.
    assert busiest_processor_cost(CutSizes.local((1,) * 4, (0,) * 4)) == 4 + 16 + 4 * 2.5
    assert busiest_processor_cost(CutSizes.local((1,) * 4, (1, 0, 0, 0))) == 30 + int(np.ceil(1 + 3 + 2 + 2.5))


def test_the_inverse_of_m_rows_takes_m_cubed_products() -> None:
    for m in (1, 2, 5):
        tally, A = Tally(), np.random.default_rng(m).normal(size=(m, m))
        S = A @ A.T + np.eye(m)
        np.testing.assert_allclose(values_of(inverse(counted(S, tally))) @ S, np.eye(m), atol=1e-10)
        assert tally.products == m**3


def test_what_is_known_to_be_zero_or_one_makes_no_product() -> None:
    tally = Tally()
    zero, minus, two = Counted(0.0, tally, known=True), Counted(-1.0, tally, known=True), Counted(2.0, tally)
    assert [(zero * two).value, (minus * two).value, (two * minus - zero + zero).value, (zero / two).value] == [
        0,
        -2,
        -2,
        0,
    ]
    assert tally.products == 0
    assert (two * two / two).value == 2.0 and (1.0 / two).value == 0.5 and tally.products == 3
    assert Counted(0.0, tally).known is False and (Counted(0.0, tally) * two).value == 0.0 and tally.products == 4
