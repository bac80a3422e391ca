"""Load a config: the file, what it extends, and what the command line sets."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from estimfw.config.document import Document
from estimfw.config.file_text import BEGINNING, shown_path, text_of
from estimfw.config.merge import merged
from estimfw.config.node import Node
from estimfw.config.overrides import with_override
from estimfw.config.version import refuse_newer
from estimfw.config.yaml_nodes import nodes_of
from estimfw.errors import ConfigError, Location, UsageError

__all__ = ["Overrides", "load_document", "read_document"]

#: ``["a.b[0]=value"]``, or ``{"a.b[0]": value}``.
Overrides = Sequence[str] | Mapping[str, object]

_MAX_CHAIN = 16


def load_document(path: str | Path, overrides: Overrides = (), *, begins: str = BEGINNING) -> Document:
    """Read a config file with everything it extends.

    Parameters
    ----------
    path : str or Path
    overrides : sequence of str, or mapping of str to value
        ``a.b[0]=value``, from left to right.
    begins : str
        What a file of this kind begins with, for the error if it holds nothing or no mapping.

    Raises
    ------
    ConfigError
        Whatever is wrong, with file, line and column.
    UsageError
        The overrides are one text, or hold a value that no config can.
    """
    main = Path(path)
    chain: list[Path] = []
    root = _load(main, main, None, chain, begins)
    for text in _texts(overrides):
        root = with_override(root, text)
    return Document(root, tuple(shown_path(p) for p in chain))


def _texts(overrides: Overrides) -> list[str]:
    if isinstance(overrides, str):
        raise UsageError(
            f"the overrides {overrides!r} are one text, a list is due",
            hint=f"write [{overrides!r}], or a mapping such as {{'source.seed': 2}}",
        )
    if not isinstance(overrides, Mapping):
        return list(overrides)
    try:
        return [f"{path}={json.dumps(value)}" for path, value in overrides.items()]
    except TypeError as cause:
        raise UsageError(
            f"an override holds what no config can: {cause}", hint="numbers, texts, lists, mappings"
        ) from None


def read_document(text: str, file: str = "<text>") -> Document:
    """A document from text; ``extends`` is refused, because text lies in no folder."""
    root = _mapping(nodes_of(text, file))
    refuse_newer(root)
    if (parent := root.child("extends")) is not None:
        raise ConfigError("'extends' needs a file", location=parent.place)
    return Document(root, (file,))


def _load(path: Path, main: Path, named: Location | None, chain: list[Path], begins: str) -> Node:
    chain.append(path)
    root = _mapping(nodes_of(text_of(path, named, begins), shown_path(path), begins=begins), begins)
    refuse_newer(root)
    parent = root.child("extends")
    if parent is None:
        return root
    below = _parent_path(parent, path, main, chain)
    return merged(_load(below, main, parent.place, chain, begins), _without_extends(root))


def _mapping(root: Node, begins: str = BEGINNING) -> Node:
    if not isinstance(root.value, dict):
        raise ConfigError("a config is a mapping of keys to values", location=root.place, hint=f"begin with '{begins}'")
    return root


def _without_extends(root: Node) -> Node:
    assert isinstance(root.value, dict)
    return Node(root.place, {key: entry for key, entry in root.value.items() if key != "extends"})


def _parent_path(named: Node, path: Path, main: Path, chain: list[Path]) -> Path:
    if not isinstance(named.value, str):
        raise ConfigError("'extends' names one file", location=named.place, hint="such as 'extends: base.yaml'")
    parent = path.parent / named.value
    try:
        resolved, seen = parent.resolve(), [p.resolve() for p in chain]
        roots = (main.resolve().parent, Path.cwd())
    except (OSError, RuntimeError, ValueError) as cause:
        raise ConfigError(f"cannot read {named.value!r}: {cause}", location=named.place) from None
    if resolved in seen:
        circle = " -> ".join(shown_path(p) for p in [*chain[seen.index(resolved):], parent])  # fmt: skip
        raise ConfigError(f"'extends' goes in a circle: {circle}", location=named.place)
    if not any(resolved.is_relative_to(root) for root in roots):
        raise ConfigError(
            f"'extends: {named.value}' leads outside the folder of the config and the working directory",
            location=named.place,
            hint="keep the extended file below one of the two",
        )
    if len(chain) >= _MAX_CHAIN:
        raise ConfigError(f"'extends' goes over more than {_MAX_CHAIN} files", location=named.place)
    return parent
