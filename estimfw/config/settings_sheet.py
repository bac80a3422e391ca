"""The settings of a component as a sheet for people, read from its JSON Schema: name, what it takes, default, meaning."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

__all__ = ["Setting", "settings_sheet", "settings_text"]

Schema = Mapping[str, Any]

GENERIC = ("quantity in ", "positive quantity in ", "non-negative quantity in ")
"""How a quantity describes itself where nobody says what it is for."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One key of a config.

    ``name`` is dotted within nested settings; ``takes`` says the unit or the choices; ``default`` is ``required`` where there
    is none, and empty where the setting may be left out without one.
    """

    name: str
    takes: str
    unit: str
    default: str
    meaning: str


def settings_sheet(definitions: Mapping[str, Schema], role: str, kind: str) -> tuple[Setting, ...]:
    """Every setting of a component but its ``kind``.

    Parameters
    ----------
    definitions : mapping of str to schema
        ``$defs`` of `estimfw.config.json_schema.filter_schema`.
    role, kind : str
    """
    return tuple(_settings(definitions, definitions[f"{role}:{kind}"], ""))


def settings_text(definitions: Mapping[str, Schema], role: str, kind: str) -> str:
    """What the settings say of themselves as a whole; empty where that is nothing but their name."""
    text = " ".join(str(definitions[f"{role}:{kind}"].get("description", "")).replace("``", "'").split())
    return "" if text.startswith("Settings of") else text


def _settings(definitions: Mapping[str, Schema], schema: Schema, prefix: str) -> Iterator[Setting]:
    needed = schema.get("required", [])
    for name, one in schema.get("properties", {}).items():
        if name == "kind":
            continue
        inner, path = _nested(definitions, one)
        if inner is not None:
            yield from _settings(definitions, inner, f"{prefix}{name}{path}.")
            continue
        default = "required" if name in needed else _written(one.get("default"))
        kinds = _kinds(definitions, one)
        if kinds:
            given = one.get("default")
            default = str(given.get("kind", "")) if isinstance(given, Mapping) else default
            yield Setting(f"{prefix}{name}.kind", " | ".join(kinds), "", default, _meaning(one))
            yield from _of_kinds(definitions, kinds, f"{prefix}{name}.")
            continue
        yield Setting(f"{prefix}{name}", _takes(definitions, one), _unit(one), default, _meaning(one))


def _kinds(definitions: Mapping[str, Schema], schema: Schema) -> dict[str, Schema]:
    """The settings inside of it by their ``kind``, where that tells which of several they are."""
    choices = [_resolved(definitions, one) for one in _choices(schema)]
    kinds = [str(one.get("properties", {}).get("kind", {}).get("const", "")) for one in choices]
    return dict(zip(kinds, choices, strict=True)) if len(choices) > 1 and all(kinds) else {}


def _of_kinds(definitions: Mapping[str, Schema], kinds: Mapping[str, Schema], prefix: str) -> Iterator[Setting]:
    """Settings that all have alike once; the others with the kind that they are of."""
    own = {kind: {one.name: one for one in _settings(definitions, inner, prefix)} for kind, inner in kinds.items()}
    for kind, settings in own.items():
        for name, one in settings.items():
            if any(other.get(name) != one for other in own.values()):
                yield replace(one, meaning=f"of {kind}: {one.meaning}".removesuffix(": "))
            elif kind == next(iter(own)):
                yield one


def _choices(schema: Schema) -> list[Schema]:
    """What a value may be, without null: that stands for leaving it out."""
    found = schema.get("anyOf") or schema.get("oneOf")
    if not found:
        return [schema]
    return [choice for one in found if one.get("type") != "null" for choice in _choices(one)]


def _nested(definitions: Mapping[str, Schema], schema: Schema) -> tuple[Schema | None, str]:
    """The settings inside of it, where it can be nothing else, and the way to them: below names, or in a list."""
    choices = [_resolved(definitions, one) for one in _choices(schema)]
    if len(choices) != 1:
        return None, ""
    (only,) = choices
    for path, inner in (("", only), (".NAME", _values(only)), ("[i]", only.get("items") or {})):
        found = _resolved(definitions, inner)
        if "properties" in found:
            return found, path
    return None, ""


def _values(schema: Schema) -> Schema:
    """What stands below the names of a mapping."""
    patterns = schema.get("patternProperties") or {}
    values = next(iter(patterns.values()), schema.get("additionalProperties"))
    return values if isinstance(values, Mapping) else {}


def _resolved(definitions: Mapping[str, Schema], schema: Schema) -> Schema:
    name = schema.get("$ref")
    return definitions[str(name).removeprefix("#/$defs/")] if name else schema


def _takes(definitions: Mapping[str, Schema], schema: Schema) -> str:
    told: list[str] = []
    for one in (_resolved(definitions, choice) for choice in _choices(schema)):
        text = _one(definitions, one)
        alike = one.get("type") == "array" and _takes(definitions, one.get("items") or {}) == " or ".join(told)
        told.append(f"a list of {one['maxItems'] if _size(one) else 'such'}" if alike else text)
    return " or ".join(dict.fromkeys(told))


def _size(schema: Schema) -> int:
    """Of a list that must have one, else 0."""
    size = schema.get("maxItems", 0)
    return int(size) if size == schema.get("minItems") else 0


def _one(definitions: Mapping[str, Schema], schema: Schema) -> str:
    if "const" in schema:
        return _written(schema["const"])
    if "enum" in schema:
        return " | ".join(_written(value) for value in schema["enum"])
    kind = schema.get("type")
    if kind == "array":
        size = _size(schema)
        items: Schema = schema.get("items") or next(iter(schema.get("prefixItems", [])), {})
        return f"list of {f'{size} × ' if size else ''}{_takes(definitions, items)}"
    if "x-unit" in schema or "examples" in schema:
        return f"such as {', '.join(map(str, schema['examples'][:2]))}" if schema.get("examples") else "quantity"
    if kind == "object":
        values = _values(schema)
        return f"names, each with {_takes(definitions, values)}" if values else "settings"
    words = {"string": "text", "boolean": "true | false", "integer": "whole number", "number": "number"}
    return words.get(str(kind), "any value")


def _unit(schema: Schema) -> str:
    """The unit, in whose dimension a value may be given; empty where there is none."""
    for one in _choices(schema):
        inner = one.get("items", one)
        if "x-unit" in inner:
            return str(inner["x-unit"])
    return ""


def _meaning(schema: Schema) -> str:
    text = str(schema.get("description", ""))
    return "" if text.startswith(GENERIC) else text


def _written(value: object) -> str:
    """As YAML has it; nothing for null."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
