"""The record by which a plugin hands over one component."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

__all__ = ["API_VERSION", "ROLES", "Component", "Role"]

#: Number of the interface between framework and plugins; a plugin made for another one is refused.
API_VERSION = 1

Role = Literal[
    "block",
    "process",
    "measurement",
    "policy",
    "nominal",
    "initial",
    "source",
    "estimator",
    "monitor",
    "input",
    "preprocess",
]
ROLES: tuple[Role, ...] = (
    "block", "process", "measurement", "policy", "nominal", "initial", "source", "estimator", "monitor", "input",
    "preprocess",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Component:
    """One thing that a config can name by ``kind``.

    Attributes
    ----------
    role : str
        The section of the config it may stand in: ``block``, ``process``, ``measurement``, ``policy``, ``nominal``,
        ``initial`` (how the start is found), ``source``, ``estimator``, ``monitor``, ``input``,
        ``preprocess`` (what is done to the streams before the filter sees them).
    name : str
        Without the plugin's name; its id becomes ``plugin.name``.
    config : pydantic model class
        Strict, frozen, forbids extra keys; has a field ``kind``.
    build : callable
        Makes the object from the validated config; what it gets besides depends on the role (see ``config.compose``).
    summary : str
        One line for people.
    """

    role: Role
    name: str
    config: type[Any]
    build: Callable[..., Any]
    summary: str
