"""Arrays on a shelf come back the last first and bit for bit, whether they stayed in memory or not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimfw.data.shelf import Shelf
from estimfw.errors import DataError


@pytest.mark.parametrize("in_memory", [0, 900, 1 << 20])
def test_what_was_laid_down_last_comes_first(in_memory: int) -> None:
    draw = np.random.default_rng(0)
    laid = [(draw.normal(size=(k, 3)), draw.normal(size=(k, 2, 2)), np.zeros((k, 0))) for k in (5, 1, 4, 0, 7)]
    with Shelf(in_memory) as shelf:
        for arrays in laid[:3]:
            shelf.lay(*arrays)
        for one, other in zip(shelf.take(), laid[2], strict=True):
            np.testing.assert_array_equal(one, other)
        for arrays in laid[3:]:
            shelf.lay(*arrays)
        assert len(shelf) == 4
        for arrays in (laid[4], laid[3], laid[1], laid[0]):
            for one, other in zip(shelf.take(), arrays, strict=True):
                np.testing.assert_array_equal(one, other)


def test_a_disk_without_room_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    with pytest.raises(DataError, match=r"cannot keep [\s\S]*TMPDIR"), Shelf(0) as shelf:
        shelf.lay(np.zeros(3))
