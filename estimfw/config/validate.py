"""Validate plain data against a pydantic model; what is wrong is said with its place in the file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from estimfw.config.document import Document
from estimfw.config.fault_text import Fault, fault_of
from estimfw.config.node import Path
from estimfw.errors import ConfigError

__all__ = ["validate"]

M = TypeVar("M", bound=BaseModel)
_MAX_SHOWN = 5


def validate(model: type[M], data: Mapping[str, Any], document: Document, path: Path = ()) -> M:
    """An instance of ``model`` from plain data (lists become tuples where the model says so).

    Parameters
    ----------
    model : pydantic model class
    data : mapping
        Plain data; keys that the document does not hold (a default ``kind``) are allowed.
    document : Document
        Where ``data`` comes from.
    path : tuple of str and int
        Where ``data`` stands in the document.

    Raises
    ------
    ConfigError
        The first fault, at the line and column of its key or value; further ones are listed in the hint.
    """
    try:
        return model.model_validate_json(json.dumps(data))
    except ValidationError as cause:
        raise _config_error(_faults(model, data, cause.errors(include_url=False)), document, path) from None
    except ConfigError as cause:
        if cause.location is None:
            cause.location = document.locate(path)
        raise


def _faults(model: type[BaseModel], data: Mapping[str, Any], errors: Sequence[ErrorDetails]) -> list[Fault]:
    """One fault for each place: of the branches of a union, the one that went deepest."""
    faults: list[Fault] = []
    for error in errors:
        fault = fault_of(model, data, error)
        same = next(
            (f for f in faults if f.path[: len(fault.path)] == fault.path or fault.path[: len(f.path)] == f.path), None
        )
        if same is None:
            faults.append(fault)
        elif len(fault.path) > len(same.path):
            faults[faults.index(same)] = fault
    return faults


def _config_error(faults: list[Fault], document: Document, path: Path) -> ConfigError:
    placed = [(document.locate((*path, *f.path), key=f.at_key), f) for f in faults]
    placed.sort(key=lambda p: (p[0].file, p[0].line or 0, p[0].column or 0))
    (location, first), *others = placed
    more = [f"also {place}: {f.message_at(path)}" for place, f in others[: _MAX_SHOWN - 1]]
    if len(others) >= _MAX_SHOWN:
        more.append(f"and {len(others) - _MAX_SHOWN + 1} more")
    hint = "\n  ".join([*([first.hint] if first.hint else []), *more]) or None
    return ConfigError(first.message_at(path), location=location, hint=hint)
