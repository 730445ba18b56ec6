"""The tiers of tests: what `make test` leaves to `make test-all`, and by which test it finds such faults itself."""

import ast
import re
import signal
import subprocess
import sys

import pytest

from tests.support.house import parsed
from tests.support.paths import ROOT

TESTS = ROOT / "tests"


def thorough(node):
    """What a call of the marker `thorough` gives as the test that remains; None for other nodes."""
    if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "thorough":
        assert len(node.args) == 1, ast.unparse(node)
        return ast.literal_eval(node.args[0])
    return None


def test_what_is_left_to_test_all_has_a_test_that_remains():
    """Each marker names a test of `make test`, or a file with such tests, or states that there is none and why."""
    remaining = set()
    named = {}
    for name, tree in parsed(TESTS).items():
        functions = [
            one
            for one in tree.body
            if isinstance(one, ast.FunctionDef) and one.name.startswith("test_")
        ]
        marked = [
            one
            for one in tree.body
            if isinstance(one, ast.Assign)
            and re.match("pytestmark.*mark.thorough", ast.unparse(one))
        ]
        if not marked:
            left = {one.name for one in functions if not any(map(thorough, one.decorator_list))}
            remaining |= left | ({name.rpartition("/")[2]} if left else set())
        named |= {
            f"{name}:{node.lineno}": what for node in ast.walk(tree) if (what := thorough(node))
        }
    assert len(named) > 100
    assert [
        (where, what)
        for where, what in named.items()
        if what not in remaining and not what.startswith("nothing: ")
    ] == []


@pytest.mark.thorough("nothing: a suite runs inside the suite")
@pytest.mark.slow
def test_a_suite_in_the_background_of_a_script_passes():
    """It begins with ^C ignored, as `nohup make test &` does there, which the programs that it starts would inherit."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "pytest",
                "-p",
                "no:cacheprovider",
                "tests/commands/test_cli.py",
                "-k",
                "interrupt_while",
            ],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
    finally:
        signal.signal(signal.SIGINT, before)
    assert done.returncode == 0, done.stdout
