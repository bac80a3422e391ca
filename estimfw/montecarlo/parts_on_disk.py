"""Finished parts of a Monte Carlo as files beside its result, so that one that was killed goes on where it was.

``RESULT.nc.chunks/`` holds ``manifest.json``, which says what Monte Carlo the parts belong to, and an ``.npz`` file a part. Each
is written whole or not at all; one that cannot be read is computed anew. The folder goes when the result is whole.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from estimfw.errors import DataError, Location
from estimfw.montecarlo.part import Part
from estimfw.run.files import write_bytes, write_text

__all__ = ["PartFolder", "chunks_beside"]

MANIFEST = "manifest.json"
WORDS = {
    "config_sha256": "config",
    "plan_hash": "filter",
    "seed": "seed",
    "runs": "number of runs",
    "chunk": "length of a chunk",
    "versions": "versions of the programs",
}


def chunks_beside(result: Path) -> Path:
    """The folder of the parts of this result."""
    return result.with_name(f"{result.name}.chunks")


@dataclass(frozen=True, slots=True)
class PartFolder:
    """Where parts are kept; open it with `opened`."""

    folder: Path

    @classmethod
    def opened(cls, folder: Path, manifest: Mapping[str, object], *, force: bool) -> PartFolder:
        """Make the folder, or go on with one that is there.

        Raises
        ------
        DataError
            It belongs to another Monte Carlo, and ``force`` is off; or it cannot be written.
        """
        path = folder / MANIFEST
        if folder.exists():
            other = _differing(path, manifest)
            if other and not force:
                raise DataError(
                    f"the chunks here are of another Monte Carlo: {other}",
                    location=Location(str(folder)),
                    hint="finish that one with its own settings, name another output, or use --force to drop them",
                )
            if other:
                shutil.rmtree(folder, ignore_errors=True)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            raise DataError(f"cannot write: {fault.strerror}", location=Location(str(folder))) from fault
        if not path.exists():
            write_text(path, json.dumps(manifest, indent=2, sort_keys=True) + "\n")
        return cls(folder)

    def read(self, index: int) -> Part | None:
        """A finished part; None where there is none, or only a damaged one."""
        try:
            with np.load(BytesIO(self._path(index).read_bytes()), allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files}
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None

    def write(self, index: int, part: Part) -> None:
        content = BytesIO()
        np.savez(content, allow_pickle=False, **part)
        write_bytes(self._path(index), content.getvalue(), force=True)

    def remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self, index: int) -> Path:
        return self.folder / f"chunk_{index:06d}.npz"


def _differing(path: Path, manifest: Mapping[str, object]) -> str:
    """What of a manifest is other than it should be, for people; empty if nothing is."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return "" if not any(path.parent.iterdir()) else "they have no manifest"
    except (OSError, ValueError):
        return "their manifest cannot be read"
    if not isinstance(found, dict):
        return "their manifest cannot be read"
    wanted = json.loads(json.dumps(manifest))
    other = [word for key, word in WORDS.items() if found.get(key) != wanted.get(key)]
    return f"other {', other '.join(other)}" if other else ""
