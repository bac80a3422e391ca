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
    if version is None or not isinstance(version.value, int) or isinstance(version.value, bool):
        return
    if version.value > CONFIG_VERSION:
        raise ConfigError(
            f"the config is of version {version.value}, this program reads version {CONFIG_VERSION}",
            location=version.place,
            hint="install a newer estimfw",
        )
