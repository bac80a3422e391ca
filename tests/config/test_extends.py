"""One config laid over another, and values from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from estimfw.config.load import load_document
from estimfw.errors import ConfigError, UsageError


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def refusal(path: Path, *overrides: str) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        load_document(path, overrides)
    assert caught.value.exit_code == 3
    return caught.value


def test_mappings_are_merged_deep_and_lists_replaced(tmp_path: Path) -> None:
    write(tmp_path, "base.yaml", "name: base\nblocks: {v: {kind: a, sigma: 1 m}, w: {kind: b}}\npolicies: [x, y]\n")
    main = write(tmp_path, "main.yaml", "extends: base.yaml\nname: main\nblocks: {v: {sigma: 2 m}}\npolicies: [z]\n")
    document = load_document(main)
    assert document.data == {
        "name": "main", "blocks": {"v": {"kind": "a", "sigma": "2 m"}, "w": {"kind": "b"}}, "policies": ["z"],
    }  # fmt: skip
    assert [Path(f).name for f in document.files] == ["main.yaml", "base.yaml"]


def test_each_value_is_located_in_the_file_that_it_comes_from(tmp_path: Path) -> None:
    write(tmp_path, "base.yaml", "blocks:\n  v: {kind: a, sigma: 1 m}\n")
    main = write(tmp_path, "main.yaml", "extends: base.yaml\nblocks:\n  v:\n    sigma: 2 m\n")
    document = load_document(main)
    assert str(document.locate(("blocks", "v", "kind"))).endswith("base.yaml:2:13")
    assert str(document.locate(("blocks", "v", "sigma"))).endswith("main.yaml:4:12")


def test_another_kind_replaces_the_settings_of_the_old_one(tmp_path: Path) -> None:
    write(tmp_path, "base.yaml", "source: {kind: simulate, duration: 600 s}\n")
    main = write(tmp_path, "main.yaml", "extends: base.yaml\nsource: {kind: csv, path: a.csv}\n")
    assert load_document(main).data == {"source": {"kind": "csv", "path": "a.csv"}}


def test_a_chain_is_followed_relative_to_each_file(tmp_path: Path) -> None:
    write(tmp_path, "x/a.yaml", "a: 1\nb: 1\nc: 1\n")
    write(tmp_path, "x/b.yaml", "extends: a.yaml\nb: 2\nc: 2\n")
    main = write(tmp_path, "main.yaml", "extends: x/b.yaml\nc: 3\n")
    assert load_document(main).data == {"a": 1, "b": 2, "c": 3}


def test_a_circle_is_refused_naming_its_files(tmp_path: Path) -> None:
    write(tmp_path, "b.yaml", "name: b\nextends: ./a.yaml\n")
    main = write(tmp_path, "a.yaml", "extends: b.yaml\n")
    error = refusal(main)
    assert "circle" in error.message
    assert "b.yaml" in error.message
    assert str(error.location).endswith("b.yaml:2:10")


def test_extending_itself_is_a_circle(tmp_path: Path) -> None:
    assert "circle" in refusal(write(tmp_path, "a.yaml", "extends: a.yaml\n")).message


def test_a_missing_file_is_refused_where_it_is_named(tmp_path: Path) -> None:
    error = refusal(write(tmp_path, "a.yaml", "name: x\nextends: none.yaml\n"))
    assert "none.yaml" in error.message
    assert str(error.location).endswith("a.yaml:2:10")


@pytest.mark.parametrize("through_link", [False, True])
def test_a_file_outside_the_folder_of_the_config_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, through_link: bool
) -> None:
    secret = write(tmp_path, "secret.yaml", "name: secret\n")
    main = write(tmp_path, "project/a.yaml", f"extends: {'link.yaml' if through_link else '../secret.yaml'}\n")
    if through_link:
        (main.parent / "link.yaml").symlink_to(secret)
    monkeypatch.chdir(main.parent)
    error = refusal(main)
    assert "outside" in error.message
    assert str(error.location).endswith("a.yaml:1:10")
    monkeypatch.chdir(tmp_path)
    assert load_document(main).data == {"name": "secret"}


@pytest.mark.parametrize("value", ["[a.yaml]", "3", "null", "{}", '"a\\0b"'])
def test_extends_names_one_file(tmp_path: Path, value: str) -> None:
    assert refusal(write(tmp_path, "a.yaml", f"extends: {value}\n")).location is not None


def test_a_newer_version_is_refused_wherever_it_stands(tmp_path: Path) -> None:
    write(tmp_path, "base.yaml", "estimfw: 2\nunheard_of: 1\n")
    error = refusal(write(tmp_path, "a.yaml", "estimfw: 1\nextends: base.yaml\n"))
    assert "version 2" in error.message
    assert str(error.location).endswith("base.yaml:1:10")
    assert "newer estimfw" in str(error.hint)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return write(tmp_path, "a.yaml", "a: {b: [1, {c: 2}], d: x}\n")


def test_values_are_set_by_path_from_left_to_right(config: Path) -> None:
    data = load_document(
        config, ["a.b[0]=0.1 m/s", "a.b[1].c={k: [1, on]}", "a.d=5", "a.d=1e-3", "new.deep.key='3'"]
    ).data
    assert data == {"a": {"b": ["0.1 m/s", {"c": {"k": [1, "on"]}}], "d": 1e-3}, "new": {"deep": {"key": "3"}}}


def test_a_value_that_was_set_is_located_at_the_option(config: Path) -> None:
    document = load_document(config, ["a.b[0]=x"])
    assert str(document.locate(("a", "b", 0))) == "--set a.b[0]"
    assert str(document.locate(("a", "b", 1))).endswith("a.yaml:1:12")


@pytest.mark.parametrize(
    ("override", "says"),
    [("a.b[2]=1", "a.b[2] is not there"), ("a.d.e=1", "a.d is no mapping"), ("a.d[0]=1", "a.d is no list"),
     ("a.b.c=1", "a.b is no mapping"), ("a.new[0]=1", "a.new is no list"), ("a.d=[1", "not YAML"), ("a.d=!!int '3'", "tag"),
     ("a.d=.nan", "finite"), ("a.d={x: 1, x: 2}", "duplicate"), ("a.d=" + "[" * 5000, "nested"), ("a.d=", "no value"),
     ("a.d=&a [*a]", "contains itself"), ("a" + ".a" * 60 + "=1", "nested")],
)  # fmt: skip
def test_a_wrong_override_is_refused_at_the_option(config: Path, override: str, says: str) -> None:
    error = refusal(config, override)
    assert says in error.message
    assert error.location is not None
    assert error.location.file == f"--set {override.partition('=')[0]}"[:86]


@pytest.mark.parametrize(
    "override", ["", "a", "=1", "a b=1", "a[x]=1", "a..b=1", "a.[0]=1", "a[-1]=1", "[0]=1", "1a=2"]
)
def test_what_is_no_override_is_refused_with_the_form(config: Path, override: str) -> None:
    assert "a.b[0]=value" in str(refusal(config, override).hint)


def test_overrides_leave_the_files_content_alone(config: Path) -> None:
    first = load_document(config)
    load_document(config, ["a.d=changed"])
    assert first.data["a"]["d"] == "x"


@pytest.fixture
def named(tmp_path: Path) -> Path:
    return write(tmp_path, "a.yaml", "blocks: {level: {kind: k, sigma: 1}, other: {kind: k}}\nfree: {x: {y: 1}}\n")


def test_a_setting_of_a_component_that_is_not_there_is_a_misspelt_name(named: Path) -> None:
    error = refusal(named, "blocks.levl.sigma=1")
    assert error.message == "there is no 'levl' in blocks to set 'sigma' of"
    assert "did you mean 'level'?" in str(error.hint)
    assert str(error.location) == "--set blocks.levl.sigma"


def test_a_component_is_made_by_its_kind_and_then_has_settings(named: Path) -> None:
    data = load_document(named, ["blocks.new.kind=k", "blocks.new.sigma=2", "free.z.y=3"]).data
    assert data["blocks"]["new"] == {"kind": "k", "sigma": 2}
    assert data["free"] == {"x": {"y": 1}, "z": {"y": 3}}


def test_overrides_can_be_a_mapping(named: Path) -> None:
    overrides = {"blocks.level.sigma": "0.1 m/s", "blocks.other": {"kind": "q", "on": True}, "free.x.y": [1, 2.5, None]}
    assert load_document(named, overrides).data == {
        "blocks": {"level": {"kind": "k", "sigma": "0.1 m/s"}, "other": {"kind": "q", "on": True}},
        "free": {"x": {"y": [1, 2.5, None]}},
    }


def test_one_text_is_no_list_of_overrides(named: Path) -> None:
    with pytest.raises(UsageError, match=r"one text, a list is due\s+write \['free\.x\.y=2'\]"):
        load_document(named, "free.x.y=2")
    with pytest.raises(UsageError, match="Path is not JSON serializable"):
        load_document(named, {"free.x.y": named})
