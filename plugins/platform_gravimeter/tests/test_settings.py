"""Every setting says what it means: in the schema that editors show, and in `estimfw plugins show`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

SCHEMA = json.loads((Path(__file__).parents[3] / "schemas" / "filter.schema.json").read_text())["$defs"]
NAMES = sorted(name for name in SCHEMA if "platform_gravimeter." in name)
MADE = {f"{sign}quantity in " for sign in ("", "positive ", "non-negative ")}


def test_the_plugin_is_in_the_schema() -> None:
    assert NAMES


@pytest.mark.parametrize("name", NAMES)
def test_every_setting_has_a_description(name: str) -> None:
    for key, setting in SCHEMA[name].get("properties", {}).items():
        text = setting.get("description", "")
        assert text and not any(text.startswith(made) for made in MADE), f"{name}: {key}"
