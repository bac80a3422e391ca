"""What a plugin's code breaks is told as the plugin's fault, with its name and version, never as ours.

Only code of plugins is guarded: an exception in the framework's own components is a bug of ours and says so.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from estimfw.errors import EstimfwError, Location, PluginError

__all__ = ["broken", "plugin_code", "wrong_number"]


@contextmanager
def plugin_code(owner: str | None, what: str) -> Iterator[None]:
    """Turn an exception of a plugin into a `PluginError`.

    Parameters
    ----------
    owner : str or None
        ``plugin 'radar' (acme-radar 1.2)``; None: the framework's own code, which is not guarded.
    what : str
        The object at work: ``source 'radar.log'``.
    """
    try:
        yield
    except EstimfwError:
        raise
    except Exception as cause:
        if owner is None:
            raise
        last = traceback.extract_tb(cause.__traceback__)[-1]
        told = f"{type(cause).__name__}: {str(cause).splitlines()[0] if str(cause) else ''}"
        raise PluginError(
            f"{owner}: {what} raised {told.rstrip(': ')}",
            hint=f"in {Path(last.filename).name}, line {last.lineno}; --debug shows the traceback; tell the plugin's author",
        ) from cause


def broken(owner: str | None, what: str, found: str, location: Location | None = None) -> PluginError:
    """The error for an object that is not what its role needs."""
    hint = "the plugin breaks its contract; estimfw.testing has the checks that its author needs"
    return PluginError(f"{owner or 'the framework'}: {what} {found}", location=location, hint=hint)


def wrong_number(values: ArrayLike, shape: tuple[int, ...]) -> str | None:
    """Why these are not finite numbers of a shape; None if they are."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        return "is not made of numbers"
    if array.shape != shape:
        return f"has the shape {array.shape}, {shape} is due"
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        at = "" if not shape else f"[{', '.join(str(i) for i in bad[0])}]"
        return f"holds {array[tuple(bad[0])]} {'at ' + at if at else ''}".rstrip()
    return None
