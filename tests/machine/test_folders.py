"""The cache is the user's alone, because what is in it is run; and the folder where ngspice starts is bare."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import harvester as hv
from harvester.machine import folders
from tests.support.paths import EXAMPLES


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A place for the cache, where there is nothing yet."""
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "new" / "cache"))
    return tmp_path / "new" / "cache"


def test_the_cache_is_closed_to_others(cache):
    assert folders.cache_folder() == cache
    assert cache.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("mode", [0o777, 0o720, 0o1777])
def test_a_cache_that_others_may_write_is_refused(cache, mode):
    cache.mkdir(parents=True)
    cache.chmod(mode)
    with pytest.raises(
        hv.InputError, match=r"a folder of your own that nobody else may write, but '/.*chmod"
    ):
        folders.cache_folder()


def test_a_cache_of_another_user_is_refused(cache, monkeypatch):
    cache.mkdir(parents=True)
    monkeypatch.setattr(os, "geteuid", lambda: cache.stat().st_uid + 1)
    with pytest.raises(hv.InputError, match="must be a folder of your own"):
        folders.cache_folder()


@pytest.mark.slow
def test_kernels_are_not_read_from_there(cache):
    cache.mkdir(parents=True)
    cache.chmod(0o777)
    command = [
        sys.executable,
        "-m",
        "harvester",
        "run",
        EXAMPLES / "plate.toml",
        "--engine",
        "ensemble",
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith(
        f"harvester: the cache must be a folder of your own that nobody else may write, but '{cache}"
    )
    assert list(cache.iterdir()) == []


def test_no_place_for_a_cache(cache):
    cache.parent.write_text("a file")
    assert folders.cache_folder() is None
    temporary = Path(folders.bare("ngspice", ".spiceinit"))
    assert [one.name for one in temporary.iterdir()] == [".spiceinit"]


def test_the_bare_folder(cache):
    place = folders.bare("ngspice", ".spiceinit")
    assert place == str(cache / "ngspice") == folders.bare("ngspice", ".spiceinit")
    assert (cache / "ngspice").stat().st_mode & 0o777 == 0o500
    (cache / "ngspice").chmod(0o700)
    (cache / "ngspice" / ".spiceinit").write_text("shell true")
    with pytest.raises(
        hv.InputError, match=r"must hold nothing but an empty .spiceinit, but does not: remove it$"
    ):
        folders.bare("ngspice", ".spiceinit")
    (cache / "ngspice" / ".spiceinit").write_text("")
    (cache / "ngspice" / "spice.rc").write_text("")
    with pytest.raises(hv.InputError, match="must hold nothing but"):
        folders.bare("ngspice", ".spiceinit")
