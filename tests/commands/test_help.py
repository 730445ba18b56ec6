"""Help that teaches and is there at once; colours where they are wanted; errors that state the command to type."""

import dataclasses
import json
import os
import re
import resource
import shlex
import subprocess
import sys

import click
import pytest

from harvester import cli
from harvester.scene.keys import TABLES, keys, read_value
from tests.support.paths import ROOT
from tests.support.terminal import on_terminal

PLATE, FIGURE = (str(ROOT / "examples" / f"{name}.toml") for name in ("plate", "paper_figure3"))
ESCAPE = "\x1b["


# what any answer needs: arrays, scenes, the command line
LIBRARIES = "import numpy, pydantic.dataclasses, cloup"
HEAVY = (
    "scipy",
    "asyncio",
    "numba",
    "matplotlib",
    "pandas",
    "pint",
    "loky",
    "PySpice",
    "harvester.density",
)


def best_of(count, *args, program=("-m", "harvester")):
    """CPU seconds from a cold start of the interpreter, the best of some: other work may run next to the tests."""
    took = []
    for _ in range(count):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, *program, *args], check=True, capture_output=True, timeout=60
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(took)


@pytest.mark.slow
def test_help_is_there_at_once():
    """Measured 0.07 s; and it loads nothing that computes."""
    assert best_of(3, "--help") < 0.4
    code = "import sys, harvester.cli; print([m for m in sys.modules if m in ('numpy', 'pydantic', 'pint', 'tqdm')])"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
        == "[]\n"
    )


@pytest.mark.slow
def test_the_package_is_there_at_once():
    """Measured 0.03 s of a processor for `import harvester`, of which the interpreter itself needs 0.013."""
    assert best_of(3, program=("-c", "import harvester")) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["exact", "averaged"])
def test_a_formula_loads_only_what_it_needs(engine):
    """What takes a tenth of a second and more to load is not loaded."""
    code = f"""
import sys
from harvester.cli import exit_status
assert exit_status(["run", {PLATE!r}, "--engine", {engine!r}]) == 0
print([m for m in {HEAVY!r} if m in sys.modules])
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.thorough("test_a_formula_loads_only_what_it_needs")
@pytest.mark.slow
def test_a_formula_is_quick():
    """Measured 1.8 to 2.5 times what the libraries need that any answer uses, side by side: machines differ."""
    libraries = best_of(5, program=("-c", LIBRARIES))
    assert (
        max(best_of(5, "run", PLATE, "--engine", engine) for engine in ("exact", "averaged"))
        < 3.0 * libraries
    )


def test_help_teaches(harvester):
    text = harvester()[1]
    assert text == harvester("--help")[1]
    for word in (
        "A first session",
        "harvester new",
        "Exit status: 0 done; 2 bad input",
        "harvester keys",
        "NO_COLOR",
    ):
        assert word in text
    listed = re.findall(r"^  (\w+)  +[A-Z]", text, re.MULTILINE)
    assert sorted(listed) == sorted(cli.cli.commands)
    assert listed[:2] == ["new", "keys"]


@pytest.mark.parametrize("name", sorted(cli.cli.commands))
def test_help_of_a_command(harvester, name):
    """One example at least, whose options there are; every option is explained and in a group."""
    text = harvester(name, "--help")[1]
    command = cli.cli.commands[name]
    assert command.examples
    for example in command.examples:
        assert example in text
        words = shlex.split(re.sub(r"  \(.*\)$", "", example))
        assert words[:2] == ["harvester", name]
        context = command.make_context(name, words[2:])  # click refuses what there is not
        assert all(context.get_parameter_source(key) is not None for key in context.params)
    for option in command.params:
        if isinstance(option, click.Option):
            assert option.help and option.help.endswith("."), option.name
            assert f"{option.group.title}:" in text


def test_keys_are_those_of_the_dataclasses(harvester):
    """All of them, with an example that the key accepts."""
    assert {(key.table, key.name) for key in keys()} == {
        (table, field.name) for table, kind in TABLES.items() for field in dataclasses.fields(kind)
    }
    text = harvester("keys")[1]
    for key in keys():
        assert key.meaning and key.example, key
        assert any(
            key.name in line and key.meaning in line and key.example in line
            for line in text.splitlines()
        )
        if key.unit:
            table = "mode.2" if key.table == "mode" else key.table
            assert read_value(f"{table}.{key.name}", key.example.strip('"')) is not None
    assert harvester("keys", "load.resistance")[1].splitlines()[0] == "[load]"
    assert len(harvester("keys", "stop")[1].splitlines()) == 1 + len(
        dataclasses.fields(TABLES["stop"])
    )
    assert {one["name"] for one in json.loads(harvester("keys", "load", "--json")[1])} == {
        field.name for field in dataclasses.fields(TABLES["load"])
    }
    assert harvester("keys", "lod")[::2] == (
        2,
        "harvester: unknown scene table or key 'lod': did you mean 'load'?\n",
    )


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("run", "/nowhere/x.toml"), "'harvester new FILE.toml' makes one"),
        (("run",), "Missing argument 'SCENE'. ('harvester new FILE.toml' makes one)"),
        (("sweep", PLATE, "--out", "x"), "(such as --vary load.resistance=1k:10M:25)"),
        (("optimise", PLATE), "(such as --vary load.resistance=1k:10M)"),
        (("run", PLATE, "--seed", "x"), "(harvester run --help)"),
        (("run", PLATE, "--engine", "spise"), "did you mean 'spice'?"),
    ],
)
def test_errors_say_what_to_type(harvester, args, says):
    status, out, err = harvester(*args)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("harvester: ")
    assert says in err


@pytest.mark.slow
def test_a_budget_that_is_too_small(harvester):
    """The warning states which one reaches the target; with that it is reached."""
    args = ("run", FIGURE, "--engine", "ensemble", "--within", "0.05%", "--json")
    told = json.loads(harvester(*args, "--budget", "0.02")[1])
    word = next(word for word in told["warnings"] if "was not reached" in word)
    budget = re.search(r": --budget (\d*\.?\d+s)$", word)[1]
    again = json.loads(harvester(*args, "--budget", budget)[1])
    assert again["mean_power"]["error95"] < told["mean_power"]["error95"]


@pytest.mark.thorough("test_help_is_there_at_once")
@pytest.mark.slow
def test_colours_on_a_terminal_only(harvester):
    error = ("run", "/nowhere/x.toml")
    warning = ("run", PLATE, "--engine", "averaged", "--within", "0.01%")
    status, screen = on_terminal(*error)
    assert status == 2
    assert f"{ESCAPE}31m{ESCAPE}1mharvester:" in screen
    assert f"  {ESCAPE}33m{ESCAPE}1mwarning" in on_terminal(*warning)[1]
    assert f"{ESCAPE}1mAccuracy" in on_terminal("run", "--help")[1]
    for args in (error, warning):
        assert ESCAPE not in on_terminal(*args, env={"NO_COLOR": "1"})[1]
    for args in (error, warning, ("run", "--help")):
        _, out, err = harvester(*args)
        assert out + err and ESCAPE not in out + err
    assert os.environ.get("FORCE_COLOR") is None
