"""What this installation can do: the framework's components and those of all installed plugins."""

from __future__ import annotations

from functools import cache

from estimfw.config.generic.components import core_components
from estimfw.registry.load import load_plugins
from estimfw.registry.registry import Registry

__all__ = ["installed_components"]


@cache
def installed_components() -> Registry:
    """The registry of this process; plugins are imported at the first call."""
    return load_plugins(core_components())
