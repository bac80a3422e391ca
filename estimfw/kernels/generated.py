"""Compiled scans for providers of plugins, cached on disk.

`compiled_scan` is written once more with the provider's own compiled ``step`` and ``correct`` in its import line, under a name
that is the hash of everything it is made of (its text, the kernels', the provider's module, the versions of numba and numpy), so
that numba's cache of machine code survives from one program run to the next and a stale one is never met. What cannot be
loaded is made anew.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from estimfw.model.nominal import CompiledScan

__all__ = ["cache_folder", "compiled_scan_for"]

PROVIDER_LINE = "from estimfw.kernels.no_provider import correct, step  # provider"


def cache_folder() -> Path:
    """``$ESTIMFW_CACHE``, else the user's cache folder, else a temporary one."""
    named = os.environ.get("ESTIMFW_CACHE")
    root = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser() / "estimfw"
    try:
        root.mkdir(parents=True, exist_ok=True)
        if os.access(root, os.W_OK):
            return root
    except OSError:
        pass
    return Path(tempfile.gettempdir()) / "estimfw"


def compiled_scan_for(provider: CompiledScan | None) -> Callable[..., Any]:
    """The ``scan`` function with this provider's step compiled in (None: without a provider)."""
    if provider is None:
        from estimfw.kernels.compiled_scan import scan

        plain: Callable[..., Any] = scan
        return plain
    text, name = _source(provider)
    if name in sys.modules:
        return sys.modules[name].scan  # type: ignore[no-any-return]
    folder = cache_folder() / name
    try:
        return _load(folder, name, text).scan  # type: ignore[no-any-return]
    except Exception:
        shutil.rmtree(folder, ignore_errors=True)
        return _load(folder, name, text).scan  # type: ignore[no-any-return]


def _source(provider: CompiledScan) -> tuple[str, str]:
    import numba
    import numpy as np

    here = Path(__file__).parent
    line = f"from {provider.module} import {provider.correct} as correct, {provider.step} as step"
    text = (here / "compiled_scan.py").read_text(encoding="utf-8").replace(PROVIDER_LINE, line)
    spec = importlib.util.find_spec(provider.module)
    made_of = [text, (here / "compiled.py").read_text(encoding="utf-8"), numba.__version__, np.__version__, sys.version]
    if spec is not None and spec.origin is not None:
        made_of.append(Path(spec.origin).read_text(encoding="utf-8"))
    return text, "estimfw_scan_" + hashlib.sha256("\n".join(made_of).encode()).hexdigest()[:16]


def _load(folder: Path, name: str, text: str) -> ModuleType:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.py"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".tmp", delete=False, encoding="utf-8") as file:
            file.write(text)
        Path(file.name).replace(path)
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
