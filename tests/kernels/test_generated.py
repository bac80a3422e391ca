"""The cache of generated code: used where it is sound, made anew where anything about it is not.

The kernels are replaced by tiny ones, so that each compilation takes a moment; everything around them is real.
"""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimfw.kernels import completion as derived
from estimfw.kernels import generated
from estimfw.model.nominal import CompiledScan

KERNELS = """
from numba import njit

@njit(cache=True)
def tripled(x):
    return 3.0 * x
"""
SCAN = """
from numba import njit

from estimfw.kernels.compiled_products import tripled
from estimfw.kernels.no_provider import correct, step  # provider

@njit(cache=True)
def scan(values):
    step(values, values, values, values, values)
    return tripled(values[0])
"""
PROVIDER = """
from numba import njit

@njit(cache=True)
def step(state, sample, params, process_row, end_row):
    state[0] += 10.0

@njit(cache=True)
def correct(state, delta, params):
    pass
"""
Call = Callable[..., float]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Sources that may be changed, and an empty cache."""
    for name, text in {
        "compiled_products.py": KERNELS,
        "compiled_scan.py": SCAN,
        "fuse.py": "A = 1\n",
        "ud.py": "B = 1\n",
    }.items():
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(generated, "__file__", str(tmp_path / "generated.py"))
    monkeypatch.setattr(generated, "MODULES", ("compiled_products", "compiled_scan"))
    monkeypatch.setenv("ESTIMFW_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    yield tmp_path
    forget()


def forget() -> None:
    """As a new process: no generated module is loaded."""
    for name in [n for n in sys.modules if n.startswith(("estimfw_compiled_", "made_up_provider"))]:
        del sys.modules[name]


def run(value: float = 2.0, provider: CompiledScan | None = None) -> tuple[float, int]:
    """Result of a scan in a new process, and how many functions had to be compiled for it."""
    forget()
    scan: Any = generated.compiled_scan_for(provider)
    result = scan(np.array([value]))
    return float(result), sum(scan.function.stats.cache_misses.values())


def files(folder: Path, pattern: str) -> list[Path]:
    found = sorted((folder / "cache").glob(f"*/{pattern}"))
    assert found, pattern
    return found


def test_sound_machine_code_is_used_again(folder: Path) -> None:
    assert run() == (6.0, 1)
    assert run() == (6.0, 0)
    assert run(5.0) == (15.0, 0)


@pytest.mark.parametrize("pattern", ["__pycache__/*.nbc", "__pycache__/*.nbi", "__pycache__/*.pyc", "checksums.json"])
@pytest.mark.parametrize("damage", ["cut", "flipped", "emptied"])
def test_a_damaged_cache_is_made_anew(folder: Path, pattern: str, damage: str) -> None:
    run()
    for path in files(folder, pattern):
        data = path.read_bytes()
        middle = len(data) // 2
        changed = {
            "cut": data[:middle],
            "flipped": data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :],
            "emptied": b"",
        }
        path.write_bytes(changed[damage])
    assert run() == (6.0, 1)
    assert run() == (6.0, 0)


def test_a_generated_module_that_somebody_changed_is_not_run(folder: Path) -> None:
    run()
    for path in files(folder, "*.py"):
        path.write_text(path.read_text() + "\nraise RuntimeError('not ours')\n")
    assert run() == (6.0, 1)


def test_foreign_files_among_the_machine_code_make_it_unsound(folder: Path) -> None:
    run()
    for path in files(folder, "__pycache__"):
        (path / "foreign.nbc").write_bytes(b"?")
    assert run() == (6.0, 1)
    assert not list((folder / "cache").glob("*/__pycache__/foreign.nbc"))


@pytest.mark.parametrize("name", ["compiled_products.py", "fuse.py", "ud.py"])
def test_code_made_from_older_sources_is_never_met(folder: Path, name: str) -> None:
    run()
    (folder / name).write_text((folder / name).read_text().replace("3.0", "4.0").replace("= 1", "= 2"))
    assert run() == (8.0 if name == "compiled_products.py" else 6.0, 1)
    assert len(files(folder, "*.py")) == 4


def test_generated_code_imports_generated_code_alone() -> None:
    # A module of the package would be one whose changes numba's cache does not see.
    last = generated.SMOOTHER_MODULES[-1]
    made = (generated._texts(generated.NO_PROVIDER), list(generated._renamed(generated.SMOOTHER_MODULES).values()))
    for texts in made:
        names = {name for name, _ in texts}
        imported = {w for _, text in texts for w in re.findall(r"^from (\S*compiled\S*) import", text, re.MULTILINE)}
        assert len(imported) == len(names) - 1 and imported < names
    there = {path.stem for path in Path(generated.__file__).parent.glob("compiled_*.py")}
    assert there == {*generated.MODULES, last}


def test_a_smoother_made_from_older_sources_is_never_met(monkeypatch: pytest.MonkeyPatch) -> None:
    before = generated._renamed(generated.SMOOTHER_MODULES)
    monkeypatch.setattr(generated, "_source", lambda module, read=generated._source: read(module) + "# changed\n")
    after = generated._renamed(generated.SMOOTHER_MODULES)
    assert all(before[module][0] != after[module][0] for module in generated.SMOOTHER_MODULES)


def test_a_provider_is_compiled_in_and_its_changes_are_seen(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(folder))
    provider = CompiledScan("made_up_provider", "step", "correct")
    source = folder / "made_up_provider.py"
    source.write_text(PROVIDER)
    assert run(2.0, provider) == (36.0, 1)
    assert run(2.0, provider) == (36.0, 0)
    source.write_text(PROVIDER.replace("10.0", "100.0"))
    importlib.invalidate_caches()
    assert run(2.0, provider) == (306.0, 1)
    assert run(2.0) == (6.0, 1)


def test_damaged_machine_code_of_a_providers_own_module_is_made_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(folder))
    provider = CompiledScan("made_up_provider", "step", "correct")
    (folder / "made_up_provider.py").write_text(PROVIDER)
    importlib.invalidate_caches()
    run(2.0, provider)
    damaged = list((folder / "__pycache__").glob("made_up_provider*.nb[ic]"))
    assert damaged
    for path in [*damaged, *files(folder, "__pycache__/*.nbi")]:
        path.write_bytes(b"damaged")
    assert run(2.0, provider)[0] == 36.0


def test_a_cache_that_cannot_be_written_is_replaced_by_a_private_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "in_the_way").write_text("")
    monkeypatch.setenv("ESTIMFW_CACHE", str(folder / "in_the_way"))
    found = generated.cache_folder()
    assert found.is_dir() and found != folder / "in_the_way"
    assert found.stat().st_mode & 0o077 == 0
    assert run() == (6.0, 1)


DERIVED_SCAN = SCAN.replace(
    "from estimfw.kernels.compiled_products import tripled",
    "from estimfw.kernels.compiled_derived import complete_end\nfrom estimfw.kernels.compiled_products import tripled",
).replace("    step(", "    complete_end(values)\n    step(")
TWIN = """
from numba import njit

@njit(cache=True)
def doubled(x, out):
    out[0] = 2.0 * x[0]
"""


def test_twins_of_derived_variables_are_compiled_in_and_their_changes_are_seen(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(generated, "MODULES", ("compiled_products", "compiled_derived", "compiled_scan"))
    monkeypatch.syspath_prepend(str(folder))
    (folder / "compiled_scan.py").write_text(DERIVED_SCAN)
    source = folder / "made_up_provider_twin.py"
    source.write_text(TWIN)
    importlib.invalidate_caches()
    # row[1] = row[0] + 0.5 row[0]^2 is held in work space; the twin of it is written over row[0].
    call = derived.Call("made_up_provider_twin", "doubled", ((1, 2),), (0, 1), ((1, ((1.0, (0,)), (0.5, (0, 0)))),))
    completion = derived.Completion((), (call,), 2)

    def run_completed() -> float:
        forget()
        row = np.array([2.0, 0.0])
        return float(generated.compiled_scan_for(None, completion)(row))

    assert run_completed() == 3.0 * 2.0 * (2.0 + 0.5 * 4.0)
    # Of another size: Python takes a source of the same second and size for the same.
    source.write_text(TWIN.replace("2.0", "5.00"))
    importlib.invalidate_caches()
    assert run_completed() == 3.0 * 5.0 * 4.0
