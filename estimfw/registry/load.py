"""Find the installed plugins and load each in isolation: what one of them raises costs no other, nor the program."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import pluggy

from estimfw.registry import hookspecs
from estimfw.registry.component import API_VERSION, ROLES, Component
from estimfw.registry.plugin import CORE, Plugin, Status
from estimfw.registry.registry import Registry
from estimfw.version import __version__

__all__ = ["load_plugins"]

_NAME = re.compile(r"[a-z][a-z0-9_]*")


class _Refused(Exception):
    """Why a plugin is not taken."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status = status
        self.reason = reason


def load_plugins(core: Iterable[Component] = (), found: Iterable[EntryPoint] | None = None) -> Registry:
    """Load every plugin of the entry point group ``estimfw``.

    Parameters
    ----------
    core : iterable of Component
        The framework's own, known by their bare names.
    found : iterable of EntryPoint, optional
        Instead of the installed ones.

    Returns
    -------
    Registry
        With the plugins that failed as well, each with its cause.
    """
    own = Plugin(CORE, "estimfw", __version__, "loaded", _checked(list(core)))
    plugins = [own]
    points = entry_points(group=hookspecs.PROJECT) if found is None else found
    for point in sorted(set(points), key=lambda p: (_origin(p), p.name, p.value)):
        plugins.append(_load(point, {p.name: p for p in plugins if p.status == "loaded"}))
    return Registry(tuple(plugins))


def _origin(point: EntryPoint) -> tuple[str, str]:
    return (point.dist.name, point.dist.version) if point.dist else ("(no distribution)", "?")


def _load(point: EntryPoint, taken: dict[str, Plugin]) -> Plugin:
    distribution, version = _origin(point)
    try:
        components = _components_of(point, taken)
    except _Refused as refused:
        return Plugin(point.name, distribution, version, refused.status, reason=refused.reason)
    except (Exception, SystemExit) as cause:
        text = "".join(traceback.format_exception(cause))
        reason = f"{type(cause).__name__}: {cause}".splitlines()[0]
        return Plugin(point.name, distribution, version, "failed", reason=reason, traceback=text, cause=cause)
    return Plugin(point.name, distribution, version, "loaded", components)


def _components_of(point: EntryPoint, taken: dict[str, Plugin]) -> tuple[Component, ...]:
    if not _NAME.fullmatch(point.name):
        raise _Refused("incompatible", f"the name {point.name!r} is no lower-case identifier")
    if point.name == CORE:
        raise _Refused("incompatible", f"the name {CORE!r} is the framework's own")
    if point.name in taken:
        first, (name, version) = taken[point.name], _origin(point)
        raise _Refused(
            "incompatible",
            f"the plugin name {point.name!r} is taken: {name} {version} has it as well as {first.origin}",
        )
    module = point.load()
    _check_interface(module)
    manager = pluggy.PluginManager(hookspecs.PROJECT)
    manager.add_hookspecs(hookspecs)
    manager.register(module, point.name)
    manager.check_pending()
    if not manager.hook.estimfw_components.get_hookimpls():
        raise _Refused("incompatible", "it implements no hook estimfw_components()")
    (result,) = manager.hook.estimfw_components() or [None]
    return _checked(result)


def _check_interface(module: object) -> None:
    number = getattr(module, "ESTIMFW_API", None)
    if number != API_VERSION:
        made_for = "names no interface (ESTIMFW_API)" if number is None else f"is made for interface {number!r}"
        raise _Refused("incompatible", f"it {made_for}, this program has {API_VERSION}")


def _checked(result: Any) -> tuple[Component, ...]:
    """The components, if they are such."""
    if not isinstance(result, (list, tuple)):
        raise _Refused("failed", f"estimfw_components() returned {type(result).__name__}, a list of Component is due")
    seen: set[tuple[str, str]] = set()
    for component in result:
        _check_component(component)
        if (component.role, component.name) in seen:
            raise _Refused("failed", f"it brings the {component.role} {component.name!r} twice")
        seen.add((component.role, component.name))
    return tuple(result)


def _check_component(component: Any) -> None:
    if not isinstance(component, Component):
        raise _Refused("failed", f"estimfw_components() holds {component!r:.60}, a Component is due")
    if component.role not in ROLES:
        raise _Refused("incompatible", f"{component.name!r} has the unknown role {component.role!r}")
    if not isinstance(component.name, str) or not _NAME.fullmatch(component.name):
        raise _Refused("failed", f"the name {component.name!r} is no lower-case identifier")
    if not hasattr(component.config, "model_validate_json"):
        raise _Refused("failed", f"the config of {component.name!r} is no pydantic model")
    if not callable(component.build):
        raise _Refused("failed", f"the build of {component.name!r} cannot be called")
