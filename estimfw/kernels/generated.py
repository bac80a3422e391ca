"""Compiled scans, generated for the provider of a plugin and cached on disk.

Modules are written into the cache folder: those of the kernels, `compiled_derived` with the twins of the plan's derived
variables, and `compiled_scan` with the provider's own compiled ``step`` and ``correct`` in its import line. Their names are
hashes of everything they are made of (their text with the names of those that they import, the constants that they take over,
the modules of plugins, the versions of Python, numpy and numba), so a stale one is never met. numba keeps machine code beside
them; it is used only while its checksums, noted when it was made, still hold. What is damaged is made anew.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib
import importlib.util
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from estimfw.kernels.completion import NOTHING, Completion, completion_text
from estimfw.model.nominal import CompiledScan

__all__ = ["cache_folder", "compiled_scan_for"]

#: What is generated, each module behind those that it imports; the last is the scan, which has the provider's line.
MODULES = (
    "compiled_products", "compiled_discretise", "compiled_recursions", "compiled_fuse", "compiled_steps", "compiled_derived",
    "compiled_scan",
)  # fmt: skip
#: Modules whose constants numba freezes into those.
CONSTANTS = ("fuse", "ud")
PROVIDER_LINE = "from estimfw.kernels.no_provider import correct, step  # provider"
NO_PROVIDER = CompiledScan("estimfw.kernels.no_provider", "step", "correct")
SUMS = "checksums.json"


def cache_folder() -> Path:
    """``$ESTIMFW_CACHE``, else the user's cache folder, else a temporary one of this process that nobody else can write."""
    named = os.environ.get("ESTIMFW_CACHE")
    try:
        root = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser() / "estimfw"
        root.mkdir(parents=True, exist_ok=True)
        if os.access(root, os.W_OK):
            return root
    except (OSError, RuntimeError):
        pass
    return _temporary()


@cache
def _temporary() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="estimfw_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def compiled_scan_for(provider: CompiledScan | None, completion: Completion = NOTHING) -> Callable[..., Any]:
    """The ``scan`` function with this provider's step (None: without a provider) and derived variables compiled in."""
    provider = provider or NO_PROVIDER
    root = cache_folder()
    modules = [_load(root, name, text) for name, text in _texts(provider, completion)]
    foreign = [(provider.module, provider.step), (provider.module, provider.correct), *_twins(completion)]
    made: Callable[..., Any] = modules[-1].__dict__.setdefault("checked", _Checked(modules, foreign))
    return made


class _Checked:
    """A scan that notes the checksums of its machine code on disk as often as some was made."""

    def __init__(self, modules: list[ModuleType], foreign: list[tuple[str, str]]) -> None:
        self.modules, self.foreign, self.scan, self.known = modules, foreign, modules[-1].scan, 0

    def __call__(self, *args: Any) -> Any:
        try:
            result = self.scan(*args)
        except Exception:
            if self.known:
                raise
            _discard(self.foreign)
            result = self.scan(*args)
        if self.known != len(self.scan.overloads):
            self.known = len(self.scan.overloads)
            for module in self.modules:
                _note(module)
        return result


def _discard(foreign: list[tuple[str, str]]) -> None:
    """numba's cache of a plugin's module lies beside that module, without checksums: where it may be damaged, it goes."""
    for module, name in foreign:
        folder = getattr(importlib.import_module(module), name).stats.cache_path
        for path in Path(folder).glob(f"{module.rpartition('.')[2]}.*.nb[ic]") if folder else ():
            path.unlink(missing_ok=True)


def _twins(completion: Completion) -> list[tuple[str, str]]:
    return list(dict.fromkeys((c.module, c.name) for c in (*completion.process, *completion.end)))


def _texts(provider: CompiledScan, completion: Completion = NOTHING) -> list[tuple[str, str]]:
    """Name and text of each module, in the order in which they are imported."""
    import numba
    import numpy as np

    shared = [*map(_source, CONSTANTS), numba.__version__, np.__version__, sys.version]
    line = f"from {provider.module} import {provider.correct} as correct, {provider.step} as step"
    made: dict[str, tuple[str, str]] = {}
    for module in MODULES:
        derived = module == "compiled_derived" and completion != NOTHING
        text = completion_text(completion) if derived else _source(module)
        own = [_origin(name) for name in dict.fromkeys(name for name, _ in _twins(completion))] if derived else []
        for earlier, (name, _) in made.items():
            text = text.replace(f"from estimfw.kernels.{earlier} import", f"from {name} import")
        if module == MODULES[-1]:
            text, own = text.replace(PROVIDER_LINE, line), [_origin(provider.module)]
        made[module] = f"estimfw_{module}_{_hash([text, *shared, *own])}", text
    return list(made.values())


def _origin(module: str) -> str:
    """The text of a plugin's module."""
    spec = importlib.util.find_spec(module)
    return Path(spec.origin).read_text(encoding="utf-8") if spec is not None and spec.origin is not None else ""


def _source(module: str) -> str:
    return (Path(__file__).parent / f"{module}.py").read_text(encoding="utf-8")


def _hash(parts: list[str]) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def _load(root: Path, name: str, text: str) -> ModuleType:
    """Import a generated module from the cache folder; its file and its machine code are made anew where they are wrong."""
    if name in sys.modules:
        return sys.modules[name]
    folder = root / name
    path = folder / f"{name}.py"
    if not _sound(folder) or path.read_bytes() != text.encode():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        _write(path, text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _checksums(folder: Path) -> dict[str, str]:
    """Of the module and of all that Python and numba keep of it."""
    found = sorted([*folder.glob("*.py"), *folder.glob("__pycache__/*")])
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in found}


def _sound(folder: Path) -> bool:
    """Whether everything is as it was noted when it was made."""
    try:
        noted = json.loads((folder / SUMS).read_text(encoding="utf-8"))
        return bool(noted == _checksums(folder))
    except (OSError, ValueError):
        return False


def _note(module: ModuleType) -> None:
    folder = Path(str(module.__file__)).parent
    try:
        _write(folder / SUMS, json.dumps(_checksums(folder)))
    except OSError:
        # Without its checksums the code is made anew the next time: slower, not wrong.
        shutil.rmtree(folder, ignore_errors=True)


def _write(path: Path, text: str) -> None:
    """Whole or not at all."""
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8", newline=""
    ) as file:
        file.write(text)
    Path(file.name).replace(path)
