"""The offers of the tab key, asked for as the shells ask: through the program, with the words typed so far."""

import os
import subprocess
import sys

import pytest
from click.shell_completion import BashComplete, ZshComplete

from harvester.cli import cli
from harvester.engines.selection import ENGINES


def offered(*words, shell=BashComplete):
    """The words that the shell is given for the last of ``words``."""
    completion = shell(cli, {}, "harvester", "_HARVESTER_COMPLETE")
    return [item.value for item in completion.get_completions(list(words[:-1]), words[-1])]


def test_commands_and_options():
    assert offered("swe") == ["sweep"]
    assert "--resume" in offered("sweep", "--re")


@pytest.mark.parametrize("command", ["run", "sweep", "optimise", "motion", "charge", "tolerance"])
def test_engines(command):
    assert offered(command, "mine.toml", "--engine", "") == list(ENGINES)
    assert offered(command, "mine.toml", "--engine", "av") == ["averaged"]


def test_keys_of_a_scene():
    for command, option in (("sweep", "--vary"), ("tolerance", "--vary"), ("optimise", "--vary")):
        assert offered(command, "mine.toml", option, "load.resistan") == ["load.resistance"]
        assert offered(command, "mine.toml", option, "load.resistance=") == []


def test_a_scene_is_a_file():
    """The shell itself looks for it."""
    completion = BashComplete(cli, {}, "harvester", "_HARVESTER_COMPLETE")
    (item,) = completion.get_completions(["run"], "exam")
    assert (item.type, item.value) == ("file", "exam")


def test_meanings_are_told_where_a_shell_shows_them():
    completion = ZshComplete(cli, {}, "harvester", "_HARVESTER_COMPLETE")
    items = completion.get_completions(["sweep", "mine.toml", "--vary"], "stop.")
    assert {item.value: item.help for item in items}["stop.restitution"]
    assert all(
        item.help for item in completion.get_completions(["run", "mine.toml", "--engine"], "")
    )


def test_the_program_prints_the_line_that_the_shell_reads():
    """As the documented line in a start-up file does it; click writes bytes, so it is a program of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "harvester"], env={**os.environ, "_HARVESTER_COMPLETE": "zsh_source"},
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert (
        "compdef _harvester_completion harvester" in done.stdout
        or "_HARVESTER_COMPLETE=zsh_complete" in done.stdout
    )
