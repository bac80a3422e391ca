"""A config as it stands after ``extends`` and ``--set``: plain data, and where each of it was written."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

from estimfw.config.node import Node, Path, path_text
from estimfw.errors import EstimfwError, Location

__all__ = ["Document"]


@dataclass(frozen=True)
class Document:
    """A config with the places of its values.

    Attributes
    ----------
    root : Node
        A mapping.
    files : tuple of str
        Every file it came from, the main one first.
    """

    root: Node
    files: tuple[str, ...]

    @cached_property
    def data(self) -> dict[str, Any]:
        """Plain dicts, lists and scalars."""
        return cast("dict[str, Any]", self.root.plain())

    def locate(self, path: Path, *, key: bool = False) -> Location:
        """Where the value at ``path`` stands (or its key); of what is not there, where the nearest thing above it stands."""
        node, place = self.root, self.root.place
        for i, part in enumerate(path):
            below = node.child(part)
            if below is None:
                break
            place = below.place
            if key and i == len(path) - 1 and isinstance(node.value, dict) and isinstance(part, str):
                place = node.value[part].place
            node = below
        return place

    def placed(self, error: EstimfwError, path: Path) -> None:
        """Give an error without a place that of ``path``, and of what it blames within (see `EstimfwError`)."""
        if error.location is None:
            inner = (*path, *error.within)
            error.location = self.locate(inner)
            error.message = f"{path_text(inner)}: {error.message}" if error.within else error.message

    def holds(self, path: Path) -> bool:
        """Whether there is a value at ``path``."""
        node: Node | None = self.root
        for part in path:
            node = node.child(part) if node is not None else None
        return node is not None
