"""Coefficients against NumPy: whatever is built from the vocabulary has the value that the matrices have."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from estimfw.model.coefficient import Coefficient, constant, identity, matrix, scalar, skew, vector, zeros
from estimfw.model.polynomial import Factor, Polynomial, canonical, constant_of

FloatArray = NDArray[np.float64]

RNG = np.random.default_rng(20)
#: Five epochs: leading axes must make no difference.
NOMINAL: Mapping[str, FloatArray] = {
    "C_bn": RNG.normal(size=(5, 3, 3)),
    "A": RNG.normal(size=(5, 3, 3)),
    "f_n": RNG.normal(size=(5, 3)),
    "w_n": RNG.normal(size=(3,)),
    "g": RNG.normal(size=(5,)),
}


def cross_matrix(v: FloatArray) -> FloatArray:
    """[v x] (..., 3, 3), a column at a time by np.cross."""
    return np.stack([np.cross(v, axis) for axis in np.eye(3)], axis=-1)


@dataclass(frozen=True)
class Pair:
    """A coefficient and what it should be worth."""

    made: Coefficient
    worth: FloatArray

    def agrees(self) -> bool:
        scale = max(1.0, float(np.max(np.abs(self.worth), initial=0.0)))
        return bool(np.allclose(self.made.evaluate(NOMINAL), self.worth, rtol=0.0, atol=1e-12 * scale))


small = st.integers(-3, 3).map(float)
leaves = st.one_of(
    st.sampled_from(["C_bn", "A"]).map(lambda n: Pair(matrix(n), NOMINAL[n])),
    st.sampled_from(["f_n", "w_n"]).map(lambda n: Pair(skew(n), cross_matrix(NOMINAL[n]))),
    st.tuples(small, small, small).map(lambda v: Pair(skew(v), cross_matrix(np.array(v)))),
    st.lists(small, min_size=9, max_size=9).map(
        lambda x: Pair(constant(np.reshape(x, (3, 3))), np.reshape(np.array(x), (3, 3)))
    ),
    st.just(Pair(identity(3), np.eye(3))),
    st.just(Pair(zeros(3, 3), np.zeros((3, 3)))),
)


def grown(inner: st.SearchStrategy[Pair]) -> st.SearchStrategy[Pair]:
    both = st.tuples(inner, inner)
    return st.one_of(
        both.map(lambda p: Pair(p[0].made + p[1].made, p[0].worth + p[1].worth)),
        both.map(lambda p: Pair(p[0].made - p[1].made, p[0].worth - p[1].worth)),
        both.map(lambda p: Pair(p[0].made @ p[1].made, p[0].worth @ p[1].worth)),
        inner.map(lambda p: Pair(p.made.T, np.swapaxes(p.worth, -1, -2))),
        inner.map(lambda p: Pair(-p.made, -p.worth)),
        st.tuples(small, inner).map(lambda p: Pair(p[0] * p[1].made, p[0] * p[1].worth)),
        inner.map(lambda p: Pair(p.made * scalar("g"), p.worth * NOMINAL["g"][:, None, None])),
        inner.map(lambda p: Pair(scalar("g") * p.made, p.worth * NOMINAL["g"][:, None, None])),
    )


expressions = st.recursive(leaves, grown, max_leaves=6)


@given(expressions)
def test_an_expression_is_worth_what_numpy_makes_of_it(pair: Pair) -> None:
    assert pair.agrees()


@given(expressions)
def test_what_lies_outside_the_zero_pattern_is_zero(pair: Pair) -> None:
    assert not np.any(np.broadcast_to(pair.worth, (5, 3, 3))[:, ~pair.made.pattern] > 1e-9)
    assert not np.any(pair.made.evaluate(NOMINAL)[..., ~pair.made.pattern])


@given(expressions)
def test_only_what_it_needs_changes_the_value(pair: Pair) -> None:
    moved = {n: v if n in pair.made.needs else v + 1.0 for n, v in NOMINAL.items()}
    assert np.array_equal(pair.made.evaluate(moved), pair.made.evaluate(NOMINAL))
    assert pair.made.is_constant == (not pair.made.needs)


@given(expressions)
def test_a_pickle_comes_back_equal_with_its_hash_and_its_latex(pair: Pair) -> None:
    back = pickle.loads(pickle.dumps(pair.made))
    assert back == pair.made
    assert hash(back) == hash(pair.made)
    assert back.form == pair.made.form


@given(leaves, leaves, leaves)
def test_equality_does_not_depend_on_how_a_sum_was_written(a: Pair, b: Pair, c: Pair) -> None:
    left, right = (a.made + b.made) @ c.made, a.made @ c.made + b.made @ c.made
    assert left == right
    assert hash(left) == hash(right)
    assert (a.made - a.made).is_zero


@given(expressions, st.permutations([0, 1, 2]), st.integers(1, 3), st.integers(1, 3))
def test_a_selection_is_numpys(pair: Pair, order: list[int], rows: int, columns: int) -> None:
    chosen = pair.made.select(order[:rows], order[::-1][:columns])
    worth = pair.worth[..., order[:rows], :][..., order[::-1][:columns]]
    assert Pair(chosen, worth).agrees()


@given(expressions, st.integers(0, 3), st.integers(0, 2))
def test_embedding_puts_it_into_zeros(pair: Pair, row: int, column: int) -> None:
    worth = np.zeros((*pair.worth.shape[:-2], 6, 5))
    worth[..., row : row + 3, column : column + 3] = pair.worth
    assert Pair(pair.made.embed((6, 5), row, column), worth).agrees()


@given(expressions, st.tuples(small, small))
def test_a_substitution_is_the_value_at_that_nominal(pair: Pair, numbers: tuple[float, float]) -> None:
    values: dict[Factor, Polynomial] = {
        ("f_n", (0,)): canonical([(numbers[0], ())]),
        ("f_n", (1,)): canonical([(numbers[1], ())]),
        ("f_n", (2,)): canonical([(1.0, (("g", ()),))]),
    }
    held = pair.made.substitute(values)
    force = np.stack([np.full(5, numbers[0]), np.full(5, numbers[1]), NOMINAL["g"]], axis=-1)
    assert "f_n" not in held.needs
    wanted = pair.made.evaluate({**NOMINAL, "f_n": force})
    scale = max(1.0, float(np.max(np.abs(wanted))))
    assert np.allclose(held.evaluate(NOMINAL), wanted, rtol=0.0, atol=1e-12 * scale)


def test_a_skew_matrix_crosses() -> None:
    u = RNG.normal(size=3)
    made = skew("w_n") @ constant(u)
    assert np.allclose(made.evaluate(NOMINAL)[..., 0], np.cross(NOMINAL["w_n"], u), rtol=1e-14)


def test_a_product_of_vectors_is_an_outer_product() -> None:
    made = vector("f_n") @ vector("w_n").T
    wanted = NOMINAL["f_n"][:, :, None] * NOMINAL["w_n"]
    assert np.allclose(made.evaluate(NOMINAL), wanted, rtol=1e-14)


def test_a_multiple_of_the_identity_is_isotropic_and_nothing_else_is() -> None:
    assert (3.0 * identity(3)).isotropic == ((3.0, ()),)
    assert (identity(3) * scalar("g")).isotropic == ((1.0, (("g", ()),)),)
    assert constant(np.diag([1.0, 1.0, 2.0])).isotropic is None
    assert constant(np.ones((3, 3))).isotropic is None
    assert (
        matrix("C_bn") @ matrix("C_bn").T
    ).isotropic is None  # it is, for a rotation; a matrix variable need not be one
    assert zeros(3, 3).isotropic is None


def test_a_number_is_recognised_among_polynomials() -> None:
    assert constant_of(()) == 0.0
    assert constant_of(canonical([(2.0, ()), (1.0, ())])) == 3.0
    assert constant_of(canonical([(2.0, (("g", ()),))])) is None


@pytest.mark.parametrize(
    ("build", "latex"),
    [
        (lambda: -2.0 * skew("earth_rate_n"), r"-2\,[<earth_rate_n>\times]"),
        (lambda: matrix("C_bn") @ skew("f_b"), r"<C_bn>\,[<f_b>\times]"),
        (lambda: (skew("f_n") + matrix("A")) @ matrix("C_bn"), r"([<f_n>\times] + <A>)\,<C_bn>"),
        (lambda: -1.0 * -skew("f_n"), r"-(-[<f_n>\times])"),
        (lambda: 2.0 * (skew("f_n") + matrix("A")), r"2\,([<f_n>\times] + <A>)"),
        (lambda: constant(np.eye(3)) @ skew("f_n"), ""),  # numbers have no symbol, so the product has none
        (lambda: matrix("C_bn").T, r"(<C_bn>)^{T}"),
    ],
)
def test_the_form_is_that_of_the_expression_with_room_for_symbols(build: object, latex: str) -> None:
    assert callable(build)
    assert build().form == latex


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="do not add"):
        identity(3) + identity(2)
    with pytest.raises(ValueError, match="do not multiply"):
        identity(3) @ identity(2)
    with pytest.raises(ValueError, match="use @"):
        identity(3) * identity(3)
