"""The page of which engine supports which scene is that of today's engines; the glossary has each
nondimensional key."""

import re
import runpy

import pytest

from harvester.scene.keys import keys
from tests.support.paths import ROOT


@pytest.mark.slow
def test_the_table_is_that_of_the_engines():
    """Made anew from `serving` and `has_lifetime`; `python docs/serving_table.py` writes it."""
    made = runpy.run_path(str(ROOT / "docs" / "serving_table.py"))
    assert made["page"]() == made["PAGE"].read_text()
    assert len(made["table"]().splitlines()) > 8


def test_the_glossary_has_each_nondimensional_number():
    """Every key of the table, as a code word in a row of its section, and no word that is none."""
    page = (
        (ROOT / "docs" / "glossary.md")
        .read_text()
        .partition("## The nondimensional numbers")[2]
        .partition("##")[0]
    )
    named = [
        name
        for row in page.splitlines()
        for name in re.findall(r"`(\w+)`", row.partition("| ")[2].partition("|")[0])
    ]
    assert sorted(named) == sorted(one.name for one in keys() if one.table == "nondimensional")
