"""The text of a config file: of a sane size and in UTF-8."""

from __future__ import annotations

from pathlib import Path

from estimfw.errors import ConfigError, Location

__all__ = ["BEGINNING", "MAX_BYTES", "shown_path", "text_of"]

#: 1 MiB.
MAX_BYTES = 1 << 20
#: What the config of a filter begins with.
BEGINNING = "estimfw: 1"


def text_of(path: Path, named: Location | None = None, begins: str = BEGINNING) -> str:
    """Read a config file; a byte order mark is dropped.

    Parameters
    ----------
    path : Path
    named : Location, optional
        Where the file is named (an ``extends``), for the error if it is not there.
    begins : str
        What a file of this kind begins with, for the error if it is empty.

    Raises
    ------
    ConfigError
        Missing, not readable, over 1 MiB, empty, not UTF-8.
    """
    shown = shown_path(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as cause:
        raise ConfigError(
            f"cannot read {shown if named else 'the config'}: {cause.strerror or cause}",
            location=named or Location(shown),
        ) from None
    if len(content) > MAX_BYTES:
        raise ConfigError("the config is over 1 MiB", location=Location(shown), hint="data belongs into data files")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise _not_utf8(content, cause.start, shown) from None
    if not text.strip():
        raise ConfigError("the config is empty", location=Location(shown), hint=f"begin with '{begins}'")
    return text


def _not_utf8(content: bytes, position: int, shown: str) -> ConfigError:
    line = content.count(b"\n", 0, position) + 1
    column = position - content.rfind(b"\n", 0, position)
    return ConfigError(
        f"byte 0x{content[position]:02x} is not UTF-8",
        location=Location(shown, line, column),
        hint="save the file as UTF-8",
    )


def shown_path(path: Path) -> str:
    """The path as people see it: relative to the working directory where it lies below it."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)
