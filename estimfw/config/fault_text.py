"""One pydantic error in the words of the person who wrote the config."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from estimfw.config.field_models import models_at
from estimfw.config.node import Path, path_text
from estimfw.spelling import did_you_mean

__all__ = ["Fault", "fault_of"]

_MAX_TEXT = 60


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong at a path of the data; ``at_key``: the key is to blame, not its value."""

    path: Path
    message: str
    hint: str | None = None
    at_key: bool = False

    def message_at(self, prefix: Path) -> str:
        """The message, led by the full path."""
        where = path_text((*prefix, *self.path))
        return f"{where}: {self.message}" if where else self.message


def fault_of(model: type[BaseModel], data: Mapping[str, Any], error: ErrorDetails) -> Fault:
    """Translate one error.

    Parameters
    ----------
    model : pydantic model class
        That was validated.
    data : mapping
        Against what.
    error : pydantic error details
    """
    path, left = _path_in(data, error["loc"])
    context = error.get("ctx", {})
    match error["type"]:
        case "extra_forbidden":
            return _unknown_key(model, path)
        case "missing" if left and isinstance(left[-1], int):
            return Fault(path, f"the list {_shown(error['input'])} is too short: element {left[-1]} is missing")
        case "missing":
            return Fault(
                path, f"the key {left[-1] if left else '?'!r} is missing", _keys_hint(model, path), at_key=True
            )
        case "estimfw":
            below, _ = _path_in(data, (*path, *context.get("at", ())))
            return Fault(below, str(context["message"]), str(context["hint"]) or None)
        case "literal_error":
            return _wrong_word(path, error["input"], str(context["expected"]))
        case "value_error" | "assertion_error":
            return Fault(path, error["msg"].partition(", ")[2] or error["msg"])
        case "model_attributes_type" | "model_type" | "dict_type":
            return _no_section(model, path, error["input"])
        case kind if kind.startswith(("float_", "int_")) and isinstance(error["input"], (str, bool)):
            return Fault(path, f"{_shown(error['input'])} is no number", _number_hint(error["input"]))
        case _:
            return Fault(path, f"{_shown(error['input'])}: {_lower(error['msg'])}")


def _path_in(data: object, loc: tuple[int | str, ...]) -> tuple[Path, Path]:
    """The part of an error's place that is a path of the data (unions add words of their own), and what is left over."""
    path: Path = ()
    left: Path = ()
    for part in loc:
        if _holds(data, (*path, part)):
            path, left = (*path, part), ()
        else:
            left = (*left, part)
    return path, left


def _holds(data: Any, path: Path) -> bool:
    for part in path:
        in_mapping = isinstance(data, dict) and part in data
        in_list = isinstance(data, (list, tuple)) and isinstance(part, int) and 0 <= part < len(data)
        if not in_mapping and not in_list:
            return False
        data = data[part]
    return True


def _unknown_key(model: type[BaseModel], path: Path) -> Fault:
    valid = {name for m in models_at(model, path[:-1]) for name in m.model_fields}
    return Fault(
        path, f"unknown key {str(path[-1])[:_MAX_TEXT]!r}", did_you_mean(str(path[-1])[:_MAX_TEXT], valid), at_key=True
    )


def _keys_hint(model: type[BaseModel], path: Path) -> str | None:
    models = models_at(model, path)
    needed = [name for m in models for name, field in m.model_fields.items() if field.is_required()]
    return f"needed here: {', '.join(dict.fromkeys(needed))}" if needed else None


def _wrong_word(path: Path, written: object, expected: str) -> Fault:
    words = re.findall(r"'([^']*)'", expected)
    hint = did_you_mean(written, words) if isinstance(written, str) and words else f"expected {expected}"
    return Fault(path, f"{_shown(written)} is not valid here", hint)


def _no_section(model: type[BaseModel], path: Path, written: object) -> Fault:
    """Something else where keys are due; where one of the keys is a ``kind``, a bare word is meant to be it."""
    message = f"{_shown(written)} is no mapping of keys to values"
    kinds = [word for m in models_at(model, path) for word in _kinds(m)]
    if not kinds:
        return Fault(path, message, _keys_hint(model, path))
    if isinstance(written, str) and written not in kinds:
        return Fault(path, message, did_you_mean(written, kinds) + f"; write {{kind: {kinds[0]}}}")
    return Fault(path, message, f"write {{kind: {written if isinstance(written, str) else kinds[0]}}}")


def _kinds(model: type[BaseModel]) -> tuple[str, ...]:
    field = model.model_fields.get("kind")
    return tuple(str(word) for word in get_args(field.annotation)) if field is not None else ()


def _number_hint(written: str | bool) -> str:
    if isinstance(written, bool):
        return "write a number; true and false are none"
    return "write a plain number, without quotes and without a unit"


def _shown(value: object) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    text = repr(value)
    return text if len(text) <= _MAX_TEXT else f"{text[:_MAX_TEXT]}..."


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
