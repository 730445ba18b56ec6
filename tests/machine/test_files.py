"""Files are written whole or not at all."""

import os
from pathlib import Path

import pytest

from harvester.errors import InputError
from harvester.machine import files


def test_write(tmp_path):
    files.write(tmp_path / "a.csv", "µ\n")
    files.write(tmp_path / "a.csv", b"new")
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("a.csv", b"new")]


@pytest.mark.parametrize("broken", ["fsync", "replace"])
def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch, broken):
    """A full disk shows at the flush, a broken folder at the renaming."""
    files.write(tmp_path / "a.csv", "old")

    def fail(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(*((os, "fsync", fail) if broken == "fsync" else (Path, "replace", fail)))
    with pytest.raises(
        InputError, match=r"^`out` must accept a.csv, but writing failed: No space left on device$"
    ):
        files.write(tmp_path / "a.csv", "new")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.csv", "old")]


def test_an_interrupt_leaves_nothing_behind(tmp_path, monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        files.write(tmp_path / "a.csv", "new")
    assert list(tmp_path.iterdir()) == []


def test_write_over_a_folder(tmp_path):
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(
        InputError, match=r"^`out` must accept a.csv, but writing failed: Is a directory$"
    ):
        files.write(tmp_path / "a.csv", "new")
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def test_folder(tmp_path):
    deep = files.folder(tmp_path / "a" / "b")
    assert deep.is_dir()
    assert files.folder(str(deep)) == deep
    assert list(deep.iterdir()) == []


@pytest.mark.parametrize("name", ["file", "file/below", "x" * 300])
def test_no_folder(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(
        InputError, match=r"^`out` must be a folder that can be written, but '.*' is not: "
    ):
        files.folder(tmp_path / name)


def test_folder_without_a_name():
    """An unset variable of a shell must not fill the present folder."""
    with pytest.raises(InputError, match=r"^`out` must be a folder, but is ''$"):
        files.folder("")


def test_read_only_file_system():
    with pytest.raises(
        InputError, match=r"^`out` must be a folder that can be written, but '/proc/sweep' is not: "
    ):
        files.folder("/proc/sweep")


@pytest.mark.parametrize(
    "name, why",
    [
        ("pipe", "it is a pipe or a device"),
        ("/dev/zero", "it is a pipe or a device"),
        ("", "Is a directory"),
        ("none", "No such file or directory"),
        ("x" * 300, "File name too long"),
        ("a\0b", "its name has a NUL character"),
    ],
)
def test_read_what_is_no_file(tmp_path, name, why):
    """A pipe that nobody writes, and a device without end, are refused at once."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(
        InputError, match=rf"^`points` must be a readable file, but '.*' is not: {why}$"
    ):
        files.read(tmp_path / name, "`points`", 10)


def test_read(tmp_path):
    (tmp_path / "a").write_bytes(b"0123456789")
    assert files.read(str(tmp_path / "a"), "scene", 10) == b"0123456789"
    with pytest.raises(
        InputError, match=r"^scene must be a file of at most 9 bytes, but '.*/a' is longer$"
    ):
        files.read(tmp_path / "a", "scene", 9)


def test_no_folder_has_this_name(tmp_path):
    with pytest.raises(InputError, match=r"is not: its name has a NUL character$"):
        files.folder(tmp_path / "a\0b")


def test_what_cannot_be_removed(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(
        InputError, match="`out`: cannot write a over the existing one: Is a directory"
    ):
        files.remove(tmp_path / "a")
    files.remove(tmp_path / "none")
