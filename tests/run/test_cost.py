"""The gravimeter's work is the published one, by formula and counted; where several processors pay is told."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from estimfw.analysis.cost import step_cost
from estimfw.analysis.speed_up import Link
from estimfw.config.compose import Problem
from estimfw.errors import ConfigError
from estimfw.run.cost import Costed, Nodes, cost_of_filter, nodes_by_groups
from estimfw.run.partition import partition_filter
from tests.run.gravimeter_text import gravimeter

Composed = Callable[[str], Problem]
Example = Callable[..., Problem]
NETWORK = Link(50e-6, 64e-9, 1e-9)


@pytest.fixture(scope="module")
def costed(composed: Composed) -> Costed:
    problem = composed(gravimeter(30, 60))
    return cost_of_filter(problem, NETWORK, nodes_by_groups(problem, partition_filter(problem, 2, price=False)))


def test_the_published_row_of_ten_states(costed: Costed) -> None:
    # The specification of the gravimeter's alignment, section 3: textbook, scalar dense and selector, about 850 without zeros.
    assert [costed.products(k) for k in ("textbook", "symmetric", "selecting", "pattern")] == [3628, 2040, 1800, 850]
    cut = costed.cut
    assert cut is not None and costed.selecting
    assert [cut.products(k) for k in ("decentralised", "triangular", "busiest")] == [2162, 1922, 1092]
    assert cut.products("decentralised_selecting") == 1802  # "with selector rows on both sides it is 1802 against 1800"
    assert cut.words == 89 and cut.products("decentralised") / costed.products("textbook") == pytest.approx(
        0.596, abs=5e-4
    )


def test_every_form_that_runs_takes_what_its_formula_says(costed: Costed) -> None:
    cut = costed.cut
    assert cut is not None
    for form in (*(f for f in costed.forms if f.key != "ud"), *cut.forms):
        if form.key == "busiest":  # 13 and 12 of the 25 entries of P_12 are not a half each
            assert form.counted == 1142
        else:
            assert form.counted == form.products, form.key
    assert (cut.counted_words, cut.counted_rounds) == (89, 3)


def test_alpha_of_zero_has_more_zeros(composed: Composed) -> None:
    turned = cost_of_filter(composed(gravimeter(30, 60)), NETWORK)
    straight = cost_of_filter(composed(gravimeter(0, 60)), NETWORK)
    assert straight.products("pattern") <= turned.products("pattern")
    assert straight.products("symmetric") == turned.products("symmetric") and straight.cut is None


def test_rows_of_other_nodes_are_charged_for_what_they_read(composed: Composed) -> None:
    problem = composed(gravimeter(30, 60))
    crossed = Nodes(("a", "b"), ((0, 2, 3, 5, 6), (1, 4, 7, 8, 9)), ((1,), (0,)))
    cut = cost_of_filter(problem, NETWORK, crossed).cut
    assert cut is not None and cut.sizes.reads == (5, 5)
    assert cut.products("decentralised") == 2162
    # A row that reads states of another node alone is the same work; its reading has to be sent first.
    assert cut.counted_rounds == 5


def test_counting_can_be_asked_for_and_left_out(composed: Composed) -> None:
    assert all(f.counted is None for f in cost_of_filter(composed(gravimeter(0, 60)), NETWORK, counted=False).forms)


def test_work_by_pattern_is_that_of_a_comparison(example: Example) -> None:
    problem = example("tracker", "source.duration=20 s")
    costed = cost_of_filter(problem, NETWORK)
    layout = problem.plan.layout
    priced = step_cost(problem.plan, "ud", layout.complete(layout.pack(problem.reference)))
    assert costed.products("pattern") == priced.predict + priced.update
    assert costed.products("ud") == priced.as_run


def test_a_plan_that_varies_says_what_is_not_counted(example: Example) -> None:
    costed = cost_of_filter(example("static_12"), NETWORK)
    assert "C_bn" in costed.varying or "f_n" in costed.varying


def test_what_has_no_products_to_count_is_refused(composed: Composed, example: Example) -> None:
    with pytest.raises(ConfigError, match="determination"):
        cost_of_filter(example("odometer_adba"), NETWORK)
    with pytest.raises(ConfigError, match="unscented"):
        cost_of_filter(composed(gravimeter(0, 60, "{kind: unscented}")), NETWORK)


def test_correlated_noises_are_told_to_be_left_out(composed: Composed) -> None:
    text = gravimeter(0, 60)
    assert not cost_of_filter(composed(text), NETWORK).correlated
    correlated = composed(text.replace("noise: 0.01 m/s}", "noise: 0.01 m/s, correlation: [[1, 0.5], [0.5, 1]]}"))
    assert cost_of_filter(correlated, NETWORK).correlated


def test_of_a_bank_one_member_is_counted(example: Example) -> None:
    assert cost_of_filter(example("static_bank"), NETWORK, counted=False).members
