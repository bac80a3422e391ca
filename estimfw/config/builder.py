"""Components of a config, validated and built; every error gets the place it stands at, and a plugin's its name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from estimfw.config.document import Document
from estimfw.config.made import check_made, check_sizes
from estimfw.config.node import path_text
from estimfw.config.validate import validate
from estimfw.errors import ConfigError, EstimfwError
from estimfw.model.parts import Measurement, ProcessParts
from estimfw.registry.component import Component, Role
from estimfw.registry.contract import plugin_code
from estimfw.registry.registry import Registry

__all__ = ["Builder"]

Path = tuple[str | int, ...]


class Builder:
    """Builds the components of one config.

    Attributes
    ----------
    owners : dict of str to str
        By the path of a section (``aiding.compass``): the plugin that it comes from. The framework's own are left out.
    """

    def __init__(self, document: Document, registry: Registry) -> None:
        self.document, self.registry = document, registry
        self.owners: dict[str, str] = {}

    def settings(self, role: Role, data: Any, path: Path, default: str | None = None) -> tuple[Component, Any]:
        """The component and its validated config."""
        if isinstance(data, str):
            data = {"kind": data}
        kind = data.get("kind", default) if isinstance(data, Mapping) else None
        if not isinstance(kind, str):
            raise ConfigError(
                f"{path_text(path)} needs a kind", location=self.document.locate(path), hint="such as kind: kalman"
            )
        try:
            component = self.registry.get(role, kind)
        except EstimfwError as error:
            raise self._placed(error, (*path, "kind")) from error
        owner = self.registry.owner(kind)
        if owner is not None:
            self.owners[path_text(path)] = owner
        with plugin_code(owner, f"the settings of {role} {kind!r}"):
            return component, validate(component.config, {**data, "kind": kind}, self.document, path)

    def make(self, role: Role, data: Any, path: Path, *more: Any, default: str | None = None) -> Any:
        """The object that the component builds; ``more`` follows its config."""
        component, cfg = self.settings(role, data, path, default)
        return self._built(component, path, cfg, *more)

    def named(self, role: Role, data: Mapping[str, Any], section: str, *more: Any) -> list[Any]:
        """One object for each entry of a section; they get their name before their config."""
        made = []
        for name, entry in data.items():
            component, cfg = self.settings(role, entry, (section, name))
            made.append(self._built(component, (section, name), name, cfg, *more))
        return made

    def fits(self, section: str, name: str, made: ProcessParts | Measurement, widths: Mapping[str, int]) -> None:
        """Raise where coefficients do not fit the blocks and sources that they couple; see `check_sizes`."""
        path = (section, name)
        try:
            check_sizes(made, widths, self.owners.get(path_text(path)), _what(path))
        except EstimfwError as error:
            raise self._placed(error, path) from error

    def _built(self, component: Component, path: Path, *arguments: Any) -> Any:
        owner, what = self.owners.get(path_text(path)), _what(path)
        try:
            with plugin_code(owner, f"the build of {what}"):
                made = component.build(*arguments)
            check_made(component.role, made, owner, what)
        except EstimfwError as error:
            raise self._placed(error, path) from error
        return made

    def _placed(self, error: EstimfwError, path: Path) -> EstimfwError:
        self.document.placed(error, path)
        return error


def _what(path: Path) -> str:
    """``source``, ``measurement 'fix'``: what stands at a path, for people."""
    section = str(path[0]) if str(path[0]).endswith("process") else str(path[0]).removesuffix("s")
    return f"{section} {str(path[1])!r}" if len(path) > 1 else section.replace("_", " ")
