"""What the tab key offers, asked for as the shells ask: through the program, with the words typed so far."""

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
    for command, option in (("sweep", "--vary"), ("tolerance", "--vary"), ("optimise", "--over")):
        assert offered(command, "mine.toml", option, "load.res") == ["load.resistance"]
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
    assert all(item.help for item in completion.get_completions(["run", "mine.toml", "--engine"], ""))


def test_the_program_prints_the_line_that_the_shell_reads(monkeypatch, harvester):
    """As the documented line in a start-up file does it."""
    monkeypatch.setenv("_HARVESTER_COMPLETE", "fish_source")
    status, out, _ = harvester()
    assert status == 0
    assert "complete --no-files --command harvester" in out
