"""Compiled scans, generated for the provider of a plugin, and compiled smoothers, cached on disk.

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
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from estimfw.kernels.completion import NOTHING, Completion, completion_text
from estimfw.model.nominal import CompiledScan

__all__ = ["cache_folder", "compiled_scan_for", "compiled_smoother"]

#: What is generated, each module behind those that it imports; the last is the scan, which has the provider's line.
MODULES = (
    "compiled_products", "compiled_discretise", "compiled_recursions", "compiled_fuse", "compiled_steps", "compiled_derived",
    "compiled_scan",
)  # fmt: skip
#: The same for a smoother.
SMOOTHER_MODULES = ("compiled_products", "compiled_recursions", "compiled_smooth")
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
    made: Callable[..., Any] = modules[-1].__dict__.setdefault("checked", _Checked(modules, foreign, modules[-1].scan))
    return made


def compiled_smoother() -> ModuleType:
    """`estimfw.kernels.compiled_smooth` as machine code that is never older than what it is made of."""
    root, last = cache_folder(), SMOOTHER_MODULES[-1]
    texts = _renamed(SMOOTHER_MODULES, {last: (_source(last), [_source("smooth")])})  # whose constants it takes over
    modules = [_load(root, name, text) for name, text in texts.values()]
    own = modules[-1]
    checked = ModuleType("compiled_smoother", own.__doc__)
    checked.__dict__.update({name: _Checked(modules, [], getattr(own, name)) for name in own.__all__})
    made: ModuleType = own.__dict__.setdefault("checked", checked)
    return made


class _Checked:
    """A function that notes the checksums of its machine code on disk as often as some was made."""

    def __init__(self, modules: list[ModuleType], foreign: list[tuple[str, str]], function: Any) -> None:
        self.modules, self.foreign, self.function, self.known = modules, foreign, function, 0

    def __call__(self, *args: Any) -> Any:
        try:
            result = self.function(*args)
        except Exception:
            if self.known:
                raise
            _discard(self.foreign)
            result = self.function(*args)
        if self.known != len(self.function.overloads):
            self.known = len(self.function.overloads)
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
    """Name and text of each module of a scan, in the order in which they are imported."""
    line = f"from {provider.module} import {provider.correct} as correct, {provider.step} as step"
    scan = _source(MODULES[-1]).replace(PROVIDER_LINE, line)
    given = {MODULES[-1]: (scan, [_origin(provider.module)])}
    if completion != NOTHING:
        twins = [_origin(name) for name in dict.fromkeys(name for name, _ in _twins(completion))]
        given["compiled_derived"] = completion_text(completion), twins
    return list(_renamed(MODULES, given).values())


def _renamed(
    modules: Sequence[str], given: Mapping[str, tuple[str, list[str]]] = MappingProxyType({})
) -> dict[str, tuple[str, str]]:
    """Name and text by module; names tell what the text is and what it imports.

    ``given``: a text in place of the module's own, and what else it is made of.
    """
    import numba
    import numpy as np

    shared = [*map(_source, CONSTANTS), numba.__version__, np.__version__, sys.version]
    made: dict[str, tuple[str, str]] = {}
    for module in modules:
        text, own = given[module] if module in given else (_source(module), [])
        for earlier, (name, _) in made.items():
            text = text.replace(f"from estimfw.kernels.{earlier} import", f"from {name} import")
        made[module] = f"estimfw_{module}_{_hash([text, *shared, *own])}", text
    return made


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
