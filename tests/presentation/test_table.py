"""The one table: units that differ from row to row, numbers to the last digit, percent, and long tables' ends."""

import pytest

from harvester.presentation.table import MOST_ROWS, Column, Table


def test_each_row_may_have_its_own_unit():
    """Two scene keys in a column: their values stand in their own units, also where a long table is cut."""
    column = Column("value", [4.87e5, 50.2e-9] * MOST_ROWS, units=["ohm", "F"] * MOST_ROWS)
    lines = Table((column,)).lines()
    assert [line.strip() for line in lines[1:3]] == ["487 kohm", "50.2 nF"]
    assert lines[-1].strip() == "50.2 nF" and len(lines) == MOST_ROWS + 2


def test_an_exact_column_is_written_to_the_last_digit():
    place = 0.1 + 0.2
    rows = Table((Column("place", [place], exact=True), Column("power", [place]))).csv().splitlines()
    assert rows[1].split(",") == [repr(place), "0.3"]


@pytest.mark.parametrize(("share", "text"), [(5.0, "5 %"), (0.1, "0.1 %"), (99.95, "99.95 %")])
def test_a_percentage_has_no_prefix(share, text):
    assert Table((Column("share", [share], "%"),)).lines()[1].strip() == text
