"""What each operating system is asked for: the ways of Linux and macOS as they are, those of
Windows by replacements."""

import importlib
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from harvester.machine.system import this_system
from harvester.machine.system.posix import Linux, MacOS
from tests.support.paths import ROOT


class Kernel:
    """Windows' own library: processes by their number as handles, and what was called."""

    def __init__(self):
        self.called = []

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)

        def call(*arguments):
            self.called.append((name, *arguments))
            if name == "OpenProcess":
                return arguments[2] if Path(f"/proc/{arguments[2]}").exists() else None
            if name == "WaitForSingleObject" and arguments[1]:
                while Path(f"/proc/{arguments[0]}").exists():
                    time.sleep(0.01)
                return 0
            return 0x102

        call_again = SimpleNamespace(restype=None, argtypes=None)
        return type(
            "Function", (), {"__call__": lambda _, *given: call(*given), **vars(call_again)}
        )()


@pytest.fixture
def windows(monkeypatch):
    """The ways of Windows, with replacements: locks by POSIX's lockf, a registry with a processor, and its library."""
    import fcntl

    def locking(file, mode, size):
        assert (mode, size) == (2, 1)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(13, "as Windows calls it") from None

    class Key(SimpleNamespace):
        __enter__ = __exit__ = lambda self, *_: self

    def value(key, name):
        return (
            (" a processor ", 1)
            if "CentralProcessor" in key.path and name == "ProcessorNameString"
            else None
        )

    registry = {
        "HKEY_LOCAL_MACHINE": 1,
        "OpenKey": lambda _, path: Key(path=path),
        "QueryValueEx": value,
    }
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))
    monkeypatch.setitem(sys.modules, "winreg", SimpleNamespace(**registry))
    monkeypatch.setitem(sys.modules, "harvester.machine.system.windows", None)
    del sys.modules["harvester.machine.system.windows"]
    for name in ("O_BINARY", "O_NOINHERIT", "O_TEMPORARY"):
        monkeypatch.setattr(os, name, 0, raising=False)
    monkeypatch.setattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 512, raising=False)
    monkeypatch.setenv("SYSTEMROOT", "/nonexistent")
    kernel = Kernel()
    with monkeypatch.context() as pretended:
        pretended.setattr(sys, "platform", "win32")
        module = importlib.import_module("harvester.machine.system.windows")
    monkeypatch.setattr(module.ctypes, "WinDLL", lambda *_, **__: kernel, raising=False)
    system = module.Windows()
    system.kernel = kernel
    return system


@pytest.fixture(params=["Linux", "MacOS", "Windows"])
def system(request):
    """Each system's way in turn."""
    return request.getfixturevalue("windows") if request.param == "Windows" else {"Linux": Linux, "MacOS": MacOS}[
        request.param]()  # fmt: skip


def test_a_lock_is_held_by_one_at_a_time(system, tmp_path):
    """By a file and by a folder: the second one who asks is reported at once, and has it when the first releases it."""
    for open_it, path in (
        (system.open_to_lock, tmp_path / "file"),
        (system.open_folder_to_lock, tmp_path),
    ):
        first, second = open_it(path), open_it(path)
        assert system.lock(first)
        assert not system.lock(second)
        os.close(first)
        assert system.lock(second)
        os.close(second)


def test_what_is_locked_can_be_read(system, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"content")
    held = system.open_to_lock(path)
    assert system.lock(held)
    file = system.open_to_read(path)
    assert (os.read(file, 100), os.read(held, 100)) == (b"content", b"content")
    os.close(file)
    os.close(held)


def test_the_current_folder_comes_back(system, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ZeroDivisionError), system.back_to_this_folder():
        os.chdir("/")
        1 / 0  # noqa: B018
    assert Path.cwd() == tmp_path


def test_the_end_of_a_process_is_noticed(system):
    """A group lives as long as its process, which is reported to end at once."""
    options = {} if "creationflags" in system.own_group() else system.own_group()
    with subprocess.Popen(
        [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, **options
    ) as process:
        assert system.group_lives(process.pid)
        if options:
            system.kill_group(process.pid)
        else:
            process.kill()
    assert process.returncode == -9
    assert not system.group_lives(process.pid)


def test_windows_waits_for_the_end_of_its_parent(windows):
    """The posix ways ask for their own parent, which tests of worker processes try."""
    with subprocess.Popen(["/bin/sleep", "0.2"]) as process:
        started = time.monotonic()
        reaper = __import__("threading").Thread(target=process.wait)
        reaper.start()
        windows.wait_for_end_of(process.pid)
        assert time.monotonic() - started > 0.15
        reaper.join()
    windows.wait_for_end_of(process.pid)  # it is gone already


def test_windows_ignores_interrupts_meanwhile(windows):
    with windows.without_interrupts():
        assert windows.kernel.called == [("SetConsoleCtrlHandler", None, True)]
    assert windows.kernel.called[1:] == [("SetConsoleCtrlHandler", None, False)]


def test_windows_ends_a_group_by_its_own_program(windows, monkeypatch):
    ran = []
    monkeypatch.setattr(
        subprocess, "run", lambda command, **_: ran.append([str(one) for one in command])
    )
    windows.kill_group(1234)
    assert ran == [["/nonexistent/System32/taskkill.exe", "/T", "/F", "/PID", "1234"]]


def test_what_it_says_of_the_machine(system):
    """A name or nothing, a limit or None; nothing that fails if its own files are missing."""
    assert isinstance(system.processor(), str)
    assert system.address_space() is None or system.address_space() > 0
    assert system.library("no such library at all") is None
    assert system.library_file("/there/libngspice.so") == Path("/there/libngspice.so")
    assert not system.others_may_write(Path(__file__).stat())
    if not isinstance(system, Linux | MacOS):
        assert system.processor() == "a processor"


def test_a_folder_that_others_may_write(tmp_path):
    tmp_path.chmod(0o777)
    for system in (Linux(), MacOS()):
        assert system.others_may_write(tmp_path.stat())


def test_macos_looks_in_the_folder_of_homebrew(monkeypatch):
    monkeypatch.setattr(
        Path, "is_file", lambda path: str(path) == "/opt/homebrew/lib/libngspice.dylib"
    )
    monkeypatch.setattr("ctypes.util.find_library", lambda name: None)
    assert MacOS().library("ngspice") == "/opt/homebrew/lib/libngspice.dylib"


@pytest.mark.parametrize(
    ("platform", "kind"), [("linux", "Linux"), ("darwin", "MacOS"), ("win32", "Windows")]
)
def test_the_system_is_chosen_at_import(platform, kind):
    """By a program that is reported that it runs there."""
    code = f"""import ctypes.util, pathlib, subprocess, sys, types
for name in ("msvcrt", "winreg"):
    sys.modules[name] = types.ModuleType(name)
sys.platform = {platform!r}
from harvester.machine.system import this_system
print(type(this_system).__name__)"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [kind]


def test_this_one_is_linux():
    assert isinstance(this_system, Linux)
