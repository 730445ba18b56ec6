"""The patterns and the old terms that docs/developers/english.md advises against: each count may only fall."""

import re

import pytest

from tests.support import pages, words
from tests.support.pages import FENCE
from tests.support.paths import ROOT

# The most places of a pattern that there may be today, in the documents, the texts of the package, the comments of the
# netlists, the docstrings of the tests and the comments of the package. Whoever lowers a number writes it here; `python
# -m tests.support.words SET NAME` prints the places.
BOUNDS = {
    "headless of": (0, 6, 0, 4, 370),
    "tell and say": (1, 1, 0, 13, 55),
    "too at the end": (0, 0, 0, 4, 17),
    "what-clauses": (5, 7, 0, 291, 157),
    "where": (19, 9, 0, 121, 77),  # "if" for a condition; "where" for a place stays
    "beside": (0, 0, 0, 15, 31),
    "is no": (0, 0, 0, 3, 21),
    "light verbs": (7, 5, 0, 3, 139),
    "of-chains": (14, 8, 4, 9, 16),
    "numbers": (0, 3, 0, 1, 1),
}
# The same for an old word in place of the field's term.
OLD_TERMS = {
    "coil": (6, 39, 0, 12, 6),  # of an electromagnetic harvester, `hv.Coil`
    "shaking": (0, 2, 0, 8, 0),  # arguments of this name
    "store": (0, 0, 0, 9, 0),
    "drive": (0, 3, 0, 3, 0),  # an effect of this name
    "path": (2, 4, 0, 27, 2),  # of files
    "record of a logger": (0, 0, 0, 1, 0),
    "whole error": (0, 0, 0, 0, 0),
    "error of the step": (0, 1, 0, 0, 2),
    "noise of a band": (0, 0, 0, 0, 0),
    "hop": (0, 0, 0, 1, 0),
    "ledger": (1, 4, 0, 9, 0),  # options and keys of this name
    "share": (0, 0, 0, 2, 0),
    "own netlist": (1, 0, 0, 1, 0),
    "elasticity": (0, 1, 0, 0, 0),  # an attribute
    "judge": (0, 0, 0, 0, 0),
    "dear": (0, 0, 0, 0, 0),
    "aim": (1, 1, 0, 0, 0),
    "knob": (0, 0, 0, 0, 0),
    "turn over": (0, 0, 0, 0, 0),
    "density of an excitation": (0, 0, 0, 2, 0),
}


def test_every_pattern_has_its_bounds():
    assert list(BOUNDS) == list(words.PATTERNS)
    assert list(OLD_TERMS) == list(words.TERMS)
    assert {len(bounds) for bounds in (BOUNDS | OLD_TERMS).values()} == {len(words.SETS)}


@pytest.mark.parametrize("name", BOUNDS | OLD_TERMS)
def test_what_may_only_fall(name):
    """A count above its bound is a step back."""
    for which, most in zip(words.SETS, (BOUNDS | OLD_TERMS)[name], strict=True):
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
GOOD = """
A stop is at the point where the spring is at rest; V = w x, where w is the frequency, where b and c are real.

What are the parameters? There is no stop. The rate is no longer constant, and is no more than 1.

It takes 3 s, takes about an hour and takes place once; the speed goes to zero.

Type `run` --within 1%, key=10%, "5%", such as 2% or {share:.1%} of {x:+.2f}.
"""
STILL_FAULTS = {
    "what-clauses": "What the stop takes. Is it what we need?",
    "where": "None where it is absent. Where it is above 2 %, it warns. It is 0 where there are none.",
    "is no": "The value is none of these. It is no noise.",
    "light verbs": "What a load takes. It takes the mass. It goes with the stop.",
    "numbers": "It is .5 of 3% and 5% of 10 packets an hour.",
}
RIGHT = """
The residual is not random. If it is above 2 %, `where` of `x.what` warns: 0.5 s of CPU time, 5 packets per hour.

```text
of what where .5 too
```
"""


# Each old term in a sentence, and the field's term or another meaning of the word.
TERM_FAULTS = {
    "coil": ("The coil of an SSHI inverts the voltage.", "The inductor recoils."),
    "shaking": ("It depends on the shaking.", "It depends on the excitation."),
    "store": ("An empty store, and the store of a chip.", "It may store the file in storage."),
    "drive": ("It repeats after a period of the drive.", "The sources drive the piezo."),
    "path": ("All engines follow the same path.", "The path of a file."),
    "record of a logger": ("A logger's record has gaps.", "A logger's recording has gaps."),
    "whole error": ("Its whole errors are known.", "The whole file has errors."),
    "error of the step": ("The error of the step is known.", "The time-step error is known."),
    "noise of a band": ("It is a noise of a band.", "It is band-limited noise."),
    "hop": ("There are few hops a second.", "There is hope of a transition."),
    "ledger": ("The ledger of its elements.", "Use the option `--ledger`."),
    "share": ("The share of devices within it.", "Two engines share a record."),
    "own netlist": ("It is an own netlist.", "This package's own netlists."),
    "elasticity": ("The elasticity of a key.", "An elastic stop."),
    "judge": ("The judge is ngspice.", "A reader can judge it."),
    "dear": ("A dearer engine checks it.", "It nears its end."),
    "aim": ("It has two aims.", "It has two objectives; it claims more."),
    "knob": ("Each knob has a step.", "Each slider has a step."),
    "turn over": ("It turns the voltage over.", "It inverts the voltage."),
    "density of an excitation": ("A tabulated density.", "The probability density of the mass."),
}


@pytest.mark.parametrize("name", words.TERMS)
def test_each_old_term_is_found_and_no_other_word(name, monkeypatch):
    monkeypatch.setattr(words, "texts", lambda which: [("page.md", words.prose(which))])
    fault, right = TERM_FAULTS[name]
    assert list(words.places(fault, name)) != []
    assert list(words.places(right, name)) == []


def test_comments_of_several_lines_are_one_text():
    """`harvester/errors.py` or any other: a sentence over two lines of comments is not cut."""
    texts = dict(words.texts("comments"))
    assert any("\n" not in text and len(text) > 100 for text in texts.values())


@pytest.mark.parametrize("name", words.PATTERNS)
def test_each_pattern_finds_its_fault(name, monkeypatch):
    """A sentence of each kind is found, code and good English are not."""
    monkeypatch.setattr(words, "texts", lambda which: [("page.md", words.prose(which))])
    assert len(list(words.places(FAULTS[name], name))) >= 1
    assert list(words.places(RIGHT, name)) == []


def test_good_english_is_not_counted(monkeypatch):
    """A place and a legend with "where", a question, "there is no", a duration, a percentage as it is typed."""
    monkeypatch.setattr(words, "texts", lambda which: [("page.md", words.prose(which))])
    assert [name for name in words.PATTERNS if list(words.places(GOOD, name))] == []


@pytest.mark.parametrize(("name", "text"), STILL_FAULTS.items())
def test_a_narrow_pattern_finds_each_fault(name, text, monkeypatch):
    """At least one in each sentence, next to the English that the pattern leaves alone."""
    monkeypatch.setattr(words, "texts", lambda which: [("page.md", which)])
    for sentence in re.split(r"(?<=[.?]) ", text):
        assert list(words.places(sentence, name)) != [], sentence


def test_the_readme_is_among_the_documents():
    files = {file for file, _ in words.texts("documents")}
    assert {"README.md", "docs/tour.md", "examples/README.md"} <= files
    assert all((ROOT / file).exists() for file in files)
