"""Filters from examples and from texts, run by either kernel."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

from estimfw.config.compose import Problem, compose
from estimfw.config.generic.components import core_components
from estimfw.config.load import load_document, read_document
from estimfw.registry.load import load_plugins

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NEW_SENSOR = Path(__file__).resolve().parents[1] / "docs" / "new_sensor.md"


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


@pytest.fixture(scope="session")
def page_files() -> Callable[[Path], Path]:
    """``page_files(folder)`` writes the files that docs/new_sensor.md shows: each block that begins with a path."""

    def written(folder: Path) -> Path:
        text = NEW_SENSOR.read_text(encoding="utf-8")
        for path, content in re.findall(r"^```\w+\n# (\S+)\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL):
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(content, encoding="utf-8")
        return folder

    return written


@pytest.fixture(scope="session")
def boat(
    page_files: Callable[[Path], Path], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[..., Problem]]:
    """``boat("source.seed=3")``: the filter of docs/new_sensor.md, its plugin found without an installation."""
    folder = page_files(tmp_path_factory.mktemp("range_beacon"))
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    found = [*entry_points(group="estimfw"), EntryPoint("beacon", "range_beacon.plugin", "estimfw")]
    registry = load_plugins(core_components(), found)
    yield lambda *overrides: compose(load_document(folder / "boat.yaml", overrides), registry)
    sys.path.remove(str(folder))
    for name in [n for n in sys.modules if n.partition(".")[0] == "range_beacon"]:
        del sys.modules[name]
