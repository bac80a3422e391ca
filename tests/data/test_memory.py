"""How much one run may fill, and what is too much."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from estimfw.data import memory
from estimfw.errors import ConfigError


def test_half_of_the_machine_may_be_filled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_CGROUP_LIMITS", ())
    assert memory.available_bytes() == 0.5 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize(("text", "limited"), [("1048576\n", True), ("max\n", False)])
def test_a_container_has_its_own_limit(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, limited: bool
) -> None:
    (tmp_path / "memory.max").write_text(text)
    monkeypatch.setattr(memory, "_CGROUP_LIMITS", (tmp_path / "memory.max",))
    assert (memory.available_bytes() == 524288.0) == limited


def test_what_fits_passes_and_what_does_not_is_told_with_both_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_bytes", lambda: 2.0 * 2**30)
    memory.refuse_too_large(2.0 * 2**30, "these", "less")
    with pytest.raises(ConfigError, match=r"these need about 3 GiB of memory, 2 GiB may be used\n  less"):
        memory.refuse_too_large(3.0 * 2**30, "these", "less")
