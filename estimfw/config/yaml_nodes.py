"""YAML text to nodes with places, by events: no object is constructed, nothing recurses, limits hold while reading.

Tags, duplicate keys, merge keys, several documents, keys that are not text, recursive aliases and aliases that blow up
are refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.reader import ReaderError

from estimfw.config.file_text import BEGINNING
from estimfw.config.node import Entry, Node
from estimfw.config.yaml_scalar import read_scalar
from estimfw.errors import ConfigError, Location

__all__ = ["MAX_DEPTH", "MAX_NODES", "nodes_of"]

#: Levels of nesting, aliases expanded.
MAX_DEPTH = 50
#: Values of one file, aliases expanded.
MAX_NODES = 100_000


def nodes_of(text: str, file: str, *, positions: bool = True, begins: str = BEGINNING) -> Node:
    """The single document of a YAML text.

    Parameters
    ----------
    text : str
    file : str
        Named in errors.
    positions : bool
        Whether lines and columns say something (not for a value on the command line).
    begins : str
        What a file of this kind begins with, for the error if there is nothing.

    Raises
    ------
    ConfigError
        With line and column.
    """
    reader = _Reader(file, positions)
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            reader.take(event)
    except MarkedYAMLError as cause:
        raise _syntax_error(cause, reader) from None
    except ReaderError as cause:
        raise reader.refuse_character(text, cause.position) from None
    except (YAMLError, ValueError) as cause:
        raise ConfigError(f"not YAML: {str(cause).splitlines()[0]}", location=Location(file)) from None
    if reader.root is None:
        raise ConfigError("the config is empty", location=Location(file), hint=f"begin with '{begins}'")
    return reader.root


def _syntax_error(cause: MarkedYAMLError, reader: _Reader) -> ConfigError:
    mark = cause.problem_mark or cause.context_mark
    context = f"{cause.context}: " if cause.context else ""
    begun = cause.context_mark
    hint = f"{_begun(cause.context)} in line {begun.line + 1}" if cause.context and begun else None
    place = reader.place(mark) if mark else Location(reader.file)
    return ConfigError(f"not YAML: {context}{cause.problem or 'syntax error'}", location=place, hint=hint)


def _begun(context: str) -> str:
    """``while parsing a flow mapping`` as ``the flow mapping begins``."""
    words = re.sub(r"^while (parsing|scanning) (an?|the)? ?", "", context)
    return f"the {words} begins"


@dataclass(slots=True)
class _Open:
    """A collection whose end has not come yet."""

    place: Location
    anchor: str | None
    value: list[Node] | dict[str, Entry]
    key: tuple[str, Location] | None = None


@dataclass(slots=True)
class _Reader:
    """Builds nodes from events, bottom up, on an explicit stack."""

    file: str
    positions: bool
    root: Node | None = None
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, Node | None] = field(default_factory=dict)
    documents: int = 0
    events: int = 0

    def place(self, mark: Any) -> Location:
        return Location(self.file, mark.line + 1, mark.column + 1) if self.positions else Location(self.file)

    def take(self, event: Any) -> None:
        place = self.place(event.start_mark)
        kind = type(event).__name__
        self.events += 1
        if self.events > 2 * MAX_NODES:
            raise ConfigError(f"more than {MAX_NODES} values in one config", location=place)
        if getattr(event, "tag", None) is not None:
            raise ConfigError(
                f"the tag {event.tag} is refused", location=place, hint="configs are plain data, without tags"
            )
        match kind:
            case "DocumentStartEvent":
                self._document(place)
            case "MappingStartEvent":
                self._open(event, place, {})
            case "SequenceStartEvent":
                self._open(event, place, [])
            case "MappingEndEvent" | "SequenceEndEvent":
                self._close()
            case "ScalarEvent":
                self._scalar(event, place)
            case "AliasEvent":
                self._alias(event, place)

    def _document(self, place: Location) -> None:
        self.documents += 1
        if self.documents > 1:
            raise ConfigError("a second document ('---') in one file", location=place, hint="one config a file")

    def _open(self, event: Any, place: Location, value: list[Node] | dict[str, Entry]) -> None:
        if self.stack and self._expects_key():
            raise ConfigError("a key is no text", location=place, hint="keys are names")
        if len(self.stack) >= MAX_DEPTH:
            raise ConfigError(f"nested more than {MAX_DEPTH} deep", location=place)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        self.stack.append(_Open(place, event.anchor, value))

    def _close(self) -> None:
        done = self.stack.pop()
        self._add(Node(done.place, done.value), done.anchor)

    def _scalar(self, event: Any, place: Location) -> None:
        if any("\ud800" <= c <= "\udfff" for c in event.value):
            raise ConfigError("half of a surrogate pair is no character", location=place)
        value = read_scalar(event.value, place) if event.style is None else event.value
        if self.stack and self._expects_key():
            self._key(value, event.value, place)
        else:
            self._add(Node(place, value), event.anchor)

    def _expects_key(self) -> bool:
        return isinstance(self.stack[-1].value, dict) and self.stack[-1].key is None

    def _key(self, value: object, text: str, place: Location) -> None:
        mapping = self.stack[-1]
        assert isinstance(mapping.value, dict)
        if not isinstance(value, str):
            raise ConfigError(f"the key {text or 'null'} is no text", location=place, hint="keys are names")
        if value == "<<":
            raise ConfigError("the merge key '<<' is refused", location=place, hint="use 'extends: other.yaml'")
        if value in mapping.value:
            first = mapping.value[value].place
            raise ConfigError(f"duplicate key {value!r}", location=place, hint=f"it stands first in {first}; keep one")
        mapping.key = (value, place)

    def _alias(self, event: Any, place: Location) -> None:
        if event.anchor not in self.anchors:
            raise ConfigError(f"the alias *{event.anchor} has no anchor before it", location=place)
        target = self.anchors[event.anchor]
        if target is None:
            raise ConfigError(f"the alias *{event.anchor} contains itself", location=place)
        if self.stack and self._expects_key():
            raise ConfigError(f"the alias *{event.anchor} is no key", location=place, hint="keys are names")
        self._add(Node(place, target.value), None)

    def _add(self, node: Node, anchor: str | None) -> None:
        if node.size > MAX_NODES:
            raise ConfigError(f"aliases make more than {MAX_NODES} values", location=node.place)
        if node.height + len(self.stack) > MAX_DEPTH + 1:
            raise ConfigError(f"nested more than {MAX_DEPTH} deep through aliases", location=node.place)
        if anchor is not None:
            self.anchors[anchor] = node
        if not self.stack:
            self.root = node
            return
        mapping = self.stack[-1]
        if isinstance(mapping.value, list):
            mapping.value.append(node)
        elif mapping.key is not None:
            key, place = mapping.key
            mapping.value[key] = Entry(place, node)
            mapping.key = None

    def refuse_character(self, text: str, position: int) -> ConfigError:
        line, column = text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)
        place = Location(self.file, line, column) if self.positions else Location(self.file)
        return ConfigError(f"the character {text[position]!r} is not allowed in YAML", location=place)
