"""The sigma beside an error before and after a correction is the one to go by, and its heading says which it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

from estimfw.report.correction_table import correction_table
from estimfw.run.corrections import corrections, corrections_json

Results = Callable[..., xr.Dataset]


def recorded(dataset: xr.Dataset, honest: float | None) -> xr.Dataset:
    """As if a device had recorded the outputs 1 deg off; the honest sigma is so many times the own one."""
    shape, outputs = dataset["output_value"].shape, dataset.sizes["output"]
    made = dataset.assign(
        output_recorded=dataset["output_value"] + np.radians(1.0),
        output_error_scale=(("time", "output"), np.ones(shape)),
        output_error_unit=("output", [""] * outputs),
        output_period=("output", np.full(outputs, 2 * np.pi)),
    )
    return made if honest is None else made.assign(output_honest_sigma=honest * made["output_sigma"])


@pytest.mark.parametrize("truth", [True, False])
def test_the_honest_sigma_is_shown_where_there_is_one(make_result: Results, truth: bool) -> None:
    plain, reduced = (recorded(make_result(truth=truth), honest) for honest in (None, 5.0))
    where = " at the end" if truth else " after"
    own, honest = (correction_table(one) for one in (plain, reduced))
    assert "σ" + where in own.head and "honest σ" + where in honest.head
    column = own.head.index("σ" + where)
    for before, after in zip(own.rows, honest.rows, strict=True):
        assert float(after[column].text) == pytest.approx(5.0 * float(before[column].text), rel=0.06)


def test_json_has_both_as_everywhere(make_result: Results) -> None:
    told = corrections_json(recorded(make_result(), 5.0))
    assert all(one["honest_sigma"] == pytest.approx(5.0 * one["sigma"]) for one in told.values())
    assert all("honest_sigma" not in one for one in corrections_json(recorded(make_result(), None)).values())
    assert len(told) == len(corrections(recorded(make_result(), None)))
