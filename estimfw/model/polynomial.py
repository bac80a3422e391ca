"""Sums of products of nominal scalars and constants: the entries of a coefficient.

A *factor* is one scalar of the nominal, ``(variable, index)``. A *monomial* is a constant and its factors, sorted.
A *polynomial* is a tuple of monomials in canonical order, like terms merged, zeros gone; the empty tuple is zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["ZERO", "Factor", "Monomial", "Polynomial", "add", "canonical", "constant_of", "multiply", "substitute"]

Factor = tuple[str, tuple[int, ...]]
Monomial = tuple[float, tuple[Factor, ...]]
Polynomial = tuple[Monomial, ...]

ZERO: Polynomial = ()


def canonical(monomials: Iterable[Monomial]) -> Polynomial:
    """Merge like terms, drop zeros, sort."""
    total: dict[tuple[Factor, ...], float] = {}
    for constant, factors in monomials:
        total[factors] = total.get(factors, 0.0) + constant
    return tuple((total[factors], factors) for factors in sorted(total) if total[factors] != 0.0)


def add(*polynomials: Polynomial) -> Polynomial:
    return canonical(monomial for polynomial in polynomials for monomial in polynomial)


def multiply(left: Polynomial, right: Polynomial) -> Polynomial:
    return canonical((a * b, tuple(sorted(f + g))) for a, f in left for b, g in right)


def substitute(polynomial: Polynomial, values: Mapping[Factor, Polynomial]) -> Polynomial:
    """Replace factors by polynomials."""
    result: Polynomial = ZERO
    for constant, factors in polynomial:
        product: Polynomial = ((constant, ()),)
        for factor in factors:
            product = multiply(product, values.get(factor, ((1.0, (factor,)),)))
        result = add(result, product)
    return result


def constant_of(polynomial: Polynomial) -> float | None:
    """The value of a polynomial without factors, None if it has some."""
    if not polynomial:
        return 0.0
    if len(polynomial) == 1 and not polynomial[0][1]:
        return polynomial[0][0]
    return None
