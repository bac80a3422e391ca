"""The version of the config language."""

from __future__ import annotations

from estimfw.config.node import Node
from estimfw.errors import ConfigError

__all__ = ["CONFIG_VERSION", "refuse_newer"]

#: What ``estimfw: 1`` means.
CONFIG_VERSION = 1


def refuse_newer(root: Node) -> None:
    """Refuse a config for a later program before anything in it looks unknown."""
    version = root.child("estimfw")
    if version is None or not isinstance(version.value, int):
        return
    if isinstance(version.value, bool):  # true is 1 in Python, and in pydantic's literals
        shown = str(version.value).lower()
        raise ConfigError(
            f"estimfw: {shown} is no version", location=version.place, hint=f"write 'estimfw: {CONFIG_VERSION}'"
        )
    if version.value > CONFIG_VERSION:
        raise ConfigError(
            f"the config is of version {version.value}, this program reads version {CONFIG_VERSION}",
            location=version.place,
            hint="install a newer estimfw",
        )
