"""The conformance kit: what a plugin's own tests can have checked.

Each check takes a composed filter that uses the plugin, and raises AssertionError with what is wrong::

    from estimfw import open_filter
    from estimfw.testing import (
        check_draws, check_jacobians, check_measurements, check_outputs, check_preprocess, check_provider,
    )

    def test_my_sensor() -> None:
        problem = open_filter("my_filter.yaml")
        check_jacobians(problem)        # H against finite differences on the provider's own manifold
        check_measurements(problem)     # rows of H against the innovation of a disturbed nominal
        check_outputs(problem)          # Jacobians against finite differences
        check_provider(problem)         # a pure scan over leading axes; compiled as plain
        check_preprocess(problem)       # the same for runs side by side, and row by row in a session
        check_draws(problem)            # a source of Monte Carlo runs: each made by its seed alone
"""

from __future__ import annotations

from estimfw.testing.draws import check_draws
from estimfw.testing.jacobians import check_jacobians
from estimfw.testing.measurements import check_measurements
from estimfw.testing.outputs import check_outputs
from estimfw.testing.preprocess import check_preprocess
from estimfw.testing.provider import check_provider

__all__ = [
    "check_draws",
    "check_jacobians",
    "check_measurements",
    "check_outputs",
    "check_preprocess",
    "check_provider",
]
