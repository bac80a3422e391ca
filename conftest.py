"""Settings of all tests, the plugins' included, and the public record that some of them read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The machines that run the tests are shared: how long an example takes says nothing about the code.
settings.register_profile("estimfw", deadline=None)
settings.load_profile("estimfw")


@pytest.fixture(scope="session")
def lasergyro() -> Path:
    """The folder of the public record `lasergyro`, from LASERGYRO or from a folder shared/data above; skips without it."""
    named = os.environ.get("LASERGYRO")
    above = (parent / "shared" / "data" / "lasergyro" for parent in Path(__file__).parents)
    for folder in (Path(named),) if named else above:
        if (folder / "lasergyro.npz").is_file():
            return folder
    pytest.skip("the record lasergyro is not here (LASERGYRO names its folder)")
