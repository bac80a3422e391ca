"""A standing vehicle whose heading nobody knows: a bank of headings finds it; honest sigmas are those of the reported member."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from estimfw.config.compose import Problem
from estimfw.data.record import Record
from estimfw.model.nominal import InitialNominal
from estimfw.run.dataset import result_dataset
from estimfw.run.load import load_record
from estimfw.run.run import run_problem

Example = Callable[..., Problem]
DEGREE = np.pi / 180


@dataclass(frozen=True)
class There:
    """A start that is known."""

    start: InitialNominal

    def find(self, record: Record) -> InitialNominal:
        return self.start


@pytest.mark.parametrize("heading", [20.0, 118.0, -160.0])
def test_eight_headings_find_the_heading_from_nothing(composed: Example, heading: float) -> None:
    problem = composed(
        "static_bank",
        f"source.misalignment=[0.3 deg, -0.2 deg, {heading} deg]",
        "source.rate=4 Hz",
        "source.duration=120 s",
    )
    done = run_problem(problem)
    dataset = result_dataset(done)
    np.testing.assert_allclose(dataset["bank_weight"].sum("member"), 1.0, rtol=1e-14)
    error, sigma = (
        dataset["output_error"].sel(output="attitude.yaw"),
        dataset["output_sigma"].sel(output="attitude.yaw"),
    )
    np.testing.assert_allclose(dataset["bank_weight"][0], 1 / 8, rtol=1e-3)
    assert abs(float(error[-1])) < 3.0 * float(sigma[-1]) < 1.0 * DEGREE
    # The reported start is within half a spacing and its neighbour, where the members still overlap.
    away = {
        label: float(label.split()[1]) if "given" not in label else 0.0
        for label in map(str, dataset["member"].to_numpy())
    }
    best = str(dataset["member"].to_numpy()[int(dataset["bank_member"][-1])])
    assert abs((away[best] - heading + 180.0) % 360.0 - 180.0) < 45.0


def test_one_filter_from_the_given_start_does_not_find_it(composed: Example) -> None:
    # What the bank is for.
    overrides = ("source.rate=4 Hz", "source.duration=120 s")
    single = composed("static_bank", *overrides, "estimator={kind: kalman, loop: closed}")
    yaw = run_problem(single).output_error
    assert yaw is not None and abs(float(yaw[-1, 0])) > 3.0 * DEGREE


def test_the_honest_sigma_of_a_reduced_bank_is_that_of_the_reported_member(composed: Example) -> None:
    reduced = ("policies=[sins_static.remove_vertical_channel]", "source.rate=1 Hz", "source.duration=30 s")
    bank = composed("static_bank", *reduced)
    record = load_record(bank)
    done = run_problem(bank, record=record)
    assert done.bank is not None and done.honest is not None
    assert len(set(done.bank.best.tolist())) > 1
    for member in sorted(set(done.bank.best.tolist()))[-2:]:
        started = done.prepared.members[member].start
        alone = composed("static_bank", *reduced, "estimator={kind: kalman, loop: closed}")
        single = run_problem(replace(alone, initial=There(started)), record=record)
        assert single.honest is not None
        at = done.bank.best == member
        np.testing.assert_array_equal(done.honest.sigma[at], single.honest.sigma[at])
        np.testing.assert_array_equal(done.honest.output_sigma[at], single.honest.output_sigma[at])
