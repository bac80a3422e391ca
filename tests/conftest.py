"""Filters from examples and from texts, run by either kernel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document, read_document
from estimfw.registry.load import load_plugins

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture(scope="session")
def example() -> Callable[..., Problem]:
    """``example("tracker", "source.seed=3")``."""
    registry = load_plugins(core_components())
    return lambda name, *overrides: compose(load_document(EXAMPLES / f"{name}.yaml", overrides), registry)


@pytest.fixture(scope="session")
def composed() -> Callable[[str], Problem]:
    """A problem from YAML text."""
    registry = load_plugins(core_components())
    return lambda text: compose(read_document(text), registry)
