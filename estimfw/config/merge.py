"""Deep merge of two configs: what ``extends`` means."""

from __future__ import annotations

from estimfw.config.node import Entry, Node

__all__ = ["merged"]


def merged(below: Node, above: Node) -> Node:
    """``above`` laid over ``below``: mappings are merged key by key, anything else is replaced.

    A mapping with another ``kind`` replaces the one below whole: the settings of one component say nothing to another.
    """
    if not isinstance(below.value, dict) or not isinstance(above.value, dict) or _other_kind(below, above):
        return above
    entries = dict(below.value)
    for key, entry in above.value.items():
        old = entries.get(key)
        entries[key] = Entry(entry.place, merged(old.node, entry.node)) if old else entry
    return Node(above.place, entries)


def _other_kind(below: Node, above: Node) -> bool:
    old, new = below.child("kind"), above.child("kind")
    return old is not None and new is not None and old.value != new.value
