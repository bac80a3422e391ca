"""drop_term takes away one term's part of F or G, and nothing else."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.errors import ConfigError
from estimfw.model.coefficient import zeros
from estimfw.model.model import Model
from estimfw.model.parts import ProcessTerm
from estimfw.policies.drop_term import DropTerm

FloatArray = NDArray[np.float64]
Inertial = Callable[..., Model]


def test_the_terms_part_of_F_goes_and_the_rest_stays_to_the_last_bit(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    model = inertial()
    after, change = DropTerm(("coriolis",)).apply(model, reference)
    before = model.F.coefficient.evaluate(reference)
    w = reference["earth_rate_n"]
    assert np.array_equal(before[:3, :3], -2.0 * np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]]))
    before[:3, :3] = 0.0
    assert np.array_equal(after.F.coefficient.evaluate(reference), before)
    assert change.removed_terms == ("coriolis",)
    assert change.removed_states == ()
    assert change.before == change.after == model.states


def test_the_change_says_how_large_the_term_was(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    _, change = DropTerm(("coriolis",)).apply(inertial(), reference)
    assert change.kind == "approximate"
    assert change.measures[0].value == pytest.approx(2.0 * reference["earth_rate_n"].max(), rel=1e-15)


def test_a_mirrored_term_is_lost_on_both_sides(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    assert DropTerm(("coriolis",), mirrored=True).apply(inertial(), reference)[1].kind == "mirrored"


def test_a_term_that_is_zero_at_the_reference_alone_is_not_called_exact(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    """f_n may come alive during the run; only a term without any coefficient is dropped for nothing."""
    at_rest = {**reference, "f_n": np.zeros(3)}
    _, change = DropTerm(("gravity_tilt",)).apply(inertial(), at_rest)
    assert (change.kind, change.measures[0].value) == ("approximate", 0.0)
    model = inertial()
    empty = ProcessTerm("nothing", "v", "v", zeros(3, 3), "n")
    assert DropTerm(("nothing",)).apply(model.with_parts(terms=(*model.terms, empty)), reference)[1].kind == "exact"


def test_a_noise_that_drives_nothing_any_more_goes_with_its_term(
    inertial: Inertial, reference: dict[str, FloatArray]
) -> None:
    after, change = DropTerm(("accel_noise_coupling",)).apply(inertial(), reference)
    assert change.removed_noises == ("wa[E]", "wa[N]", "wa[U]")
    assert after.G.columns == ("we[E]", "we[N]", "we[U]")
    assert np.array_equal(np.diag(after.diffusion.evaluate(reference)), [0.0] * 3 + [8e-14] * 3 + [0.0] * 6)


def test_a_term_is_dropped_by_its_alias(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    model = inertial()
    renamed = tuple(
        ProcessTerm("v_cross", "v", "v", t.coefficient, "n", aliases=("coriolis",)) if t.label == "coriolis" else t
        for t in model.terms
    )
    after, change = DropTerm(("coriolis",)).apply(model.with_parts(terms=renamed), reference)
    assert change.removed_terms == ("v_cross",)
    assert after.terms == DropTerm(("coriolis",)).apply(model, reference)[0].terms


def test_a_term_that_is_not_there_names_the_nearest(inertial: Inertial, reference: dict[str, FloatArray]) -> None:
    with pytest.raises(ConfigError, match="no process term 'coriollis'") as caught:
        DropTerm(("coriollis",)).apply(inertial(), reference)
    assert "did you mean 'coriolis'" in str(caught.value)
