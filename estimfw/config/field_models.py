"""Which pydantic models may stand at a path of another one: for the names of valid keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from estimfw.config.node import Path

__all__ = ["models_at"]


def models_at(model: type[BaseModel], path: Path) -> tuple[type[BaseModel], ...]:
    """The models whose fields are the keys at ``path``; several for a union, none where keys are free.

    Parameters
    ----------
    model : pydantic model class
        At the top.
    path : tuple of str and int
    """
    return tuple(dict.fromkeys(t for t in _descend([model], path) if _is_model(t)))


def _descend(types: Sequence[Any], path: Path) -> list[Any]:
    branches = [branch for t in types for branch in _branches(t)]
    if not path:
        return branches
    return _descend([below for branch in branches for below in _below(branch, path[0])], path[1:])


def _branches(annotation: Any) -> Iterator[Any]:
    """The annotation, with unions and ``Annotated`` taken apart."""
    origin = get_origin(annotation)
    if _is_model(annotation) or (isinstance(origin, type) and issubclass(origin, (Mapping, Sequence))):
        yield annotation
        return
    arguments = get_args(annotation)
    if hasattr(annotation, "__metadata__"):
        arguments = arguments[:1]
    for argument in arguments:
        yield from _branches(argument)


def _below(branch: Any, key: str | int) -> Iterator[Any]:
    if _is_model(branch):
        field = branch.model_fields.get(key)
        if field is not None:
            yield field.annotation
    elif issubclass(get_origin(branch), Mapping):
        yield get_args(branch)[1]
    elif isinstance(key, int):
        elements = [a for a in get_args(branch) if a is not Ellipsis]
        yield elements[min(key, len(elements) - 1)]


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
