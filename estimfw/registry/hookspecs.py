"""The hook that a plugin implements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    from estimfw.registry.component import Component

__all__ = ["PROJECT", "estimfw_components", "hookimpl"]

#: The pluggy project, and the entry point group.
PROJECT = "estimfw"

hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def estimfw_components() -> list[Component]:  # type: ignore[empty-body]
    """Everything that the plugin brings; called once, when the program starts."""
