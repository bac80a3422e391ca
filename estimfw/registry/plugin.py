"""A plugin as it was found: loaded, failed, or made for another program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from estimfw.registry.component import Component

__all__ = ["CORE", "Plugin", "Status"]

#: Under this name the framework itself stands among the plugins; its components have bare names.
CORE = "estimfw"

Status = Literal["loaded", "failed", "incompatible"]


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plugin and what became of it.

    Attributes
    ----------
    name : str
        The name of its entry point, which leads the ids of its components.
    distribution, version : str
        Who brought it.
    status : 'loaded', 'failed' or 'incompatible'
    components : tuple of Component
        Empty unless loaded.
    reason : str
        One line, unless loaded.
    traceback : str
        Of what it raised; empty where it raised nothing.
    cause : BaseException or None
        What it raised.
    """

    name: str
    distribution: str
    version: str
    status: Status
    components: tuple[Component, ...] = ()
    reason: str = ""
    traceback: str = ""
    cause: BaseException | None = None

    @property
    def origin(self) -> str:
        """``estimfw-inertial 0.1.0``."""
        return f"{self.distribution} {self.version}"

    def id_of(self, component: Component) -> str:
        """The ``kind`` by which a config names one of its components."""
        return component.name if self.name == CORE else f"{self.name}.{component.name}"
