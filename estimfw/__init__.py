"""estimfw: a Kalman estimation framework in which a filter is data.

From Python::

    import estimfw

    problem = estimfw.open_filter("examples/static_7.yaml", ["source.seed=2"])   # model, policies, plan; no data yet
    result = estimfw.run_filter(problem)                                         # an xarray.Dataset with labels and units
    result["output_sigma"].sel(output="attitude.yaw")

    session = estimfw.Session(problem)                                           # or sample by sample
    estimate = session.push(time, increments)
    raw = estimfw.PreprocessingSession(problem, record.streams)                  # with a section preprocess: raw rows
    estimates = raw.feed("odometer", time, counts)

What a plugin needs is public too: `estimfw.config.types` (settings and quantities), `estimfw.model` (the language),
`estimfw.data.record` (streams), `estimfw.registry.component` (the hand-over), `estimfw.errors`, and `estimfw.testing`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from estimfw.version import __version__

if TYPE_CHECKING:
    from estimfw.run.from_python import open_filter, run_filter
    from estimfw.run.preprocessing_session import PreprocessingSession
    from estimfw.run.session import Session

__all__ = ["PreprocessingSession", "Session", "__version__", "open_filter", "run_filter"]

_PLACES = {
    "open_filter": "estimfw.run.from_python",
    "run_filter": "estimfw.run.from_python",
    "PreprocessingSession": "estimfw.run.preprocessing_session",
    "Session": "estimfw.run.session",
}


def __getattr__(name: str) -> object:
    """Public names, imported when they are asked for: the command line must start without numpy."""
    if name not in _PLACES:
        raise AttributeError(f"module 'estimfw' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_PLACES[name]), name)
