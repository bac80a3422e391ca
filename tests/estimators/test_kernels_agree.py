"""The compiled kernel and the NumPy one are the same filter: to 1e-10 of a sigma, provider included."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimfw.config.compose import Problem
from estimfw.estimators.scan import ChunkResult
from estimfw.kernels.fuse import FUSED, GATED
from estimfw.run.load import load_record
from estimfw.run.prepare import make_chunk, prepare

FloatArray = NDArray[np.float64]
Example = Callable[..., Problem]

CLOSED = (
    "estimator={kind: kalman, loop: closed, gate: 0.8}", "policies=[]", "nominal.samples=2", "source.rate=100 Hz",
    "source.duration=3 s", "source.velocity_noise=0.1 m/s", "measurements.zero_velocity.reference=velocity_reference",
    "source.sway={amplitude: [1 deg, 2 deg, 3 deg], period: 4 s}",
)  # fmt: skip
CASES = {
    "tracker": ("tracker", ()),
    "tracker, Joseph": ("tracker", ("estimator.covariance=joseph",)),
    "tracker, restarted": ("tracker", ("estimator.restarts=[30.3 s, 60 s]",)),
    "thermal": ("thermal", ()),
    "thermal, held noise": ("thermal", ("estimator.discretisation.method=held_noise",)),
    "static 12, open": ("static_12", ()),
    "static 12, open, exact, Joseph": (
        "static_12",
        ("source.duration=200 s", "estimator={kind: kalman, covariance: joseph}"),
    ),
    "static 10, staged": ("static_10", ("source.duration=200 s", "estimator.restarts=[60 s, 120.5 s]")),
    "static 7": ("static_7", ("source.duration=200 s",)),
    "closed loop at 100 Hz, swaying": ("static_12", CLOSED),
    "closed loop, terms at the start": ("static_12", (*CLOSED, "estimator.discretisation={evaluation: start}")),
    "closed loop, terms at the end": ("static_12", (*CLOSED, "estimator.discretisation={evaluation: end}")),
}


def outcome(problem: Problem, kernel: str) -> ChunkResult:
    """The whole run in one chunk."""
    estimator = problem.estimator.model_copy(update={"kernel": kernel})
    prepared = prepare(Problem(**{**vars(problem), "estimator": estimator}), load_record(problem))
    assert prepared.scan.name == kernel
    _, result = prepared.scan.run(prepared.state, make_chunk(prepared, 0, len(prepared.steps)))
    return result


@pytest.mark.parametrize("case", CASES)
def test_compiled_and_numpy_kernels_agree(example: Example, case: str) -> None:
    name, overrides = CASES[case]
    problem = example(name, *overrides)
    numpy, numba = (outcome(problem, kernel) for kernel in ("numpy", "numba"))
    sigma = np.sqrt(np.einsum("kii->ki", numpy.covariance))
    assert np.max(np.abs(numpy.estimate - numba.estimate) / sigma) < 1e-10
    spread = sigma[:, :, None] * sigma[:, None, :]
    assert np.max(np.abs(numpy.covariance - numba.covariance) / spread) < 1e-9
    np.testing.assert_array_equal(numpy.disposition, numba.disposition)
    np.testing.assert_array_equal(numpy.used, numba.used)
    np.testing.assert_allclose(numpy.sigma, numba.sigma, rtol=1e-9)
    assert np.nanmax(np.abs(numpy.innovation - numba.innovation) / numpy.sigma) < 1e-9
    np.testing.assert_allclose(numpy.nis, numba.nis, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(numpy.log_det, numba.log_det, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(np.isfinite(numpy.log_det), np.isin(numpy.disposition, (FUSED, GATED)))


def test_the_closed_loop_case_gates_and_corrects(example: Example) -> None:
    # What the comparison above would not show if nothing happened in it.
    problem = example("static_12", *CLOSED)
    result = outcome(problem, "numba")
    assert set(np.unique(result.disposition)) == {0, 1}
    start = example("static_12", *CLOSED, "estimator.loop=open")
    assert np.max(np.abs(outcome(start, "numba").rows[-1, :9] - result.rows[-1, :9])) > 1e-3


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("loop", ["open", "closed"])
def test_both_scan_the_provider_alike(example: Example, samples: int, loop: str) -> None:
    problem = example("static_12", *CLOSED, f"nominal.samples={samples}", f"estimator.loop={loop}")
    numpy, numba = (outcome(problem, kernel).rows for kernel in ("numpy", "numba"))
    size = np.max(np.abs(numpy), axis=0)
    assert np.max(size) > 9.0
    np.testing.assert_allclose(numba, numpy, rtol=0.0, atol=float(1e-12 * np.max(size)))
    assert np.max(np.abs(numpy[:, :9] - numba[:, :9])) < 1e-12
