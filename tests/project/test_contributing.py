"""CONTRIBUTING.md sends a newcomer to files that are there."""

import re

import pytest

import harvester as hv
from tests.support.paths import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text()
PATHS = sorted(set(re.findall(r"`((?:harvester|tests|docs|netlists|examples|benchmarks)/[\w/.]*)`", PAGE)))


@pytest.mark.parametrize("path", PATHS)
def test_path_is_there(path):
    assert (ROOT / path).exists()


def test_every_room_is_described():
    """The table of rooms has each folder of the package, and the folder is in it once."""
    rooms = {path.name for path in (ROOT / "harvester").iterdir() if (path / "__init__.py").exists()}
    table = PAGE.partition("## Rooms")[2].partition("## Rules")[0]
    assert sorted(re.findall(r"`harvester/(\w+)/`", table)) == sorted(rooms)


def test_questions_of_a_newcomer():
    """Eighty at least, each with one file."""
    table = PAGE.partition("## Where is")[2]
    rows = re.findall(r"^\| (.*\?) \| `([\w/.]+)` \|$", table, re.MULTILINE)
    assert len(rows) == len(re.findall(r"^\|", table, re.MULTILINE)) - 2 >= 80
    assert len({question for question, _ in rows}) == len(rows)


def test_citation():
    """CITATION.cff has the package's version, and the article that the theory page names."""
    text = (ROOT / "CITATION.cff").read_text()
    assert f"version: {hv.__version__}\n" in text
    title = re.search(r"title: >-\n\s+(.*)\n", text)[1]
    assert title in (ROOT / "docs" / "theory.md").read_text()


def test_names_of_the_project():
    """README and this page say that pip knows the project by another name than Python does."""
    for page in (PAGE, (ROOT / "README.md").read_text()):
        assert "`piezo-harvester`" in page
        assert re.search(r"imported and run as\s+`harvester`", page)
