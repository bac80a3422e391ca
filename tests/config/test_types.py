"""Quantities in configs: SI floats from text with units, and refusals that say what is right."""

from __future__ import annotations

import json
import math
import re
from typing import Annotated, Any

import pytest
from pydantic import ValidationError

from estimfw.config.types import (
    Identifier,
    NoiseLevel,
    NonNegative,
    Positive,
    Settings,
    Site,
    noise,
    non_negative_quantity,
    positive_quantity,
    quantity,
    quantity_vector,
)

DEGREE = math.pi / 180.0


class Block(Settings):
    """One of each."""

    sigma: Annotated[float, non_negative_quantity("m/s")] = 0.0
    angle: Annotated[float, quantity("rad")] = 0.0
    duration: Annotated[float, positive_quantity("s")] = 1.0
    angles: Annotated[tuple[float, ...], quantity_vector("rad", 3)] = (0.0, 0.0, 0.0)
    scale: Annotated[float, quantity("1")] = 0.0
    gate: Positive = 3.0
    weight: NonNegative = 0.0
    name: Identifier = "a"


class Velocity(Settings):
    """A measurement."""

    noise: Annotated[NoiseLevel, noise("m/s", 3)]


def refusal(**values: Any) -> str:
    with pytest.raises(ValidationError) as caught:
        Block.model_validate(values)
    (error,) = caught.value.errors()
    return f"{error['msg']} | {error.get('ctx', {}).get('hint')}"


def test_quantities_arrive_in_si() -> None:
    block = Block.model_validate({"sigma": "36 km/h", "angle": "180 deg", "duration": "2 min", "scale": "5 ppm"})
    assert (block.sigma, block.angle, block.duration, block.scale) == (10.0, math.pi, 120.0, 5e-6)


def test_one_quantity_stands_for_all_elements_and_a_list_for_each() -> None:
    assert Block.model_validate({"angles": "90 deg"}).angles == (math.pi / 2,) * 3
    assert Block.model_validate({"angles": ["0 rad", "1 rad", "2 rad"]}).angles == (0.0, 1.0, 2.0)


def test_a_list_of_the_wrong_length_is_refused() -> None:
    assert "2 values where 3 are due" in refusal(angles=["1 deg", "2 deg"])


def test_a_missing_unit_is_refused_with_examples_of_right_ones() -> None:
    for value in (0.1, 1, "0.1"):
        text = refusal(sigma=value)
        assert "has no unit" in text
        assert "0.1 m/s or 2 km/h" in text


def test_a_wrong_dimension_is_refused_naming_both() -> None:
    text = refusal(sigma="10 deg")
    assert "'10 deg' is in rad, not in m/s" in text
    assert "such as 0.1 m/s" in text


def test_hertz_is_no_angular_rate() -> None:
    class Rate(Settings):
        rate: Annotated[float, quantity("rad/s")]

    with pytest.raises(ValidationError, match="is in 1/s, not in rad/s"):
        Rate.model_validate({"rate": "1 Hz"})


def test_a_negative_sigma_and_a_duration_of_zero_are_refused() -> None:
    assert "'-1 m/s' must be zero or more" in refusal(sigma="-1 m/s")
    assert "'0 s' must be positive" in refusal(duration="0 s")
    assert Block.model_validate({"sigma": "0 m/s"}).sigma == 0.0


@pytest.mark.parametrize("value", [True, None, {}, [], float("nan"), float("inf"), "nan m/s", "inf m/s", "1e400 m/s"])
def test_what_is_no_quantity_is_refused(value: object) -> None:
    assert "such as" in refusal(sigma=value)


@pytest.mark.parametrize("value", ["3", True, math.nan, math.inf, 0, -1, None, "3 m"])
def test_a_plain_positive_number_is_a_finite_number_above_zero_without_quotes(value: object) -> None:
    with pytest.raises(ValidationError):
        Block.model_validate({"gate": value})


def test_an_integer_is_a_plain_number() -> None:
    assert Block.model_validate({"gate": 3}).gate == 3.0


def test_a_unit_of_one_takes_plain_numbers_but_no_quoted_ones() -> None:
    assert Block.model_validate({"scale": 0.25}).scale == 0.25
    assert Block.model_validate({"scale": "25 %"}).scale == 0.25
    assert "quoted" in refusal(scale="0.25")


@pytest.mark.parametrize("name", ["", "1a", "a-b", "a.b", "a b", "é", "a\n", 3, "a" * 65])
def test_names_are_identifiers(name: object) -> None:
    with pytest.raises(ValidationError):
        Block.model_validate({"name": name})


def test_a_noise_is_per_measurement_or_a_density() -> None:
    per_measurement = Velocity.model_validate({"noise": "0.1 m/s"}).noise
    assert per_measurement == NoiseLevel(0.1, "per_measurement")
    assert Velocity.model_validate({"noise": "0.1 m/s/sqrt(Hz)"}).noise == NoiseLevel(0.1, "density")
    assert Velocity.model_validate({"noise": ["1 m/s", "2 m/s", "3 m/s"]}).noise.value == (1.0, 2.0, 3.0)


def test_a_noise_of_zero_can_be_seen() -> None:
    assert Velocity.model_validate({"noise": "0 m/s"}).noise.has_zero
    assert not Velocity.model_validate({"noise": "1 m/s"}).noise.has_zero


@pytest.mark.parametrize("value", ["0.1", "-0.1 m/s", "1 deg", ["1 m/s"], ["1 m/s", "1 m/s", "1 m/s/sqrt(Hz)"], []])
def test_a_wrong_noise_is_refused(value: object) -> None:
    with pytest.raises(ValidationError):
        Velocity.model_validate({"noise": value})


def test_settings_are_frozen_and_take_no_unknown_key() -> None:
    with pytest.raises(ValidationError, match="Extra inputs"):
        Block.model_validate({"sigmas": "1 m/s"})
    with pytest.raises(ValidationError, match="frozen"):
        Block().gate = 2.0


def test_a_site_is_on_the_earth() -> None:
    site = Site.model_validate({"latitude": "34 deg", "height": "0.1 km"})
    assert site.latitude == pytest.approx(34 * DEGREE, rel=1e-15)
    assert (site.longitude, site.height) == (0.0, 100.0)
    with pytest.raises(ValidationError, match="outside -90 deg"):
        Site.model_validate({"latitude": "91 deg"})


def test_schema_examples_match_their_own_pattern_and_are_accepted() -> None:
    schema = Block.model_json_schema()["properties"]
    for name in ("sigma", "angle", "duration"):
        for example in schema[name]["examples"]:
            assert re.search(schema[name]["pattern"], example)
            Block.model_validate({name: example})
        assert not re.search(schema[name]["pattern"], "0.1")
    json.dumps(Velocity.model_json_schema())
