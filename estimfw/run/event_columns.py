"""Events as variables of a result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from estimfw.data.record import Event

__all__ = ["event_columns"]


def event_columns(events: Sequence[Event]) -> dict[str, Any]:
    """``event_time``, ``event_source``, ... over the dimension ``event``; nothing where there are none."""
    if not events:
        return {}
    return {
        "event_time": ("event", np.array([e.time for e in events], dtype=float)),
        "event_source": ("event", [e.source for e in events]),
        "event_kind": ("event", [e.kind for e in events]),
        "event_text": ("event", [e.text for e in events]),
        "event_count": ("event", np.array([e.count for e in events], dtype=np.int64)),
    }
