"""Work that no memory holds is refused before it begins, with the estimate."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from estimfw.errors import ConfigError

__all__ = ["available_bytes", "refuse_too_large"]

#: Part of the machine's memory that one run may fill.
_SHARE = 0.5
_CGROUP_LIMITS = (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"))


def available_bytes() -> float:
    """Half of the memory of this machine, or of the container around this process."""
    limits = [4.0 * 2**30]
    with suppress(ValueError, OSError, AttributeError):  # no such names on some systems
        limits = [float(os.sysconf("SC_PHYS_PAGES")) * float(os.sysconf("SC_PAGE_SIZE"))]
    for path in _CGROUP_LIMITS:
        with suppress(ValueError, OSError):  # no such file, or "max"
            limits.append(float(path.read_text()))
    return _SHARE * min(limits)


def refuse_too_large(needed: float, what: str, hint: str, within: tuple[str | int, ...] = ()) -> None:
    """Raise `ConfigError` where ``needed`` bytes are more than `available_bytes`.

    Parameters
    ----------
    needed : float
        An estimate, in bytes.
    what : str
        What needs them, with its numbers: ``2e+09 steps of 4 states``.
    hint : str
        What to make smaller.
    within : tuple of str and int
        See `EstimfwError`.
    """
    there = available_bytes()
    if needed > there:
        raise ConfigError(
            f"{what} need about {needed / 2**30:.3g} GiB of memory, {there / 2**30:.3g} GiB may be used",
            hint=hint,
            within=within,
        )
