"""Compilation is timed, and told to whoever waits for it at a terminal."""

import sys
import time

import pytest

from harvester.mechanics.kernels.compiled import compilation


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_a_long_first_call_is_told_on_a_terminal(capsys, monkeypatch, terminal, seconds):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with compilation() as took:
        time.sleep(seconds)
    assert took.seconds == pytest.approx(seconds, abs=0.2)
    assert ("compiling" in capsys.readouterr().err) == (terminal and seconds > 0.5)
