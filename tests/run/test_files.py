"""An output is whole or not there, and a failure costs no old one."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from estimfw.errors import DataError
from estimfw.run import files
from estimfw.run.files import output_files, output_folder, write_atomically, write_text
from estimfw.run.lock import LOCK_NAME


def names_in(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


def test_a_new_file_holds_what_the_writer_wrote(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "über\n")
    assert path.read_bytes() == b"\xc3\xbcber\n"
    assert names_in(tmp_path) == {"a.txt"}


def test_an_existing_file_is_refused_without_force_and_exits_with_5(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "old")
    with pytest.raises(DataError, match="exists") as caught:
        write_text(path, "new")
    assert caught.value.exit_code == 5
    assert "--force" in str(caught.value)
    assert path.read_text() == "old"
    assert names_in(tmp_path) == {"a.txt"}


def test_force_replaces_and_keeps_the_permissions(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "old")
    path.chmod(0o640)
    write_text(path, "new", force=True)
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_new_file_obeys_the_umask(tmp_path: Path) -> None:
    old = os.umask(0o027)
    try:
        path = write_text(tmp_path / "a.txt", "x")
    finally:
        os.umask(old)
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("failure", [RuntimeError("bug"), KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left")])
def test_a_writer_that_fails_half_way_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, failure: BaseException
) -> None:
    path = write_text(tmp_path / "a.txt", "old")

    def half(partial: Path) -> None:
        partial.write_text("ne")
        raise failure

    expected = DataError if isinstance(failure, OSError) else type(failure)
    with pytest.raises(expected):
        write_atomically(path, half, force=True)
    assert path.read_text() == "old"
    assert names_in(tmp_path) == {"a.txt"}


def test_a_failure_of_the_last_step_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_text(tmp_path / "a.txt", "old")

    def no_rename(self: Path, target: Path) -> Path:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(Path, "replace", no_rename)
    with pytest.raises(DataError, match="Read-only"):
        write_text(path, "new", force=True)
    assert path.read_text() == "old"
    assert names_in(tmp_path) == {"a.txt"}


def test_the_old_file_is_complete_until_the_new_one_is(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "old")
    seen = []

    def fill(partial: Path) -> None:
        partial.write_text("ne")
        seen.append(path.read_text())
        partial.write_text("new")

    write_atomically(path, fill, force=True)
    assert seen == ["old"]
    assert path.read_text() == "new"


def test_a_file_that_appears_while_we_write_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"

    def slow(partial: Path) -> None:
        partial.write_text("ours")
        path.write_text("theirs")

    with pytest.raises(DataError, match="exists"):
        write_atomically(path, slow)
    assert path.read_text() == "theirs"
    assert names_in(tmp_path) == {"a.txt"}


def test_a_full_disk_is_reported_and_the_old_file_intact(tmp_path: Path) -> None:
    """The operating system itself refuses to let the file grow (works for root too)."""
    path = write_text(tmp_path / "a.txt", "old")
    program = f"""
        import resource
        from pathlib import Path
        from estimfw.errors import DataError
        from estimfw.run.files import write_text
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        try:
            write_text(Path({str(path)!r}), "x" * 100_000, force=True)
        except DataError as fault:
            print(fault)
        """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True)
    assert "cannot write: File too large" in done.stdout
    assert path.read_text() == "old"
    assert names_in(tmp_path) == {"a.txt"}


def test_a_folder_that_cannot_be_written_is_a_data_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    write_text(folder / "a.txt", "old")
    if os.geteuid() == 0:  # permissions do not stop root: let the system call refuse

        def refuse(*args: object, **kwargs: object) -> int:
            raise PermissionError(errno.EACCES, "Permission denied")

        monkeypatch.setattr(os, "open", refuse)
    else:
        folder.chmod(0o555)
    with pytest.raises(DataError, match="Permission denied"):
        write_text(folder / "a.txt", "new", force=True)
    with pytest.raises(DataError, match="Permission denied"), output_folder(folder, force=True):
        pass
    monkeypatch.undo()
    folder.chmod(0o755)
    assert (folder / "a.txt").read_text() == "old"


def test_a_missing_folder_and_a_folder_as_file_are_data_errors(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="No such file"):
        write_text(tmp_path / "nowhere" / "a.txt", "x")
    with pytest.raises(DataError, match="not a plain file"):
        write_text(tmp_path, "x", force=True)
    with pytest.raises(DataError, match="not a plain file"):
        write_text(Path("/dev/null"), "x", force=True)


def test_a_link_is_followed(tmp_path: Path) -> None:
    real = write_text(tmp_path / "real.txt", "old")
    link = tmp_path / "link.txt"
    link.symlink_to(real)
    write_text(link, "new", force=True)
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_a_loop_of_links_is_a_data_error(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to(tmp_path / "b")
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(DataError, match="cannot write"):
        write_text(tmp_path / "a", "x")


def test_an_output_folder_is_made_and_left_clean(tmp_path: Path) -> None:
    with output_folder(tmp_path / "x" / "y", ["a.txt"]) as folder:
        assert (folder / LOCK_NAME).exists()
        write_text(folder / "a.txt", "x")
    assert names_in(folder) == {"a.txt"}


def test_an_output_folder_refuses_known_outputs_before_any_work(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "old")
    with pytest.raises(DataError, match="exists"), output_folder(tmp_path, ["b.txt", "a.txt"]):
        pytest.fail("the work began")
    with output_folder(tmp_path, ["a.txt"], force=True):
        pass
    assert names_in(tmp_path) == {"a.txt"}


def test_work_that_fails_leaves_no_folder_that_it_made(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    with pytest.raises(DataError, match="no fix"), output_folder(tmp_path / "x" / "y" / "z", ["a.txt"]):
        raise DataError("no fix")
    assert names_in(tmp_path) == {"x"} and names_in(tmp_path / "x") == set()


def test_work_that_fails_leaves_a_folder_in_which_something_lies(tmp_path: Path) -> None:
    for folder in (tmp_path / "old", tmp_path / "new"):
        if folder.name == "old":
            folder.mkdir()
        with pytest.raises(DataError), output_folder(folder):
            if folder.name == "new":
                write_text(folder / "a.txt", "x")
            raise DataError("no fix")
    assert names_in(tmp_path) == {"old", "new"} and names_in(tmp_path / "new") == {"a.txt"}


def test_a_file_in_place_of_the_folder_is_a_data_error(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "x")
    with pytest.raises(DataError, match="cannot write"), output_folder(path):
        pass


def test_what_a_killed_writer_left_is_cleared(tmp_path: Path) -> None:
    (tmp_path / f".a.txt.0badf00d{files.PARTIAL}").write_text("half")
    (tmp_path / ".hidden").write_text("not ours")
    with output_folder(tmp_path):
        pass
    assert names_in(tmp_path) == {".hidden"}


def test_a_second_writer_of_this_process_is_refused(tmp_path: Path) -> None:
    with output_folder(tmp_path), pytest.raises(DataError, match="another run"), output_folder(tmp_path):
        pass
    with output_folder(tmp_path):
        pass


def test_outputs_of_two_names_are_written_side_by_side_in_one_folder(tmp_path: Path) -> None:
    with output_files(tmp_path, ["a.nc", "a.html"]):
        half = tmp_path / f".a.nc.0badf00d{files.PARTIAL}"
        half.write_text("half")
        with output_files(tmp_path, ["b.nc", "b.html"]), output_folder(tmp_path, ["c.nc"]):
            write_text(tmp_path / "b.nc", "b")
        assert half.exists()
        write_text(tmp_path / "a.nc", "a")
    with output_files(tmp_path, ["a.nc"], force=True):  # what is left of a writer that was killed
        pass
    assert names_in(tmp_path) == {"a.nc", "b.nc"}


def test_one_output_has_one_writer_however_its_path_is_spelled(tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "same.nc").symlink_to(tmp_path / "a.nc")
    spellings = (
        (tmp_path, "a.nc"),
        (tmp_path / "linked", "a.nc"),
        (tmp_path / "x" / "..", "a.nc"),
        (tmp_path, "same.nc"),
    )
    with output_files(tmp_path, ["a.nc", "a.html"]):
        for folder, name in spellings:
            with (
                pytest.raises(DataError, match="another run is writing this file") as caught,
                output_files(folder, [name]),
            ):
                pass
            assert "name another output" in str(caught.value)
        with pytest.raises(DataError, match="another run"), output_folder(tmp_path, ["a.nc"]):
            pass
    with (
        output_folder(tmp_path, ["a.nc"]),
        pytest.raises(DataError, match="another run"),
        output_files(tmp_path, ["a.nc"]),
    ):
        pass


HOLDER = """
    import sys
    from pathlib import Path
    from estimfw.run.files import output_folder
    with output_folder(Path(sys.argv[1])):
        print("held", flush=True)
        sys.stdin.read()
"""


def test_a_second_process_is_refused_and_a_killed_one_leaves_no_stale_lock(tmp_path: Path) -> None:
    command = [sys.executable, "-c", textwrap.dedent(HOLDER), str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(DataError, match="another run") as caught, output_folder(tmp_path):
            pass
        assert caught.value.exit_code == 5
        holder.kill()
        holder.wait()
    assert (tmp_path / LOCK_NAME).exists()
    with output_folder(tmp_path):
        pass
