"""``--set a.b[0]=value``: one value of a config, from the command line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NoReturn

from estimfw.config.node import Entry, Node, Path, path_text
from estimfw.config.yaml_nodes import MAX_DEPTH, nodes_of
from estimfw.errors import ConfigError, Location
from estimfw.spelling import did_you_mean

__all__ = ["with_override"]

_TARGET = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*|\[\d{1,6}\])*", re.ASCII)
_PART = re.compile(r"([A-Za-z_]\w*)|\[(\d+)\]", re.ASCII)


def with_override(root: Node, text: str) -> Node:
    """The config with one value set; missing mapping keys are made, missing list elements are not.

    A component that is not there is not made of one of its settings: its name is misspelt.

    Parameters
    ----------
    root : Node
    text : str
        ``a.b[0]=value``; the value is YAML (``0.1 m/s``, ``[1 deg, 2 deg]``, ``{kind: kalman}``).

    Raises
    ------
    ConfigError
        Located at ``--set a.b[0]``.
    """
    target, equals, value = text.partition("=")
    target = target.strip()
    place = Location(f"--set {target[:80]}")
    if not equals or not _TARGET.fullmatch(target):
        raise ConfigError(f"{text[:80]!r} sets nothing", location=Location("--set"), hint="write a.b[0]=value")
    if not value.strip():
        raise ConfigError("no value after '='", location=place, hint="write null for nothing")
    path: Path = tuple(name or int(index) for name, index in _PART.findall(target))
    node = nodes_of(value.strip(), place.file, positions=False)
    if len(path) + node.height > MAX_DEPTH:
        raise ConfigError(f"nested more than {MAX_DEPTH} deep", location=place)
    return _set(root, path, (), node, place)


def _set(node: Node, path: Path, done: Path, value: Node, place: Location) -> Node:
    if not path:
        return value
    head, *rest = path
    here = (*done, head)
    if isinstance(head, int):
        return _set_element(node, head, tuple(rest), here, value, place)
    if not isinstance(node.value, dict):
        _refuse(f"{path_text(done)} is no mapping: there is no key {head!r} in it", place)
    if head not in node.value and rest and rest[0] != "kind" and _names_components(node.value):
        known = did_you_mean(head, node.value)
        raise ConfigError(
            f"there is no {head!r} in {path_text(done)} to set {rest[0]!r} of", location=place, hint=known
        )
    below = node.child(head) or Node(place, {})
    key_place = node.value[head].place if head in node.value and rest else place
    return Node(node.place, {**node.value, head: Entry(key_place, _set(below, tuple(rest), here, value, place))})


def _names_components(entries: Mapping[str, Entry]) -> bool:
    """Whether a mapping holds components by name (``blocks``), not the settings of one."""
    return bool(entries) and all(entry.node.child("kind") is not None for entry in entries.values())


def _set_element(node: Node, index: int, rest: Path, here: Path, value: Node, place: Location) -> Node:
    if not isinstance(node.value, list):
        _refuse(f"{path_text(here[:-1])} is no list: there is no element {index} in it", place)
    if index >= len(node.value):
        _refuse(f"{path_text(here)} is not there: the list has {len(node.value)} elements, counted from 0", place)
    elements = list(node.value)
    elements[index] = _set(elements[index], rest, here, value, place)
    return Node(node.place, elements)


def _refuse(message: str, place: Location) -> NoReturn:
    raise ConfigError(message, location=place, hint="set the whole list or mapping instead")
