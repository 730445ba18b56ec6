"""The table of shared state in docs/developers/architecture.md has every file that writes such state."""

import ast
import re

import pytest

from tests.support.paths import ROOT
from tests.support.shared_state import written

PACKAGE = ROOT / "harvester"
ARCHITECTURE = ROOT / "docs" / "developers" / "architecture.md"


def listed() -> set[str]:
    """The files in the second column of the table."""
    table = ARCHITECTURE.read_text(encoding="utf-8").partition("## Shared state")[2]
    rows = re.findall(r"^\|[^|]*\|([^|]*)\|", table, flags=re.MULTILINE)
    return {name for row in rows for name in re.findall(r"`([\w/]+\.py)`", row)}


def test_every_file_that_writes_shared_state_is_listed():
    """A race made an engine wrong without a word: who adds such state names its guard there."""
    writing = {
        str(path.relative_to(PACKAGE))
        for path in PACKAGE.rglob("*.py")
        if written(ast.parse(path.read_text(encoding="utf-8")))
    }
    assert writing - listed() == set()
    assert {name for name in listed() if not (PACKAGE / name).is_file()} == set()


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("KNOWN[k] = 1", {"KNOWN"}),
        ("KNOWN.append(k)", {"KNOWN"}),
        ("global KNOWN; KNOWN = k", {"KNOWN"}),
        ("os.environ['A'] = k", {"os"}),
        ("del os.environ[k]", {"os"}),
        ("import sys; sys.stderr = k", {"sys"}),
        ("os.remove(k)", set()),
        ("k = KNOWN[0]", set()),
        ("k.append(1)", set()),
        ("KNOWN = []; KNOWN.append(k)", set()),
    ],
)
def test_what_is_shared_state(line, names):
    assert written(ast.parse(f"import os\nKNOWN = []\ndef f(k):\n    {line}\n")) == names
