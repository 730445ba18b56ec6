"""The tables of docs/audit.md: each row rests on a line of the paper's text, and its class follows from that line.

`paper_lines.toml` has the quotations.  The text loses signs, bars, roots, tall brackets and perhaps
exponents; so a formula is called a misprint only if the right one does not turn into the text by
any such loss.
"""

import re
import tomllib
from pathlib import Path

import pytest

from tests.support.paths import ROOT

ROWS = tomllib.loads(Path(__file__).with_name("paper_lines.toml").read_text())
SECTIONS = {
    "misprint": "Misprints",
    "approximation": "Approximations",
    "unknown": "Undecidable",
    "right": "Right",
}
PAGE = (ROOT / "docs" / "audit.md").read_text()
LOST = set("-|√≈≥∂∫∞⟨⟩⌈⌉")
EXPONENTS = {"²": "2"}


def tables(title):
    """The rows of the table of a section, cell by cell."""
    section = PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return rows[1:]


def may_read(right, text):
    """Whether the right formula, with any of its signs lost, is this text."""
    parts = []
    for token in right.split():
        if token in LOST:
            continue
        if token in EXPONENTS:
            parts.append(f"(?:{EXPONENTS[token]} )?")
        else:
            parts.append(re.escape(token) + " ")
    return re.fullmatch("".join(parts), f"{text} ") is not None


def test_what_may_be_lost():
    """A minus may be, a plus or a letter may not; an exponent only if it is marked."""
    assert may_read("a - b ² ≈ c", "a b c")
    assert may_read("a - b ² ≈ c", "a b 2 c")
    assert not may_read("a + b", "a b")
    assert not may_read("a b 2", "a b")


@pytest.mark.parametrize("name", SECTIONS)
def test_rows_of_the_page_are_the_quotations(name):
    found = [(equation, lines, text) for equation, lines, text, *_ in tables(SECTIONS[name])]
    assert found == [
        (
            row["equation"],
            ", ".join(map(str, row["lines"])),
            "; ".join(f"`{one}`" for one in row["text"]),
        )
        for row in ROWS[name]
    ]
    for row in ROWS[name]:
        assert len(row["lines"]) == len(row["text"])


@pytest.mark.parametrize("name", ["misprint", "unknown", "right"])
def test_classes_follow_from_the_text(name):
    """No loss explains a misprint; a loss, or another reading of the very same symbols, explains all others."""
    for row in ROWS[name]:
        for text, right in zip(row["text"], row["right"], strict=True):
            assert may_read(right, text) is (name != "misprint"), row["equation"]


def test_every_row_has_its_check():
    """The tests that the page names are there."""
    folder = Path(__file__).parent
    for title in SECTIONS.values():
        for equation, *_, check in tables(title):
            where = "test_published.py" if "test_published.py" in check else "test_audit.py"
            names = re.findall(r"`(\w+)`", check)
            assert names, equation
            for name in names:
                assert f"def test_{name}(" in (folder / where).read_text(), name


@pytest.mark.parametrize("page", ["README.md", "docs/audit.md", "docs/theory.md"])
def test_counts_on_the_pages(page):
    """The numbers of misprints, approximations and open questions."""
    text = " ".join((ROOT / page).read_text().split())
    found = re.search(r"(\d+) misprints, (\d+) approximations and (\d+) formulas", text)
    assert [int(one) for one in found.groups()] == [
        len(ROWS[name]) for name in ("misprint", "approximation", "unknown")
    ]
