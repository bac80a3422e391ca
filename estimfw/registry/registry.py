"""All components that a config can name, and the plugins that could not bring theirs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from estimfw.errors import ConfigError, PluginError
from estimfw.registry.component import Component
from estimfw.registry.plugin import Plugin
from estimfw.spelling import did_you_mean

__all__ = ["Registry"]


@dataclass(frozen=True, slots=True)
class Registry:
    """Components by role and id.

    Attributes
    ----------
    plugins : tuple of Plugin
        The framework first, then all plugins that were found.
    """

    plugins: tuple[Plugin, ...]
    _components: dict[tuple[str, str], Component] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        table = {(c.role, p.id_of(c)): c for p in self.plugins if p.status == "loaded" for c in p.components}
        object.__setattr__(self, "_components", table)

    @property
    def failed(self) -> tuple[Plugin, ...]:
        """Plugins that were found and are not loaded."""
        return tuple(p for p in self.plugins if p.status != "loaded")

    def ids(self, role: str | None = None) -> tuple[str, ...]:
        """The ids of a role (of all roles), sorted."""
        return tuple(sorted({kind for r, kind in self._components if role in (None, r)}))

    def components(self, role: str | None = None) -> Iterator[tuple[str, Component]]:
        """Id and component, sorted by role and id."""
        for (r, kind), component in sorted(self._components.items(), key=lambda item: item[0]):
            if role in (None, r):
                yield kind, component

    def get(self, role: str, kind: str) -> Component:
        """The component that a config means.

        Parameters
        ----------
        role : str
            Such as ``block``.
        kind : str
            ``plugin.name``, or the bare name of a component of the framework.

        Raises
        ------
        ConfigError
            No such component, with the nearest names and the plugins that failed to load.
        PluginError
            The component belongs to a plugin that failed to load (``__cause__`` is what it raised), or two distributions
            claim its name, so that nobody can say which one is meant.
        """
        for plugin in self.failed:
            if "." in kind and kind.partition(".")[0] == plugin.name:
                raise _unusable(plugin, role, kind) from plugin.cause
        component = self._components.get((role, kind))
        if component is not None:
            return component
        raise ConfigError(f"unknown {role} kind {kind!r}", hint="\n  ".join(self._hints(role, kind)))

    def owner(self, kind: str) -> str | None:
        """The plugin of a component, for people: ``plugin 'radar' (acme-radar 1.2)``; None for the framework's own."""
        name = kind.partition(".")[0] if "." in kind else ""
        found = next((p for p in self.plugins if p.name == name and p.status == "loaded"), None)
        return f"plugin {found.name!r} ({found.origin})" if found else None

    def _hints(self, role: str, kind: str) -> list[str]:
        hints = [did_you_mean(kind, self.ids(role))]
        other = sorted(r for r, k in self._components if k == kind)
        if other:
            hints.insert(0, f"{kind!r} is a {' and a '.join(other)}, no {role}")
        owner = kind.partition(".")[0]
        if "." in kind and owner not in {p.name for p in self.plugins}:
            names = ", ".join(p.name for p in self.plugins[1:]) or "none"
            hints.insert(0, f"no plugin {owner!r} is installed (installed: {names})")
        if self.failed:
            names = "; ".join(f"{p.name} from {p.origin} ({p.status}: {p.reason})" for p in self.failed)
            hints.append(f"plugins that are not loaded: {names}")
        return hints


def _unusable(plugin: Plugin, role: str, kind: str) -> PluginError:
    return PluginError(
        f"the {role} kind {kind!r} needs the plugin {plugin.name!r} from {plugin.origin}, which is {plugin.status}: "
        f"{plugin.reason}",
        hint=plugin.traceback.rstrip().replace("\n", "\n  ")
        or "install one that fits this program, and only one of that name",
    )
