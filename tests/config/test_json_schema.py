"""The schema that editors get agrees with the program, as an independent validator sees it."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from estimfw.config.generic.components import core_components
from estimfw.config.json_schema import filter_schema
from estimfw.config.yaml_nodes import nodes_of
from estimfw.registry.load import load_plugins

CONFIG = """\
estimfw: 1
site: {latitude: 34 deg}
blocks:
  speed: {kind: random_walk, unit: m/s, sigma: 0.1 m/s, noise: 0.1 m/s/sqrt(s)}
estimator: {kind: kalman, covariance: ud}
policies:
  - {kind: drop_term, terms: [a]}
"""


@cache
def validator() -> Any:
    schema = filter_schema(load_plugins(core_components(), []))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def is_accepted(text: str) -> bool:
    return bool(validator().is_valid(nodes_of(text, "a.yaml").plain()))


def test_a_good_config_is_accepted() -> None:
    assert [e.message for e in validator().iter_errors(nodes_of(CONFIG, "a.yaml").plain())] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [("blocks", "block"), ("latitude", "lattitude"), ("34 deg", "34"), ("34 deg", "'34'"), ("random_walk", "random_wlak"),
     ("sigma", "sgma"), ("kind: random_walk, ", ""), ("covariance: ud", "covariance: du"), ("estimfw: 1", "estimfw: 2"),
     ("  speed", "  1speed"), ("kind: drop_term", "kind: kalman"), ("terms: [a]", "term: [a]")],
)  # fmt: skip
def test_what_the_program_refuses_the_editor_marks(old: str, new: str) -> None:
    assert old in CONFIG
    assert not is_accepted(CONFIG.replace(old, new, 1))


def test_a_config_that_extends_another_may_lack_what_the_other_has() -> None:
    assert is_accepted("extends: base.yaml\nname: variant\n")
    assert not is_accepted("name: variant\n")


def test_defaults_of_quantities_are_shown_with_their_unit() -> None:
    site = validator().schema["$defs"]["Site"]["properties"]
    assert site["height"]["default"] == "0 m"
    assert site["longitude"]["default"] == "0 rad"


def test_every_component_brings_its_keys_under_its_kind() -> None:
    definitions = validator().schema["$defs"]
    assert definitions["estimator:kalman"]["properties"]["kind"]["const"] == "kalman"
    assert "covariance" in definitions["estimator:kalman"]["properties"]
    assert {"$ref": "#/$defs/block:random_walk"} in definitions["block"]["anyOf"]


def test_every_setting_says_what_it_means() -> None:
    """The descriptions are the reference of the config language: also what editors show."""
    schema = filter_schema(load_plugins(core_components(), []))
    models = {"": schema} | schema["$defs"]
    silent = [
        f"{name}.{key}"
        for name, model in models.items()
        for key, setting in model.get("properties", {}).items()
        if "quantity in" in setting.get("description", "quantity in")
    ]
    assert silent == []
