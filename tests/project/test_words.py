"""The ten patterns that docs/developers/english.md advises against: each count may only fall."""

import re

import pytest

from tests.support import pages, words
from tests.support.pages import FENCE
from tests.support.paths import ROOT

# The most places of a pattern that there may be today, in the documents, the texts of the package
# and the comments of the netlists. Whoever lowers a number writes it here; `python -m
# tests.support.words SET NAME` prints the places.
BOUNDS = {
    "headless of": (0, 195, 0),
    "tell and say": (1, 225, 0),
    "too at the end": (0, 18, 0),
    "what-clauses": (9, 1045, 0),
    "where": (22, 322, 0),  # "if" for a condition; "where" for a place stays
    "beside": (0, 66, 0),
    "is no": (3, 116, 0),
    "light verbs": (12, 715, 0),
    "of-chains": (14, 64, 4),
    "numbers": (0, 90, 0),
}


def test_every_pattern_has_its_bounds():
    assert list(BOUNDS) == list(words.PATTERNS)
    assert {len(bounds) for bounds in BOUNDS.values()} == {len(words.SETS)}


@pytest.mark.parametrize("name", BOUNDS)
def test_what_may_only_fall(name):
    """A count above its bound is a step back."""
    for which, most in zip(words.SETS, BOUNDS[name], strict=True):
        found = list(words.places(which, name))
        assert len(found) <= most, [f"{file}: {text}" for file, text in found[:20]]


GUIDES = (
    "device shaking circuits own_netlist studies sweeps tolerance lifetime response charging chips"
    " nodes design bench explore part modes accuracy effort which"
)


def test_no_page_is_long():
    """At most 1,700 words outside of code, tables included."""
    counts = {
        page.name: len(re.findall(r"\S*[A-Za-z]\S*", FENCE.sub("", page.read_text())))
        for page in (ROOT / "docs").rglob("*.md")
        if "_build" not in page.parts
    }
    assert {name: count for name, count in counts.items() if count > 1700} == {}


@pytest.mark.parametrize("page", GUIDES.split())
def test_a_guide_begins_with_a_command_and_its_output(page):
    """In its first 40 lines of prose: a command, then what it prints or a table of it."""
    first, *others = pages.blocks(f"docs/{page}.md")
    assert first.language == "sh" and int(first.where.partition(":")[2]) < 25
    if page not in ("design", "bench"):  # a table in place of the output; a sentence between
        assert others[0].language == "text"
        assert int(others[0].where.partition(":")[2]) < 25


FAULTS = {
    "headless of": "| Of a trajectory, as --dt. | of the noise |",
    "tell and say": "An impedance does not tell the mass.",
    "too at the end": "It takes the elements, too.",
    "what-clauses": "This is what ideal diodes differ by.",
    "where": "Where it is above 2 %, it warns.",
    "beside": "It took 11 minutes beside other work.",
    "is no": "The residual is no noise.",
    "light verbs": "The sentence stands once.",
    "of-chains": "It has a source of voltage and the error of the step.",
    "numbers": "It takes .5 s of the processor for 3% at 5 packets an hour.",
}
RIGHT = """
The residual is not random. If it is above 2 %, `where` of `x.what` warns: 0.5 s of CPU time, 5 packets per hour.

```text
of what where .5 too
```
"""


@pytest.mark.parametrize("name", words.PATTERNS)
def test_each_pattern_finds_its_fault(name, monkeypatch):
    """A sentence of each kind is found, code and good English are not."""
    monkeypatch.setattr(words, "texts", lambda which: [("page.md", words.prose(which))])
    assert len(list(words.places(FAULTS[name], name))) >= 1
    assert list(words.places(RIGHT, name)) == []


def test_the_readme_is_among_the_documents():
    files = {file for file, _ in words.texts("documents")}
    assert {"README.md", "docs/tour.md", "examples/README.md"} <= files
    assert all((ROOT / file).exists() for file in files)
