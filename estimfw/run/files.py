"""Files that are either whole or not there: a reader never meets half a result, and a failure costs no old one."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from glob import escape
from pathlib import Path

from estimfw.errors import DataError, Location
from estimfw.run.lock import file_lock, folder_lock, lock_of_file

__all__ = ["output_files", "output_folder", "refuse_existing", "write_atomically", "write_bytes", "write_text"]

PARTIAL = ".estimfw-partial"


def write_atomically(path: Path, writer: Callable[[Path], None], *, force: bool = False) -> Path:
    """Let ``writer`` fill a temporary file beside ``path``, then put it in its place in one step.

    Parameters
    ----------
    path : Path
        Where the file shall be. A symbolic link is followed.
    writer : callable
        Gets the path of an empty temporary file in the same folder and fills it.
    force : bool
        Replace a file that is there. Its permissions are kept.

    Returns
    -------
    Path
        ``path``, as given.

    Raises
    ------
    DataError
        The file exists and ``force`` is off, or it cannot be written (disk full, read-only, no such folder). What was
        there before is untouched, and no temporary file stays behind; the same holds for any exception of ``writer``.
    """
    refuse_existing(path, force=force)
    try:
        target = path.resolve()
        partial = _new_partial(target)
    except (OSError, RuntimeError) as fault:  # Python < 3.13 raises RuntimeError for a loop of links
        raise _cannot_write(path, fault) from fault
    try:
        writer(partial)
        _flush_to_disk(partial)
        refuse_existing(path, force=force)
        if target.exists():
            shutil.copymode(target, partial)
        partial.replace(target)
    except OSError as fault:
        raise _cannot_write(path, fault) from fault
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
    with suppress(OSError):  # the new name itself; some file systems cannot
        _flush_to_disk(target.parent)
    return path


def write_bytes(path: Path, content: bytes | memoryview, *, force: bool = False) -> Path:
    """`write_atomically` for what is at hand in memory."""

    def fill(partial: Path) -> None:
        partial.write_bytes(content)

    return write_atomically(path, fill, force=force)


def write_text(path: Path, text: str, *, force: bool = False) -> Path:
    """`write_atomically` for a text, in UTF-8 with its line ends as they are."""
    return write_bytes(path, text.encode(), force=force)


def refuse_existing(path: Path, *, force: bool) -> None:
    """Raise `DataError` if ``path`` may not be written: it is there without ``force``, or it is no plain file.

    Call it before a long computation, too: a refusal is cheap only at the start.
    """
    try:
        if not path.exists():
            return
        plain = path.is_file()
    except (OSError, RuntimeError) as fault:
        raise _cannot_write(path, fault) from fault
    if not plain:
        raise DataError("cannot write: this is not a plain file", location=Location(str(path)))
    if not force:
        raise DataError(
            "the file exists and is not overwritten",
            location=Location(str(path)),
            hint="use --force to replace it, or name another output",
        )


@contextmanager
def output_folder(folder: Path, names: Iterable[str] = (), *, force: bool = False) -> Iterator[Path]:
    """Make a folder that is an output as a whole, lock it against a second writer, and check that the outputs may be written.

    Its named files are locked, too, so that who writes one of them by its name (`output_files`) is kept out.

    Parameters
    ----------
    folder : Path
        Made with its parents where they are missing.
    names : iterable of str
        The files that will be written; any that exists is refused without ``force``.
    force : bool
        Existing files may be replaced.

    Yields
    ------
    Path
        The folder, locked until the end of the ``with`` block. Where that fails, the folders that were made for it are gone
        again, unless something lies in them. What a killed writer left half-written is gone.

    Raises
    ------
    DataError
        It is no folder, it cannot be written, another process writes it, or a file exists.
    """
    with _made(folder), folder_lock(folder), output_files(folder, names, force=force):
        for stale in folder.glob(f".*{PARTIAL}"):
            if not lock_of_file(folder / _whole_name(stale)).exists():  # else it may be somebody's who writes just now
                _drop(stale)
        yield folder


@contextmanager
def output_files(folder: Path, names: Iterable[str], *, force: bool = False) -> Iterator[Path]:
    """The same for files in a folder that may hold other outputs, too: only they are locked, others may write beside them.

    Parameters
    ----------
    folder, names, force
        See `output_folder`.

    Yields
    ------
    Path
        The folder; the files are locked until the end of the ``with`` block.

    Raises
    ------
    DataError
        The folder cannot be made or written, another process writes one of the files, or one exists.
    """
    _make(folder)
    paths = [folder / name for name in dict.fromkeys(names)]
    with ExitStack() as locks:
        for path in paths:
            try:
                locks.enter_context(file_lock(path))
            except (OSError, RuntimeError) as fault:  # Python < 3.13 raises RuntimeError for a loop of links
                raise _cannot_write(path, fault) from fault
        for path in paths:
            refuse_existing(path, force=force)
            for stale in folder.glob(f".{escape(path.name)}.*{PARTIAL}"):
                if _whole_name(stale) == path.name:
                    _drop(stale)
        yield folder


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make a folder; where the ``with`` block fails, take away what was made, the inmost first, as far as it is empty."""
    new = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        _make(folder)
        yield
    except BaseException:
        with suppress(OSError):  # the first that is not empty, and with it those around it
            for path in new:
                path.rmdir()
        raise


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise _cannot_write(folder, fault) from fault


def _whole_name(partial: Path) -> str:
    """The name of the file that a temporary one was to become: ``.NAME.TOKEN.estimfw-partial``."""
    return partial.name.removeprefix(".").removesuffix(PARTIAL).rpartition(".")[0]


def _drop(stale: Path) -> None:
    with suppress(OSError):
        stale.unlink()


def _new_partial(target: Path) -> Path:
    """An empty file beside the target, so that the last step is a rename; made with the user's own permissions."""
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}{PARTIAL}")
    os.close(os.open(partial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    return partial


def _flush_to_disk(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _cannot_write(path: Path, fault: Exception) -> DataError:
    reason = getattr(fault, "strerror", None) or str(fault)
    return DataError(
        f"cannot write: {reason}",
        location=Location(str(path)),
        hint=f"what was there before is unchanged; {_way_out(fault)}",
    )


def _way_out(fault: Exception) -> str:
    number = getattr(fault, "errno", None)
    if number in (errno.ENOSPC, errno.EDQUOT):
        return "free some space, or name another output"
    if number in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "name an output that you may write"
    return "name another output"
