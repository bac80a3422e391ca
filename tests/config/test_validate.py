"""Faults of a config are said in its words, at its lines."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import model_validator

from estimfw.config.filter_config import FilterConfig
from estimfw.config.load import read_document
from estimfw.config.node import Path
from estimfw.config.types import Settings, Site, non_negative_quantity, positive_quantity, quantity_vector
from estimfw.config.validate import validate
from estimfw.errors import ConfigError, EstimfwError

GOOD = """\
estimfw: 1
name: good
site: {latitude: 34 deg}
blocks:
  velocity_error: {kind: sins.velocity_error, sigma: 0.1 m/s}
policies:
  - sins.remove_coriolis
  - {kind: drop_states, states: [a]}
"""


class Sensor(Settings):
    """A component's config."""

    kind: str
    mode: Literal["follow", "on", "off"] = "follow"
    sigma: Annotated[float, non_negative_quantity("m/s")] = 0.0
    tau: Annotated[float, positive_quantity("s")] = 1.0
    angles: Annotated[tuple[float, ...], quantity_vector("rad", 3)] = (0.0, 0.0, 0.0)
    gate: float = 3.0
    count: int = 1
    tags: tuple[str, ...] = ()
    flag: bool = False
    sites: dict[str, Site | None] = {}

    @model_validator(mode="after")
    def _no_gate_of_seven(self) -> Sensor:
        if self.gate == 7.0:
            raise ValueError("a gate of seven, really?")
        if self.gate == 8.0:
            raise ConfigError("eight is worse")
        return self


def refusal(text: str, at: Path = (), model: type[Settings] = FilterConfig) -> ConfigError:
    document = read_document(text, "a.yaml")
    data: Any = document.data
    for part in at:
        data = data[part]
    with pytest.raises(ConfigError) as caught:
        validate(model, data, document, at)
    return caught.value


def sensor_refusal(value: str) -> ConfigError:
    return refusal(f"blocks:\n  s: {{kind: x, {value}}}\n", ("blocks", "s"), Sensor)


def test_a_good_config_keeps_its_components_raw() -> None:
    document = read_document(GOOD)
    config = validate(FilterConfig, document.data, document)
    assert config.blocks == {"velocity_error": {"kind": "sins.velocity_error", "sigma": "0.1 m/s"}}
    assert config.policies == ("sins.remove_coriolis", {"kind": "drop_states", "states": ["a"]})
    assert config.site is not None and config.site.height == 0.0


def test_an_unknown_key_is_located_at_the_key_with_the_nearest_name() -> None:
    error = refusal(GOOD.replace("policies", "polices"))
    assert str(error.location) == "a.yaml:6:1"
    assert "unknown key 'polices'" in error.message
    assert "did you mean 'policies'" in str(error.hint)


def test_an_unknown_key_of_a_nested_model_names_the_keys_of_that_model() -> None:
    error = refusal(GOOD.replace("latitude: 34 deg", "latitude: 34 deg, hieght: 1 m"))
    assert str(error.location) == "a.yaml:3:26"
    assert "did you mean 'height'" in str(error.hint)
    deep = sensor_refusal("sites: {a: {latitude: 1 deg, longitud: 2 deg}}")
    assert "blocks.s.sites.a.longitud" in deep.message
    assert "did you mean 'longitude'" in str(deep.hint)


def test_a_missing_key_is_named_where_it_should_stand() -> None:
    error = refusal(GOOD.replace("latitude: 34 deg", "height: 1 m"))
    assert "'latitude' is missing" in error.message
    assert str(error.location) == "a.yaml:3:1"


@pytest.mark.parametrize("value", ['"3"', "true", "'3.5'"])
def test_a_quoted_number_and_a_bool_are_no_number(value: str) -> None:
    for key in ("gate", "count"):
        error = sensor_refusal(f"{key}: {value}")
        assert str(error.location) == f"a.yaml:2:{len(f'  s: {{kind: x, {key}: ') + 1}"
        assert "is no number" in error.message
        assert value.strip("\"'") in error.message


def test_a_missing_unit_a_wrong_dimension_and_a_negative_sigma_come_with_examples() -> None:
    for value, says in (("0.1", "0.1 has no unit"), ("10 deg", "in rad, not in m/s"), ("-1 m/s", "zero or more")):
        error = sensor_refusal(f"sigma: {value}")
        assert says in error.message
        assert "blocks.s.sigma" in error.message
        assert "0.1 m/s" in str(error.hint)
        assert str(error.location) == "a.yaml:2:23"


def test_a_correlation_time_of_zero_or_less_is_refused() -> None:
    for value in ("0 s", "-5 s"):
        assert "positive" in sensor_refusal(f"tau: {value}").message


def test_a_tower_of_powers_is_refused_at_once() -> None:
    assert "no quantity" in sensor_refusal("sigma: 9**9**9 m").message


def test_a_wrong_element_of_a_vector_is_located() -> None:
    error = sensor_refusal("angles: [1 deg, 2 deg, 3 m]")
    assert "blocks.s.angles[2]" in error.message
    assert str(error.location) == f"a.yaml:2:{'  s: {kind: x, angles: [1 deg, 2 deg, 3 m]'.index('3 m') + 1}"


def test_a_wrong_word_names_the_valid_ones() -> None:
    error = sensor_refusal("mode: folow")
    assert "'folow'" in error.message
    assert "did you mean 'follow'" in str(error.hint)


def test_a_fault_of_the_whole_is_located_at_the_whole() -> None:
    for value, says in (("7", "really?"), ("8", "worse")):
        error = sensor_refusal(f"gate: {value}")
        assert says in error.message
        assert str(error.location) == "a.yaml:2:6"


def test_several_faults_are_told_together_in_the_order_of_the_file() -> None:
    error = refusal("estimfw: 1\nsite: {latitude: 34}\nblocks: []\nnme: x\n")
    assert str(error.location) == "a.yaml:2:18"
    assert "also a.yaml:3:9: blocks" in str(error.hint)
    assert "also a.yaml:4:1: nme: unknown key 'nme'" in str(error.hint)


def test_the_fault_of_a_union_is_told_once_from_the_branch_that_went_deepest() -> None:
    error = sensor_refusal("sites: {a: {latitude: 100 deg}}")
    assert "outside" in error.message
    assert "also" not in str(error.hint)


@pytest.mark.parametrize(
    ("old", "new", "says", "place"),
    [("{kind: sins.velocity_error, sigma", "{sigma", "'kind' is missing", "a.yaml:5:19"),
     ("kind: sins.velocity_error", "kind: Sins Error", "'Sins Error' is no kind", "a.yaml:5:26"),
     ("velocity_error: {", "1velocity: {", "1velocity", "a.yaml:5:14"),
     ("- sins.remove_coriolis", "- {knd: a}", "'kind' is missing", "a.yaml:7:5"),
     ("- sins.remove_coriolis", "- 3", "policies[0]", "a.yaml:7:5"),
     ("estimfw: 1", "estimfw: '1'", "'1'", "a.yaml:1:10"),
     ("estimfw: 1\n", "", "'estimfw' is missing", "a.yaml:1:1"),
     ("estimfw: 1", "estimfw: 0", "0 is not valid", "a.yaml:1:10"),
     ("velocity_error: {kind: sins.velocity_error, sigma: 0.1 m/s}", "v: 3", "blocks.v", "a.yaml:5:6"),
     ("name: good", "prior: {correlations: [{between: [a], value: 2}]}", "prior.correlations[0]", "a.yaml:2:34")],
)  # fmt: skip
def test_faults_of_the_top_level(old: str, new: str, says: str, place: str) -> None:
    error = refusal(GOOD.replace(old, new, 1))
    assert says in error.message
    assert str(error.location) == place


def test_every_fault_is_a_config_error_with_exit_code_3() -> None:
    error: EstimfwError = refusal("blocks: {}\n")
    assert error.exit_code == 3
    assert error.as_json()["line"] == 1
