"""The one table: units that differ from row to row, numbers to the last digit, percent, and long tables' ends."""

import pytest

from harvester.presentation.glossary import term
from harvester.presentation.sheet import quantity
from harvester.presentation.table import MOST_ROWS, Column, Table
from harvester.uncertainty.value import Value


def test_each_row_may_have_its_own_unit():
    """Two scene keys in a column: their values are in their own units, also if a long table is cut."""
    column = Column("value", [4.87e5, 50.2e-9] * MOST_ROWS, units=["ohm", "F"] * MOST_ROWS)
    lines = Table((column,)).lines()
    assert [line.strip() for line in lines[1:3]] == ["487 kohm", "50.2 nF"]
    assert lines[-1].strip() == "50.2 nF" and len(lines) == MOST_ROWS + 2


def test_an_exact_column_is_written_to_the_last_digit():
    place = 0.1 + 0.2
    rows = (
        Table((Column("place", [place], exact=True), Column("power", [place]))).csv().splitlines()
    )
    assert rows[1].split(",") == [repr(place), "0.3"]


@pytest.mark.parametrize(("share", "text"), [(5.0, "5 %"), (0.1, "0.1 %"), (99.95, "99.95 %")])
def test_a_percentage_has_no_prefix(share, text):
    assert Table((Column("share", [share], "%"),)).lines()[1].strip() == text


def test_a_whole_number_keeps_what_is_not_known_of_it():
    """360 packets are a count without an error only if nothing is reported of one."""
    assert quantity(360.0, term("packets_per_hour"), "") == "360"
    assert quantity(Value(360.0, bias=0.0), term("packets_per_hour"), "") == "360"
    assert "is not known" in quantity(
        Value(360.0, bias=0.0, unknown="a circuit"), term("packets_per_hour"), ""
    )
    assert (
        quantity(Value(360.0, stderr=1.0), term("packets_per_hour"), "")
        == "360 +- 2 (95 %, sampling)"
    )
