"""Labels in few words."""

from __future__ import annotations

from estimfw.report.brief_labels import brief_labels

EVERY = ["velocity[x]", "velocity[y]", "tilt[x]", "tilt[y]", "azimuth"]


def test_a_block_that_is_whole_goes_by_its_name() -> None:
    assert brief_labels(["velocity[x]", "tilt[x]", "tilt[y]", "azimuth"], EVERY) == "velocity[x], tilt, azimuth"
    assert brief_labels(["a[x]", "a[z]"], ["a[x]", "a[y]", "a[z]"]) == "a[x, z]"


def test_of_many_blocks_the_last_ones_are_counted() -> None:
    labels = [f"mass{i}" for i in range(20)]
    assert brief_labels(labels, labels) == "mass0, mass1, mass2, mass3, mass4, mass5, mass6 and 13 more"
    assert brief_labels(labels[:8], labels).endswith("mass6, mass7")
