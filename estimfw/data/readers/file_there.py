"""A data file that is not there, with the nearest one that is."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from estimfw.errors import DataError, Location

__all__ = ["refuse_missing_file"]


def refuse_missing_file(path: Path, what: str) -> None:
    """Raise `DataError` unless there is a plain file.

    Parameters
    ----------
    path : Path
        Relative paths are taken from the working directory.
    what : str
        What it is, for people: ``the IMU log``.
    """
    if path.is_file():
        return
    place = Location(str(path))
    if path.is_dir():
        raise DataError(f"{what} is a folder, not a file", location=place, hint=_near(path / "x"))
    raise DataError(f"{what} does not exist", location=place, hint=_near(path))


def _near(path: Path) -> str:
    where = "" if path.is_absolute() else f"; a relative path starts at the working directory, {Path.cwd()}"
    folder = path.parent
    if not folder.is_dir():
        return f"there is no folder {str(folder)!r} either{where}"
    names = sorted(p.name for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    near = get_close_matches(path.name, names, n=3, cutoff=0.6)
    if near:
        return f"did you mean {' or '.join(repr(str(folder / n)) for n in near)}?"
    return f"give the path of the file in `file`{where}"
