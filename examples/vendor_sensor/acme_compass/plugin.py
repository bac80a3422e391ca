"""What Acme brings to estimfw."""

from __future__ import annotations

import pluggy

from acme_compass import baseline, log
from estimfw.registry.component import Component

__all__ = ["ESTIMFW_API", "estimfw_components"]

ESTIMFW_API = 1
hookimpl = pluggy.HookimplMarker("estimfw")


@hookimpl
def estimfw_components() -> list[Component]:
    """All components, by role."""
    return [
        Component("measurement", "baseline", baseline.BaselineConfig, baseline.baseline, "baseline of a GNSS compass"),
        Component("source", "compass_log", log.CompassLogConfig, log.compass_log, "log of a GNSS compass (CSV)"),
    ]
