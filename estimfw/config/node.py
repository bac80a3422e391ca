"""What a config file says, with the place of every key and value."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from estimfw.errors import Location

__all__ = ["Entry", "Node", "Path", "Scalar", "path_text"]

#: Keys and list indices from the top: ``("policies", 0, "kind")``.
Path = tuple[str | int, ...]
Scalar = str | int | float | bool | None


@dataclass(frozen=True, slots=True)
class Entry:
    """A key of a mapping: where the key stands, and its value."""

    place: Location
    node: Node


@dataclass(frozen=True, slots=True)
class Node:
    """A value with its place: a scalar, a list of nodes, or a mapping of keys to entries.

    ``size`` counts this node and all below it (an alias counts each time it is used), ``height`` the levels.
    """

    place: Location
    value: Scalar | list[Node] | dict[str, Entry]
    size: int = field(init=False, compare=False, default=1)
    height: int = field(init=False, compare=False, default=1)

    def __post_init__(self) -> None:
        below = list(self.children())
        object.__setattr__(self, "size", 1 + sum(n.size for n in below))
        object.__setattr__(self, "height", 1 + max((n.height for n in below), default=0))

    def children(self) -> Iterator[Node]:
        if isinstance(self.value, dict):
            yield from (entry.node for entry in self.value.values())
        elif isinstance(self.value, list):
            yield from self.value

    def plain(self) -> object:
        """Dicts, lists and scalars, without places; a fresh copy."""
        if isinstance(self.value, dict):
            return {key: entry.node.plain() for key, entry in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value

    def child(self, key: str | int) -> Node | None:
        """The value below a key or an index; None where there is none."""
        if isinstance(self.value, dict) and isinstance(key, str):
            entry = self.value.get(key)
            return entry.node if entry else None
        if isinstance(self.value, list) and isinstance(key, int) and 0 <= key < len(self.value):
            return self.value[key]
        return None


def path_text(path: Path) -> str:
    """``blocks.velocity_error.sigma``, ``policies[0]``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")
