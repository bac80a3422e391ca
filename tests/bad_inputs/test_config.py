"""Configs that are no configs (1 to 16): exit code 3, with file, line and column, and what is nearest."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Check = Callable[..., Any]
Tracker = Callable[..., str]


def test_a_good_config_passes(check: Check, tracker: Tracker) -> None:
    told = check(tracker())
    assert told.code == 0
    told.says("ok: 4 states, 20 steps")


def test_01_a_syntax_error_has_line_and_column_and_shows_the_line(check: Check, tracker: Tracker) -> None:
    told = check(tracker("gate: 0.999}", "gate: 0.999"))
    assert told.code == 3
    told.says("filter.yaml:11:7: not YAML", "11 | source: {kind: simulate_model", "the flow mapping begins in line 10")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("filter.yaml", "estimfw: 1\nname: a\nname: b\n"),
        ("filter.json", '{"estimfw": 1,\n"name": "a",\n"name": "b"}'),
    ],
    ids=["2-yaml", "2-json"],
)
def test_02_a_duplicate_key_names_both_lines(check: Check, name: str, text: str) -> None:
    told = check(text, name=name)
    assert told.code == 3
    told.says(f"{name}:3:1: duplicate key 'name'", f"it stands first in {name}:2:1")


def test_03_an_unknown_key_names_the_nearest(check: Check, tracker: Tracker) -> None:
    told = check(tracker("sigma: 50 m", "sigmas: 50 m"))
    assert told.code == 3
    told.says("filter.yaml:4:60: blocks.position.sigmas: unknown key 'sigmas'", "did you mean 'sigma'?")


def test_04_an_unknown_kind_names_the_nearest_and_plugins_that_failed(
    check: Check, tracker: Tracker, install: Callable[..., None]
) -> None:
    install("raise ImportError('no libcompass.so')")
    told = check(tracker("random_walk", "random_wlak"))
    assert told.code == 3
    told.says("filter.yaml:5:20: unknown block kind 'random_wlak'", "did you mean 'random_walk'")
    told.says("vendor from acme-sensor 1.2 (failed: ImportError: no libcompass.so)")


def test_05_a_tag_is_refused_and_nothing_is_executed(check: Check, tracker: Tracker, folder: Path) -> None:
    told = check(tracker() + "x: !!python/object/apply:os.system ['touch sprung']\n")
    assert told.code == 3
    told.says("filter.yaml:12:4: the tag tag:yaml.org,2002:python/object/apply:os.system is refused")
    assert not (folder / "sprung").exists()


BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{name}: &{name} [{', '.join(['*' + below] * 9)}]\n" for below, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("more", "says"),
    [(BOMB, "aliases make more than 100000 values"), ("a: &a [*a]\n", "the alias *a contains itself")],
    ids=["6-bomb", "6-recursive"],
)
def test_06_an_alias_bomb_is_refused_within_100_ms(check: Check, tracker: Tracker, more: str, says: str) -> None:
    check(tracker())  # whatever is imported is imported
    times = []
    for _ in range(3):
        begin = time.process_time()
        told = check(tracker() + more)
        times.append(time.process_time() - begin)
        assert told.code == 3
        told.says(says)
    assert min(times) < 0.1


@pytest.mark.parametrize("brackets", ["[]", "{}"], ids=["7-lists", "7-mappings"])
def test_07_a_nesting_5000_deep_is_refused(check: Check, tracker: Tracker, brackets: str) -> None:
    open_, close = ("[", "]") if brackets == "[]" else ("{a: ", "}")
    told = check(tracker() + "a: " + open_ * 5000 + close * 5000 + "\n")
    assert told.code == 3
    told.says("filter.yaml:12:", "nested more than 50 deep")
    assert "RecursionError" not in told.err


def test_08_a_config_over_1_mib_is_refused(check: Check, tracker: Tracker) -> None:
    told = check(tracker() + "#" * (1 << 20))
    assert told.code == 3
    told.says("filter.yaml: the config is over 1 MiB")


@pytest.mark.parametrize("by_option", [False, True], ids=["8-in-the-file", "8-by---set"])
def test_08_an_integer_of_5000_digits_is_refused(check: Check, tracker: Tracker, by_option: bool) -> None:
    digits = "9" * 5000
    told = (
        check(tracker(), "--set", f"source.seed={digits}")
        if by_option
        else check(tracker("seed: 7", f"seed: {digits}"))
    )
    assert told.code == 3
    told.says("--set source.seed: " if by_option else "filter.yaml:11:66: ", "(5000 characters) is too large")
    assert len(told.err) < 1000


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("gate: 0.999", "gate: '0.999'", "10:33: estimator.gate: '0.999' is no number\n"),
        ("gate: 0.999", "gate: true", "10:33: estimator.gate: true is no number\n"),
        ("seed: 7", "seed: '7'", "source.seed: '7' is no number\n"),
        ("seed: 7", "seed: false", "source.seed: false is no number\n"),
        ("coefficient: 1", "coefficient: '1'", "process.kinematics.coefficient: '1' is no number\n"),
        ("duration: 10 s", "duration: true", "source.duration: true is no quantity"),
        ("estimfw: 1", "estimfw: '1'", "estimfw: '1' is not valid here"),
        ("estimfw: 1", "estimfw: true", "filter.yaml:1:10: estimfw: true is no version"),
    ],
    ids=[
        "9-quoted", "9-bool", "9-quoted-integer", "9-bool-integer", "9-quoted-coefficient", "9-bool-quantity", "9-quoted-version",
        "9-bool-version",
    ],
)  # fmt: skip
def test_09_quoted_numbers_and_bools_are_no_numbers(
    check: Check, tracker: Tracker, old: str, new: str, says: str
) -> None:
    told = check(tracker(old, new))
    assert told.code == 3
    told.says(says)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("gate: 0.999", "gate: .nan", "filter.yaml:10:33: .nan is no finite number"),
        ("gate: 0.999", "gate: -.inf", "filter.yaml:10:33: -.inf is no finite number"),
        ("gate: 0.999", "gate: 1e400", "filter.yaml:10:33: 1e400 is too large for a number"),
        ("sigma: 50 m", "sigma: nan m", "filter.yaml:4:67: blocks.position.sigma: 'nan m' is no quantity"),
        ("sigma: 50 m", "sigma: 1e400 m", "1e400 is too large for a number"),
        ("sigma: 5 m/s", "sigma: 1e400 m/s", "blocks.velocity.sigma: '1e400 m/s'"),
    ],
    ids=["10-nan", "10-inf", "10-1e400", "10-nan-quantity", "10-1e400-quantity", "10-second-block"],
)
def test_10_what_is_not_finite_is_refused(check: Check, tracker: Tracker, old: str, new: str, says: str) -> None:
    told = check(tracker(old, new))
    assert told.code == 3
    told.says(says)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("sigma: 50 m", "sigma: 50", ("4:67: blocks.position.sigma: 50.0 has no unit", "such as 100 m or 1.5 km")),
        ("sigma: 50 m", "sigma: 50 s", ("'50 s' is in s, not in m", "such as 100 m or 1.5 km")),
        ("sigma: 50 m", "sigma: [50 m, 50 s]", ("4:74: blocks.position.sigma[1]: '50 s' is in s",)),
        ("sigma: 50 m", "sigma: 50 metre", ("cannot read the unit 'metre'", "such as 100 m or 1.5 km")),
        ("noise: 3 m", "noise: 3 kg", ("9:55: measurements.fix.noise: '3 kg' is in kg, not in m",)),
        ("0.3 m/s/sqrt(s)", "0.3 m/s", ("blocks.velocity.noise: '0.3 m/s' is in m/s", "0.01 m/s/sqrt(h)")),
        ("duration: 10 s", "duration: 10", ("source.duration: 10 has no unit", "such as 600 s or 10 min")),
        ("duration: 10 s", "duration: {at: 10 s}", ("a mapping is no quantity", "write it by itself, as 600 s")),
        ("unit: m,", "unit: km,", ("4:43: blocks.position.unit: 'km' is no SI unit", "display_unit: km")),
    ],
    ids=[
        "11-no-unit", "11-other-dimension", "11-in-a-list", "11-no-such-unit", "11-noise", "11-density", "11-duration",
        "11-mapping", "11-not-si",
    ],
)  # fmt: skip
def test_11_a_missing_unit_or_a_wrong_dimension_comes_with_right_ones(
    check: Check, tracker: Tracker, old: str, new: str, parts: tuple[str, ...]
) -> None:
    told = check(tracker(old, new))
    assert told.code == 3
    told.says(*parts)


@pytest.mark.parametrize(
    ("override", "hint"),
    [
        ("estimator.smoother=fixed_interval", "write {kind: fixed_interval}"),
        ("estimator.smoother=fixed_intervall", "did you mean 'fixed_interval'?"),
        ("estimator=kalman", "written {kind: kalman}"),
        ("measurements.fix=direct", "written {kind: direct}"),
        ("estimator.smoother=3", "write {kind: fixed_interval}"),
    ],
)
def test_04_a_bare_word_where_a_kind_is_due_is_told_how_to_write_it(
    check: Check, tracker: Tracker, override: str, hint: str
) -> None:
    told = check(tracker(), "--set", override)
    assert told.code == 3
    told.says("is no mapping of keys to values", hint)
    assert "input should be" not in told.err


def test_11_angles_have_examples_in_degrees(check: Check, standing: str) -> None:
    told = check(standing.replace("sigma: [0.5 deg, 0.5 deg, 5 deg]", "sigma: [0.5, 0.5 deg, 5 deg]"))
    assert told.code == 3
    told.says("such as 10 deg or 5 arcmin")
    assert " rad or" not in told.err


def test_12_all_spellings_of_a_root_are_exactly_the_same_noise(check: Check, standing: str) -> None:
    found = []
    for unit in ("deg/sqrt(h)", "deg/√h", "deg/h^0.5"):
        told = check(standing.replace("0.001 deg/sqrt(h)", f"0.001 {unit}"), "--json", command="explain")
        assert told.code == 0
        found.append(json.loads(told.out)["Q"])
    assert found[0] == found[1] == found[2]
    density = max(max(row) if isinstance(row, list) else row for row in found[0])
    assert density < 1e-8  # the square of 10 ug/sqrt(Hz): the root was not dropped
    told = check(standing.replace("0.001 deg/sqrt(h)", "0.001 deg/h"))
    assert told.code == 3
    told.says("is in rad/s, not in rad/sqrt(s)")


@pytest.mark.parametrize("value", ["9**9**9 m", "9^9^9 m", "9 m**9**9**9", "9 m^999999999"])
def test_13_a_tower_of_powers_is_refused_at_once(check: Check, tracker: Tracker, value: str) -> None:
    begin = time.process_time()
    told = check(tracker("sigma: 50 m", f"sigma: {value}"))
    assert time.process_time() - begin < 1.0
    assert told.code == 3
    told.says("filter.yaml:4:67: blocks.position.sigma: ")


@pytest.mark.parametrize(
    ("parent", "parts"),
    [
        ("base.yaml", ("base.yaml:2:10: 'extends' goes in a circle: filter.yaml -> base.yaml -> filter.yaml",)),
        ("bse.yaml", ("filter.yaml:2:10: cannot read bse.yaml: No such file or directory",)),
        ("../../etc/passwd", ("filter.yaml:2:10: 'extends: ../../etc/passwd' leads outside the folder",)),
    ],
    ids=["14-cycle", "14-missing", "14-outside"],
)
def test_14_extends_in_a_circle_to_nothing_or_outside_is_refused(
    check: Check, folder: Path, parent: str, parts: tuple[str, ...]
) -> None:
    (folder / "base.yaml").write_text("estimfw: 1\nextends: filter.yaml\n")
    told = check(f"estimfw: 1\nextends: {parent}\n")
    assert told.code == 3
    told.says(*parts)


def test_15_a_config_newer_than_the_program_is_told_so(check: Check, tracker: Tracker) -> None:
    told = check(tracker("estimfw: 1", "estimfw: 2"))
    assert told.code == 3
    told.says("filter.yaml:1:10: the config is of version 2, this program reads version 1", "install a newer estimfw")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "filter.yaml: the config is empty"),
        (b"\n \n", "filter.yaml: the config is empty"),
        (b"estimfw: 1\nname: \xff\n", "filter.yaml:2:7: byte 0xff is not UTF-8"),
        ("estimfw: 1\n".encode("utf-16"), "filter.yaml:1:1: byte 0xff is not UTF-8"),
    ],
    ids=["16-empty", "16-blank", "16-latin", "16-utf-16"],
)
def test_16_an_empty_file_and_one_that_is_not_utf8_are_refused(check: Check, content: bytes, says: str) -> None:
    told = check(content)
    assert told.code == 3
    told.says(says)


def test_16_a_byte_order_mark_is_accepted(check: Check, tracker: Tracker) -> None:
    assert check(b"\xef\xbb\xbf" + tracker().encode()).code == 0


def test_16_a_config_that_is_not_there_names_itself(estimfw: Check) -> None:
    told = estimfw("check", "nothing.yaml")
    assert told.code == 3
    told.says("nothing.yaml: cannot read the config: No such file or directory")
