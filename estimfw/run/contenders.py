"""The filters of a comparison: several configs, or one config with its policies applied one after the other."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from estimfw.config.compose import Problem, compose
from estimfw.config.load import load_document
from estimfw.config.yaml_nodes import nodes_of
from estimfw.errors import ConfigError, Location, UsageError
from estimfw.registry.registry import Registry

__all__ = ["Contender", "Point", "from_configs", "grid", "one_by_one", "refuse_other_records"]

#: Sections that make the record: they have to be the same for all filters. What a filter preprocesses of it is its own.
SAME = ("site", "source", "aiding")


@dataclass(frozen=True, slots=True)
class Contender:
    """A filter that takes part: its short name, its config, and what the command line sets in it."""

    name: str
    config: Path
    overrides: tuple[str, ...]

    def compose(self, registry: Registry, more: Sequence[str] = ()) -> Problem:
        """The composed filter; ``more`` overrides come last."""
        return compose(load_document(self.config, (*self.overrides, *more)), registry)


@dataclass(frozen=True, slots=True)
class Point:
    """One point of the grid: its name for people (empty where nothing is varied), and the overrides that make it."""

    label: str
    overrides: tuple[str, ...]


def from_configs(configs: Sequence[Path], overrides: Sequence[str]) -> tuple[Contender, ...]:
    """A contender for each config, named by its file, by its path where two files share a name."""
    stems = [c.stem for c in configs]
    names = [c.stem if stems.count(c.stem) == 1 else str(c.with_suffix("")) for c in configs]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise UsageError(f"{twice} is named twice", hint="each config once")
    return tuple(Contender(n, c, tuple(overrides)) for n, c in zip(names, configs, strict=True))


def one_by_one(config: Path, overrides: Sequence[str]) -> tuple[Contender, ...]:
    """The full model, and the model after the first policy, the first two, and so on.

    Raises
    ------
    UsageError
        The config has no policies.
    """
    policies = load_document(config, overrides).data.get("policies") or []
    if not policies:
        raise UsageError(f"{config} has no policies to apply one by one", hint="compare several configs instead")
    names = ["0 full model", *(f"{i} + {_short(p)}" for i, p in enumerate(policies, start=1))]
    return tuple(
        Contender(name, config, (*overrides, f"policies={json.dumps(policies[:count])}"))
        for count, name in enumerate(names)
    )


def _short(policy: object) -> str:
    """Without the plugin that it comes from."""
    kind = policy.get("kind", "") if isinstance(policy, dict) else policy
    return str(kind).rpartition(".")[2]


def grid(varied: Sequence[str]) -> tuple[Point, ...]:
    """Every combination of the values of ``PATH=[v1, v2, ...]``, the last path fastest; one empty point without any.

    To let several settings go together, vary the section that holds them: ``source=[{...}, {...}]``.

    Raises
    ------
    UsageError, ConfigError
        No list of values.
    """
    axes = [_axis(text) for text in varied]
    return tuple(
        Point("; ".join(label for label, _ in chosen), tuple(override for _, override in chosen))
        for chosen in itertools.product(*axes)
    )


def _axis(text: str) -> list[tuple[str, str]]:
    path, equals, values = text.partition("=")
    wanted = "--vary PATH=[v1, v2, ...], such as --vary 'source.seed=[1, 2, 3]'"
    if not equals or not values.strip():
        raise UsageError(f"--vary {text!r} varies nothing", hint=f"write {wanted}")
    listed = nodes_of(values.strip(), Location(f"--vary {path}").file, positions=False).plain()
    if not isinstance(listed, list) or not listed:
        raise UsageError(f"--vary {path}: {values.strip()!r} is no list of values", hint=f"write {wanted}")
    short = [_label(v) for v in listed]
    labels = short if len(set(short)) == len(short) else [json.dumps(v) for v in listed]
    return [(label, f"{path.strip()}={json.dumps(v)}") for label, v in zip(labels, listed, strict=True)]


def _label(value: object) -> str:
    """A list of equal values is told by one of them."""
    if isinstance(value, list) and value and all(v == value[0] for v in value):
        return str(value[0])
    return value if isinstance(value, str) else json.dumps(value)


def refuse_other_records(contenders: Sequence[Contender], problems: Sequence[Problem]) -> None:
    """Raise `ConfigError` where the sections that make the record differ from those of the first config.

    A source that takes part of what it simulates from another section names it: ``made_with = ("nominal",)``.
    """
    first = problems[0].document.data
    sections = (*SAME, *getattr(problems[0].source, "made_with", ()))
    for contender, problem in zip(contenders[1:], problems[1:], strict=True):
        for section in sections:
            if problem.document.data.get(section) != first.get(section):
                raise ConfigError(
                    f"{section!r} of {contender.name} is not that of {contenders[0].name}: "
                    "filters are compared on one record",
                    location=problem.document.locate((section,)),
                    hint="let both configs extend one file, or give all of them the same with --set",
                )
