"""JSON Schema of a config over the installed components, for editors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from estimfw.config.filter_config import FilterConfig
from estimfw.errors import PluginError
from estimfw.registry.component import ROLES, Component
from estimfw.registry.registry import Registry
from estimfw.units import parse_unit

__all__ = ["filter_schema"]

_NAMED = {
    "blocks": "block",
    "process": "process",
    "inputs": "input",
    "measurements": "measurement",
    "monitors": "monitor",
    "aiding": "source",
    "preprocess": "preprocess",
}
_SINGLE = {"nominal": "nominal", "estimator": "estimator", "source": "source", "initial_attitude": "initial"}
#: The kind of these follows from another section.
_KIND_MAY_LACK = {"initial"}


class _WithUnits(GenerateJsonSchema):
    """Defaults of quantities are SI floats inside; a config writes them with their unit."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        found = super().default_schema(schema)
        unit = found.get("x-unit")
        if unit is not None and unit != "1" and "default" in found:
            found["default"] = _as_text(found["default"], unit)
        return found


def _as_text(value: object, unit: str) -> object:
    if isinstance(value, (list, tuple)):
        texts = [_as_text(v, unit) for v in value]
        return texts[0] if texts and len({str(t) for t in texts}) == 1 else texts
    return f"{value / float(parse_unit(unit).scale):.12g} {unit}" if isinstance(value, (int, float)) else value


def filter_schema(registry: Registry) -> dict[str, Any]:
    """The schema of a whole config: each ``kind`` brings the keys of its component.

    Parameters
    ----------
    registry : Registry

    Raises
    ------
    PluginError
        Where a plugin's config model has no schema.
    """
    schema: dict[str, Any] = FilterConfig.model_json_schema(schema_generator=_WithUnits)
    definitions: dict[str, Any] = schema.setdefault("$defs", {})
    for role in ROLES:
        for kind, component in registry.components(role):
            definitions |= _component_schema(role, kind, component)
        definitions[role] = _any_of_role(role, registry)
    properties = schema["properties"]
    for section, named in _NAMED.items():
        names = properties[section]["patternProperties"]
        names |= {pattern: {"$ref": f"#/$defs/{named}"} for pattern in names}
        properties[section]["additionalProperties"] = False
    for section, single in _SINGLE.items():
        properties[section] = {"$ref": f"#/$defs/{single}", "description": properties[section]["description"]}
    properties["policies"]["items"] = {"anyOf": [{"enum": list(registry.ids("policy"))}, {"$ref": "#/$defs/policy"}]}
    schema["anyOf"] = [{"required": schema.pop("required")}, {"required": ["extends"]}]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "estimfw filter config"}


def _any_of_role(role: str, registry: Registry) -> dict[str, Any]:
    """One of the components; ``kind`` decides, so at most one of them fits where it is needed."""
    kinds = registry.ids(role)
    if not kinds:
        return {"not": {}, "description": f"no {role} is installed"}
    refs = [{"$ref": f"#/$defs/{role}:{kind}"} for kind in kinds]
    lacking = role in _KIND_MAY_LACK
    return {"type": "object", "anyOf": refs, **({} if lacking else {"required": ["kind"]})}


def _component_schema(role: str, kind: str, component: Component) -> dict[str, Any]:
    """The definitions of one component, under names that no other component has."""
    prefix = f"{role}:{kind}"
    try:
        schema = component.config.model_json_schema(
            ref_template=f"#/$defs/{prefix}:{{model}}", schema_generator=_WithUnits
        )
    except Exception as cause:
        raise PluginError(f"the config model of {role} {kind!r} has no JSON Schema: {cause}") from cause
    inner: Mapping[str, Any] = schema.pop("$defs", {})
    properties = schema.get("properties", {})
    schema["properties"] = {"kind": {"const": kind, "description": component.summary}} | {
        name: value for name, value in properties.items() if name != "kind"
    }
    needed = [name for name in schema.get("required", []) if name != "kind"]
    schema["required"] = needed if role in _KIND_MAY_LACK else ["kind", *needed]
    return {prefix: schema, **{f"{prefix}:{name}": value for name, value in inner.items()}}
