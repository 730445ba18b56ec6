"""Compilation is timed, and told to whoever waits for it at a terminal; what it makes is kept in files."""

import os
import sys
import time

import pytest

from harvester.mechanics.kernels.compiled import compilation, kernel


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_a_long_first_call_is_told_on_a_terminal(capsys, monkeypatch, terminal, seconds):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with compilation() as took:
        time.sleep(seconds)
    assert took.seconds == pytest.approx(seconds, abs=0.2)
    assert ("compiling" in capsys.readouterr().err) == (terminal and seconds > 0.5)


@pytest.mark.parametrize("room", [0, 20, -1], ids=["empty", "begun", "nearly whole"])
def test_files_that_are_cut_off_are_made_anew(tmp_path, monkeypatch, room):
    """As after a crash of the machine; they were an internal error."""
    monkeypatch.setattr("harvester.mechanics.kernels.compiled._cache_folder", lambda: str(tmp_path))

    def twice(x):
        return 2.0 * x

    assert kernel(twice)(1.0) == 2.0
    for suffix in ("nbi", "nbc"):
        (file,) = tmp_path.rglob(f"*.{suffix}")
        whole = file.stat().st_size
        os.truncate(file, room % whole)
        assert kernel(twice)(2.0) == 4.0
        assert file.stat().st_size == whole
