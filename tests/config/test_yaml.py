"""Hostile and mistaken YAML: refused at its line and column, at once, with nothing executed."""

from __future__ import annotations

import contextlib
import json
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimfw.config.document import Document
from estimfw.config.load import load_document, read_document
from estimfw.config.yaml_nodes import MAX_DEPTH, nodes_of
from estimfw.errors import ConfigError


def refusal(text: str) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        read_document(text, "a.yaml")
    assert caught.value.exit_code == 3
    return caught.value


def place(error: ConfigError) -> str:
    return str(error.location)


def test_a_syntax_error_has_line_and_column() -> None:
    error = refusal("estimfw: 1\nsite: {latitude: 34 deg\nname: x\n")
    assert place(error) == "a.yaml:3:5"
    assert "not YAML" in error.message
    assert "line 2" in str(error.hint)


@pytest.mark.parametrize(
    "text", ["a: [1, 2", 'a: "x', "a: b: c", "\ta: 1", "a: *", "a: 'x\n", "%YAML 9\n---\na: 1", "@a: 1"]
)
def test_every_syntax_error_has_a_place(text: str) -> None:
    error = refusal(text)
    assert error.location is not None and error.location.line is not None


@pytest.mark.parametrize("text", ["estimfw: 1\nname: x\nname: y\n", '{"estimfw": 1, \n"name": "x",\n"name": "y"}'])
def test_a_duplicate_key_names_both_lines_in_yaml_and_json(text: str) -> None:
    error = refusal(text)
    assert "duplicate key 'name'" in error.message
    assert place(error).startswith("a.yaml:3:")
    assert "a.yaml:2:1" in str(error.hint)


def test_duplicate_keys_deep_in_the_file_are_found() -> None:
    assert place(refusal("a:\n  - b: {c: 1, c: 2}\n")) == "a.yaml:2:15"


@pytest.mark.parametrize(
    "value",
    ["!!python/object/apply:os.system ['touch PWNED']", "!!python/name:os.system", "!!int '3'", "!custom x", "! x",
     "!!binary aGk=", "!!set {a}", "{b: !!str 1}"],
)  # fmt: skip
def test_a_tag_is_refused_and_nothing_is_executed(value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    error = refusal(f"estimfw: 1\na: {value}\n")
    assert "tag" in error.message
    assert place(error).startswith("a.yaml:2:")
    assert list(tmp_path.iterdir()) == []


LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{name}: &{name} [{','.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefghi", "bcdefghij", strict=True)
)
STAIRS = "a0: &a0 x\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 200))


@pytest.mark.parametrize("text", [LAUGHS, STAIRS, "a: &a [*a]", "a: &a {b: *a}", "a: &a {b: [1, {c: *a}]}", "&a [*a]"])
def test_alias_bombs_and_recursive_aliases_are_refused_within_100_ms(text: str) -> None:
    read_document("warm: up")
    start = time.process_time()
    error = refusal(text)
    assert time.process_time() - start < 0.1
    assert "alias" in error.message
    assert error.location is not None and error.location.line is not None


def test_an_honest_alias_is_a_copy() -> None:
    data = read_document("a: &a {b: [1]}\nc: *a\n").data
    data["a"]["b"].append(2)
    assert data["c"] == {"b": [1]}


@pytest.mark.parametrize("text", ["[" * 5000, "{a: " * 5000, "a: " + "[" * 5000 + "]" * 5000, "- " * 5000])
def test_5000_deep_nesting_is_refused_without_a_recursion_error(text: str) -> None:
    start = time.process_time()
    error = refusal(text)
    assert time.process_time() - start < 1.0
    assert "nested" in error.message


def test_the_deepest_allowed_nesting_is_read() -> None:
    levels = MAX_DEPTH - 1
    read_document("a: " + "[" * levels + "]" * levels)
    assert "nested" in refusal("a: " + "[" * (levels + 1) + "]" * (levels + 1)).message


@pytest.mark.parametrize("text", ["9" * 5000, "-" + "9" * 5000, "0x" + "f" * 5000, "9223372036854775808"])
def test_an_integer_that_no_64_bits_hold_is_refused(text: str) -> None:
    error = refusal(f"estimfw: 1\na: {text}\n")
    assert "too large" in error.message
    assert place(error) == "a.yaml:2:4"
    assert len(str(error)) < 200


@pytest.mark.parametrize("text", [".nan", ".NaN", ".inf", "-.inf", "+.INF", "1e400", "-1e999"])
def test_a_number_that_is_not_finite_is_refused(text: str) -> None:
    error = refusal(f"a: [1, {text}]")
    assert place(error) == "a.yaml:1:8"
    assert text in error.message


def test_what_other_readers_misread_is_read_as_written() -> None:
    data = read_document(
        "a: 1e-3\nb: 12:30:45\nc: on\nd: 1_000\ne: 2024-01-01\nf: 012\ng: ~\nh: 'null'\ni: 9223372036854775807"
    ).data
    assert data == {"a": 1e-3, "b": "12:30:45", "c": "on", "d": "1_000", "e": "2024-01-01", "f": 12, "g": None, "h": "null",
                    "i": 2**63 - 1}  # fmt: skip


@pytest.mark.parametrize(
    "text", ["1: a", "true: a", "null: a", "1.5: a", "[a]: b", "{a: b}: c", ": x", "a: &k b\n*k : 1"]
)
def test_a_key_that_is_no_text_is_refused(text: str) -> None:
    error = refusal(text)
    assert "key" in error.message
    assert error.location is not None


def test_the_merge_key_is_refused_with_the_other_way() -> None:
    assert "extends" in str(refusal("a: &a {b: 1}\nc: {<<: *a}").hint)


def test_a_second_document_is_refused() -> None:
    assert place(refusal("a: 1\n---\nb: 2\n")) == "a.yaml:2:1"


@pytest.mark.parametrize("text", ["[1, 2]", "hello", "3", "null"])
def test_a_config_that_is_no_mapping_is_refused(text: str) -> None:
    assert "mapping" in refusal(text).message


@pytest.mark.parametrize("text", ["a: \x00", "a: \x07", 'a: "\\ud800"', "a: \ufffe"])
def test_characters_outside_yaml_are_refused(text: str) -> None:
    assert "character" in refusal(text).message


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "empty"), (b"   \n", "empty"), (b"\xef\xbb\xbf", "empty"), (b"# only a comment\n", "empty"),
     (b"a: \xff\n", "0xff is not UTF-8"), ("a: 1".encode("utf-16"), "not UTF-8"), (b"a: 1\n" + b"#" * (1 << 20), "over 1 MiB")],
)  # fmt: skip
def test_files_that_are_no_config_are_refused(content: bytes, says: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=says) as caught:
        load_document(path)
    assert "a.yaml" in str(caught.value.location)


def test_a_byte_that_is_not_utf8_has_line_and_column(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a: 1\nb: x\xe9\n")
    with pytest.raises(ConfigError) as caught:
        load_document(path)
    assert str(caught.value.location).endswith("a.yaml:2:5")


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbfname: x\n")
    document = load_document(path)
    assert document.data == {"name": "x"}
    assert document.locate(("name",), key=True).column == 1


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(ConfigError, match="cannot read"):
            load_document(path)


def test_every_value_and_key_can_be_located() -> None:
    document = read_document("a:\n  - x\n  - {b: 1,\n     c: 2}\n", "a.yaml")
    assert str(document.locate(("a", 1, "c"))) == "a.yaml:4:9"
    assert str(document.locate(("a", 1, "c"), key=True)) == "a.yaml:4:6"
    assert str(document.locate(("a", 1, "missing"))) == "a.yaml:3:5"


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet=st.sampled_from(list("ab1:-[]{}*&!|>'\"#,?%@\n\t .e~\\")), max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(ConfigError):
        assert isinstance(read_document(text), Document)


json_like = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False, allow_infinity=False) | st.text(
        alphabet=st.characters(blacklist_categories=["Cs", "Cc"], max_codepoint=0xD7FF), max_size=8
    ),
    lambda below: st.lists(below, max_size=4) | st.dictionaries(st.from_regex(r"[a-z]{1,5}", fullmatch=True), below, max_size=4),
    max_leaves=12,
)  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(st.dictionaries(st.sampled_from(["aa", "bb", "cc"]), json_like), st.sampled_from([None, 2]))
def test_json_from_another_writer_reads_back(data: dict[str, object], indent: int | None) -> None:
    assert nodes_of(json.dumps(data, ensure_ascii=indent is None, indent=indent), "a.yaml").plain() == data
