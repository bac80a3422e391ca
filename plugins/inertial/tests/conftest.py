"""What the tests of this package share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def lasergyro() -> Path:
    """The folder of the public record `lasergyro`, from LASERGYRO or from a folder shared/data above; skips without it."""
    named = os.environ.get("LASERGYRO")
    above = (parent / "shared" / "data" / "lasergyro" for parent in Path(__file__).parents)
    for folder in (Path(named),) if named else above:
        if (folder / "lasergyro.npz").is_file():
            return folder
    pytest.skip("the record lasergyro is not here (LASERGYRO names its folder)")
