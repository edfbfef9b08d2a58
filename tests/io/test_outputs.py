"""Files that are whole or not there, links, devices, and folders that are none."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from tribrach.errors import InputError
from tribrach.io.clouds.staged import Staged
from tribrach.io.outputs import write_bytes, write_text, write_texts


def names(folder: Path) -> list[str]:
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def test_all_or_none(tmp_path: Path) -> None:
    """The second cannot be written: the first stays as it was."""
    write_text(tmp_path / "a.txt", "old")
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(InputError, match=r"b.txt: the file cannot be written \(it is a folder\)"):
        write_texts({tmp_path / "a.txt": "new", tmp_path / "b.txt": "new"})
    assert names(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_file_where_a_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "note").write_text("x")
    for path in (tmp_path / "note" / "a.txt", tmp_path / "note" / "b" / "a.txt"):
        with pytest.raises(InputError, match="its folder is a file"):
            write_text(path, "new")
        with pytest.raises(InputError, match="its folder is a file"):
            Staged(path)


def test_links_stay(tmp_path: Path) -> None:
    """What they lead to is written, as any program would."""
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "there" / "result.json")
    write_text(link, "1")
    with Staged(link) as staged:
        staged.file.write(b"2")
    assert link.is_symlink()
    assert names(tmp_path / "there") == ["result.json"]
    assert (tmp_path / "there" / "result.json").read_text() == "2"


def test_devices_and_pipes_take_what_is_written(tmp_path: Path) -> None:
    """They are never replaced by files."""
    write_bytes(Path(os.devnull), b"x" * 10)
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_text(pipe, "result")
        assert os.read(end, 100) == b"result"
    finally:
        os.close(end)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(InputError, match="no ordinary file"):
        Staged(pipe)


def test_pieces_are_written_one_by_one_and_a_failure_leaves_what_was(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    write_texts({path: iter(["[1,", "2]\n"])})
    assert path.read_text() == "[1,2]\n"

    def broken() -> Iterator[str]:
        yield "[3,"
        raise ValueError("no number")

    with pytest.raises(ValueError, match="no number"):
        write_texts({path: broken()})
    assert path.read_text() == "[1,2]\n"
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]
