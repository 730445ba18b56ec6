"""CONTRIBUTING.md and the pages for developers send a newcomer to files that are there."""

import re
import shlex

import pytest

import harvester as hv
from harvester.devices import materials
from tests.support import pages
from tests.support.paths import ROOT

PAGE = (ROOT / "CONTRIBUTING.md").read_text()
DEVELOPERS = {path.stem: path.read_text() for path in (ROOT / "docs" / "developers").glob("*.md")}
PATHS = sorted(
    set(
        re.findall(
            r"`((?:harvester|tests|docs|netlists|examples|benchmarks)/[\w/.]*)`",
            PAGE + "".join(DEVELOPERS.values()),
        )
    )
)


@pytest.mark.parametrize("path", PATHS)
def test_path_is_there(path):
    assert (ROOT / path).exists()


def test_every_room_is_described():
    """The table of rooms has each folder of the package, and the folder is in it once."""
    rooms = {
        path.name for path in (ROOT / "harvester").iterdir() if (path / "__init__.py").exists()
    }
    table = DEVELOPERS["architecture"].partition("## Subpackages")[2].partition("## Rules")[0]
    assert sorted(re.findall(r"`harvester/(\w+)/`", table)) == sorted(rooms)


def test_topics_of_a_newcomer():
    """Eighty at least, each with one file."""
    table = DEVELOPERS["files"]
    rows = re.findall(r"^\| (.*) \| `([\w/.]+)` \|$", table, re.MULTILINE)
    assert len(rows) == len(re.findall(r"^\|", table, re.MULTILINE)) - 2 >= 80
    assert len({topic for topic, _ in rows}) == len(rows)


def test_citation():
    """CITATION.cff has the package's version, and the article that the theory page names."""
    text = (ROOT / "CITATION.cff").read_text()
    assert f"version: {hv.__version__}\n" in text
    title = re.search(r"title: >-\n\s+(.*)\n", text)[1]
    assert title in (ROOT / "docs" / "theory.md").read_text()


def test_names_of_the_project():
    """README and this page state that pip knows the project by another name than Python does."""
    for page in (PAGE, (ROOT / "README.md").read_text()):
        assert "`piezo-harvester`" in page
        assert re.search(r"imported and run as\s+`harvester`", page)


def test_the_first_change(harvester, tmp_path, monkeypatch):
    """The line, the trial and the test of the page do what the page states: a beam of the new material has a scene."""
    (line,) = re.findall(r'^ +("titanium": Substrate\(.*\)),$', PAGE, re.MULTILINE)
    monkeypatch.setattr(materials, "SUBSTRATES", dict(materials.SUBSTRATES))
    exec(f"SUBSTRATES |= {{{line}}}", vars(materials))
    (trial,) = re.findall(
        r"^\.venv/bin/harvester (new mine\.toml .*titanium.*)$", PAGE, re.MULTILINE
    )
    monkeypatch.chdir(tmp_path)
    assert harvester(*shlex.split(trial))[0] == 0
    assert (
        "did you mean 'titanium'?"
        in harvester(*shlex.split(trial.replace("titanium", "titanum").replace("mine", "other")))[2]
    )
    names = {}
    (test,) = [
        block.text for block in pages.blocks("CONTRIBUTING.md") if block.language == "python"
    ]
    exec(test, names)
    names["test_titanium_is_lighter_than_steel"]()


def test_the_papers_references():
    """Each is cited and each citation is there; each states whether its DOI was resolved."""
    paper, bib = ((ROOT / "joss" / f"paper.{end}").read_text() for end in ("md", "bib"))
    entries = dict(re.findall(r"^@\w+\{(\w+), (.*)\}$", bib, re.MULTILINE))
    assert set(re.findall(r"@(\w+)", paper)) == set(entries)
    for key, entry in entries.items():
        assert re.search(
            r"note = \{(doi resolved|doi not resolved|software, without a doi)", entry
        ), key
        assert ("doi = {10." in entry) or "doi resolved" not in entry, key


def test_a_yes_of_the_checklists_has_its_place():
    """Files and pages that a row names are there; each row states yes, no, in part or open."""
    page = (ROOT / "joss" / "checklists.md").read_text()
    rows = re.findall(r"^\| (?!item|---)(.*) \| (.*) \| (.*) \|$", page, re.MULTILINE)
    assert len(rows) > 30 and {answer for _, answer, _ in rows} == {"yes", "no", "in part", "open"}
    named = re.findall(r"`([\w.]+(?:/[\w.]+)+|[\w]+\.\w+)`", page)
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_changelog_is_short():
    """At most 60 lines a version, under the headings of Keep a Changelog, one line each."""
    text = (ROOT / "CHANGELOG.md").read_text()
    headings = ["Added", "Changed", "Removed", "Changed results", "Fixed"]
    assert re.findall(r"^### (.*)$", text, re.MULTILINE) == headings
    for version in text.split("\n## ")[1:]:
        entries = [line for line in version.splitlines()[1:] if line and not line.startswith("#")]
        assert len(version.splitlines()) <= 60
        assert all(re.match(r"- .*\.$", line) for line in entries)
