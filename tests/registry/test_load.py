"""Plugins that break: the program goes on, and says who and why when they are needed."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable
from importlib.metadata import Distribution, EntryPoint
from os import PathLike
from typing import Any

import pytest
from pydantic import BaseModel

from estimfw.errors import ConfigError, PluginError
from estimfw.registry.component import Component
from estimfw.registry.hookspecs import hookimpl
from estimfw.registry.load import load_plugins
from estimfw.registry.plugin import Plugin


class Config(BaseModel):
    """A component's config."""

    kind: str


#: The record as a plugin can make it that no type checker has seen.
Untyped: Any = Component


def build(cfg: Config) -> str:
    return "built"


def block(name: str) -> Component:
    return Component("block", name, Config, build, "a block")


class FakeDistribution(Distribution):
    """An installed distribution, without files."""

    def __init__(self, name: str, version: str) -> None:
        self._said = {"Name": name, "Version": version}

    @property
    def metadata(self) -> Any:
        return self._said

    def read_text(self, filename: str) -> str | None:
        return None

    def locate_file(self, path: str | PathLike[str]) -> Any:
        return path


Make = Callable[..., EntryPoint]


@pytest.fixture
def plugin(monkeypatch: pytest.MonkeyPatch) -> Make:
    """Makes an installed plugin: a module that can be imported, behind an entry point."""

    def make(
        name: str,
        result: Any = (),
        *,
        api: Any = 1,
        dist: str = "vendor",
        version: str = "1.0",
        raises: BaseException | None = None,
    ) -> EntryPoint:
        module: Any = types.ModuleType(f"fake_{dist}_{name}".replace("-", "_"))
        if api is not None:
            module.ESTIMFW_API = api

        @hookimpl
        def estimfw_components() -> Any:
            if raises is not None:
                raise raises
            return result

        module.estimfw_components = estimfw_components
        monkeypatch.setitem(sys.modules, module.__name__, module)
        point: Any = EntryPoint(name, module.__name__, "estimfw")
        installed: EntryPoint = point._for(FakeDistribution(dist, version))
        return installed

    return make


def only(*points: EntryPoint) -> Plugin:
    """The plugin besides the framework's own."""
    _, found = load_plugins([], points).plugins
    return found


def test_components_are_known_by_role_and_id(plugin: Make) -> None:
    registry = load_plugins(
        [block("walk")], [plugin("radar", [block("range_bias"), Component("policy", "range_bias", Config, build, "")])]
    )
    assert registry.ids("block") == ("radar.range_bias", "walk")
    assert registry.get("block", "radar.range_bias").build(Config(kind="x")) == "built"
    assert registry.get("policy", "radar.range_bias").role == "policy"
    assert registry.get("block", "walk").summary == "a block"
    assert registry.failed == ()


def test_an_unknown_kind_names_the_nearest(plugin: Make) -> None:
    registry = load_plugins([block("random_walk")], [plugin("radar", [block("range_bias")])])
    with pytest.raises(ConfigError, match=r"unknown block kind 'radar\.rnge_bias'") as caught:
        registry.get("block", "radar.rnge_bias")
    assert "did you mean 'radar.range_bias'" in str(caught.value.hint)


def test_an_unknown_kind_names_the_plugins_that_failed_to_load(plugin: Make) -> None:
    broken = plugin("sonar", raises=RuntimeError("no sound card"))
    registry = load_plugins([block("random_walk")], [broken])
    with pytest.raises(ConfigError) as caught:
        registry.get("block", "depth")
    assert "sonar from vendor 1.0 (failed: RuntimeError: no sound card)" in str(caught.value.hint)


def test_a_kind_of_another_role_says_so(plugin: Make) -> None:
    registry = load_plugins([block("random_walk")], [])
    with pytest.raises(ConfigError) as caught:
        registry.get("policy", "random_walk")
    assert "'random_walk' is a block, no policy" in str(caught.value.hint)


@pytest.mark.parametrize(
    "raised", [RuntimeError("boom"), ImportError("no numba"), SystemExit(3), RecursionError("deep")]
)
def test_a_plugin_that_raises_costs_nobody_else_anything(plugin: Make, raised: BaseException) -> None:
    registry = load_plugins([], [plugin("bad", raises=raised), plugin("good", [block("x")], dist="other")])
    assert registry.ids() == ("good.x",)
    (failed,) = registry.failed
    assert (failed.name, failed.distribution, failed.version, failed.status) == ("bad", "vendor", "1.0", "failed")
    assert failed.cause is raised
    assert "estimfw_components" in failed.traceback


def test_a_plugin_that_raises_on_import_matters_only_if_the_config_uses_it() -> None:
    registry = load_plugins([block("x")], [EntryPoint("bad", "estimfw_no_such_module", "estimfw")])
    assert registry.get("block", "x").name == "x"
    with pytest.raises(PluginError, match=r"'bad\.thing' needs the plugin 'bad'") as caught:
        registry.get("block", "bad.thing")
    assert caught.value.exit_code == 4
    assert isinstance(caught.value.__cause__, ModuleNotFoundError)
    assert "estimfw_no_such_module" in str(caught.value.hint)


def test_ctrl_c_while_loading_is_not_swallowed(plugin: Make) -> None:
    with pytest.raises(KeyboardInterrupt):
        load_plugins([], [plugin("bad", raises=KeyboardInterrupt())])


@pytest.mark.parametrize("api", [0, 2, "1", None])
def test_another_interface_is_incompatible_and_exits_with_4_if_used(plugin: Make, api: object) -> None:
    registry = load_plugins([], [plugin("old", [block("x")], api=api, dist="old-maker", version="0.3")])
    (found,) = registry.failed
    assert found.status == "incompatible"
    with pytest.raises(PluginError, match=r"from old-maker 0\.3, which is incompatible") as caught:
        registry.get("block", "old.x")
    assert caught.value.exit_code == 4


def test_a_name_taken_twice_names_both_distributions_and_the_later_loses(plugin: Make) -> None:
    first = plugin("radar", [block("x")], dist="a-radar", version="1.0")
    second = plugin("radar", [block("x"), block("y")], dist="b-radar", version="2.0")
    for order in ([first, second], [second, first]):
        registry = load_plugins([], order)
        (loser,) = registry.failed
        assert loser.status == "incompatible"
        assert "b-radar 2.0" in loser.reason
        assert "a-radar 1.0" in loser.reason
        assert registry.ids() == ("radar.x",)
        with pytest.raises(PluginError, match="incompatible"):
            registry.get("block", "radar.y")


@pytest.mark.parametrize(
    "result",
    [None, 3, block("x"), "text", {"a": block("x")}, [3], [Config], [block("x"), block("x")], [block("Bad Name")], [block("a.b")],
     [Component("block", "x", int, build, "")], [Untyped("block", "x", Config, 3, "")],
     [Untyped("wheel", "x", Config, build, "")]],
)  # fmt: skip
def test_a_wrong_answer_is_a_failed_plugin_with_a_reason(plugin: Make, result: object) -> None:
    found = only(plugin("bad", result))
    assert found.status in ("failed", "incompatible")
    assert found.reason
    assert found.components == ()


def test_a_module_without_the_hook_is_incompatible(plugin: Make) -> None:
    point = plugin("empty")
    del sys.modules[point.value].estimfw_components
    assert "estimfw_components" in only(point).reason


def test_a_hook_with_an_argument_that_we_do_not_give_fails_alone(plugin: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    point = plugin("eager")

    @hookimpl
    def estimfw_components(everything: object) -> list[Component]:
        return []

    monkeypatch.setattr(sys.modules[point.value], "estimfw_components", estimfw_components)
    found = only(point)
    assert found.status == "failed"
    assert "everything" in found.traceback


@pytest.mark.parametrize("name", ["Radar", "ra-dar", "ra.dar", "estimfw", "1"])
def test_a_plugin_name_must_be_usable_in_a_config(plugin: Make, name: str) -> None:
    assert only(plugin(name, [block("x")])).status == "incompatible"


def test_the_installed_plugins_load() -> None:
    from estimfw.config.installed import installed_components

    registry = installed_components()
    assert registry.plugins[0].name == "estimfw"
    assert [(p.name, p.reason) for p in registry.failed] == []
    assert registry.get("estimator", "kalman").role == "estimator"
