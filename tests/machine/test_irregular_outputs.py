"""Output replaces regular files alone, follows no link, and reaches the disk with its name."""

import os
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from harvester.errors import InputError
from harvester.machine import files
from harvester.studies.sweep.journal import Journal
from tests.support.paths import EXAMPLES, ROOT

PLATE = str(EXAMPLES / "plate.toml")


def make(path, kind):
    """Put what is not a regular file at a path; what keeps a socket alive."""
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "socket":
            listener = socket.socket(socket.AF_UNIX)
            listener.bind(str(path))
            return listener
        case "device":
            try:
                os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 3))  # /dev/null
            except PermissionError:
                pytest.skip("only root makes devices")
        case "link":
            (path.parent / "other").write_text("kept")
            path.symlink_to("other")
        case "link to a device":
            path.symlink_to("/dev/null")
        case "dangling link":
            path.symlink_to("nowhere")
    return None


KINDS = ["pipe", "socket", "device", "link", "link to a device", "dangling link"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_file_stays(tmp_path, monkeypatch, kind):
    """As root it was replaced: `--out /dev/null` removed the device of the whole machine."""
    monkeypatch.chdir(tmp_path)  # a socket's path is short
    path = Path("a.csv")
    held = make(path, kind)
    before = path.lstat()
    there = sorted(Path().iterdir())
    with pytest.raises(
        InputError, match=r"^`out` must be the path of a regular file, but 'a\.csv' is a "
    ):
        files.write(path, "text")
    with pytest.raises(
        InputError, match=r"^`out` must be the path of a regular file, but 'a\.csv' is a "
    ):
        files.remove(path)
    assert (path.lstat().st_ino, path.lstat().st_mode) == (before.st_ino, before.st_mode)
    assert sorted(Path().iterdir()) == there
    assert not Path("other").exists() or Path("other").read_text() == "kept"
    if held is not None:
        held.close()


@pytest.mark.parametrize("kind", KINDS)
def test_a_journal_is_no_pipe_device_or_link(tmp_path, monkeypatch, kind):
    """SQLite follows a link, and would write into the file that it leads to."""
    monkeypatch.chdir(tmp_path)
    first = Journal(Path())
    name = first.path.name
    first.close()
    held = make(Path(name), kind)
    journal = Journal(Path())
    with pytest.raises(
        InputError, match=r"^`out` must accept .* but there is a .* that is not a file: remove it$"
    ):
        journal.begin({"versions": ""}, [])
    journal.close()
    assert not Path("nowhere").exists()
    assert Path(name).lstat()
    if held is not None:
        held.close()


@pytest.mark.parametrize("kind", ["pipe", "link to a device"])
@pytest.mark.parametrize(
    "line",
    [
        "new there.toml --mass 40g --frequency 3.2Hz --q 100 --capacitance 40nF --coupling 1mN/V",
        f"run {PLATE} --engine averaged --report there.html",
        f"export {PLATE} --out there",
        "keys --schema --out there",
        "examples plate --out there",
    ],
)
def test_commands_leave_what_is_no_file(tmp_path, monkeypatch, harvester, kind, line):
    """One line of status 2, a report's before anything is computed, and what was there is there."""
    monkeypatch.chdir(tmp_path)
    words = line.split()
    (there,) = (word for word in words if word.startswith("there"))
    make(Path(there), kind)
    before = Path(there).lstat()
    status, out, err = harvester(*words)
    assert (status, err.count("\n")) == (2, 1), err
    assert out == "" or "--report" not in words
    assert Path(there).lstat().st_ino == before.st_ino
    assert [path.name for path in Path().iterdir()] == [there]


def test_a_device_is_named_by_its_whole_path(harvester):
    """`full is a device: remove it` named no file, and told root to remove the machine's device."""
    status, _, err = harvester("export", PLATE, "--out", "/dev/full")
    assert status == 2
    assert "'/dev/full' is a device" in err
    assert "remove" not in err


def test_a_temporary_name_that_is_taken_is_left_alone(tmp_path):
    """Whoever knows a process's number could lay a link there, and have its target overwritten."""
    target = tmp_path / "target"
    target.write_text("kept")
    for number in range(os.getpid() - 3, os.getpid() + 3):
        (tmp_path / f".a.csv.{number}").symlink_to(target)
    files.write(tmp_path / "a.csv", "text")
    assert (tmp_path / "a.csv").read_text() == "text"
    assert not (tmp_path / "a.csv").is_symlink()
    assert target.read_text() == "kept"


def test_a_new_file_is_opened_exclusively(tmp_path, monkeypatch):
    """O_EXCL and O_NOFOLLOW, with the permissions that the user's umask leaves."""
    opened = []
    before = os.open

    def noted(path, flags, *rest, **named):
        opened.append((str(path), flags))
        return before(path, flags, *rest, **named)

    monkeypatch.setattr(os, "open", noted)
    old = os.umask(0o027)
    try:
        files.write(tmp_path / "a.csv", "text")
    finally:
        os.umask(old)
    (flags,) = (flags for path, flags in opened if Path(path).name.startswith(".a.csv"))
    assert flags & os.O_EXCL
    assert flags & os.O_CREAT
    assert flags & os.O_NOFOLLOW
    assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == 0o640


def test_the_folder_is_flushed_after_the_renaming(tmp_path, monkeypatch):
    """Otherwise a failure of the power leaves no file, which was stated to be written."""
    flushed, before = [], os.fsync

    def noted(file):
        flushed.append((stat.S_ISDIR(os.fstat(file).st_mode), (tmp_path / "a.csv").exists()))
        before(file)

    monkeypatch.setattr(os, "fsync", noted)
    files.write(tmp_path / "a.csv", "text")
    assert flushed == [(False, False), (True, True)]


@pytest.mark.parametrize("length", [200, 250, 255])
def test_a_name_as_long_as_a_name_may_be(tmp_path, length):
    """The temporary name, which is not longer, is not a reason to refuse it."""
    name = "a" * (length - 4) + ".csv"
    files.write(tmp_path / name, "text")
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize(
    "line",
    [
        "--help",
        "--version",
        "keys --json",
        "run --help",
        "doctor",
        f"run {PLATE} --engine averaged",
        f"run {PLATE} --engine averaged --json",
        f"sweep {PLATE} --vary load.resistance=1k:10M:5 --engine averaged --out out",
    ],
)
def test_a_full_stdout_is_one_line(tmp_path, line):
    """And a status of the list, not that of Python's own flush at the end."""
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "harvester", *line.split()],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env=env,
            check=False,
            timeout=120,
        )
    assert (done.returncode, done.stderr) == (
        3,
        "harvester: the system refused: [Errno 28] No space left on device: free some, or send the "
        "output elsewhere\n",
    )
