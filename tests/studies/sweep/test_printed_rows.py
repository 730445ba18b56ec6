"""A sweep on the screen: all of a short table, both ends of a long one."""

import pytest

from harvester.printing.answer_units import SI
from harvester.studies.sweep.printed_rows import MOST_ROWS, grid, warnings


def rows(count):
    return [
        {"x": str(k), "engine": "averaged", "error": "", "warnings": "beware" if k == 1 else ""} for k in range(count)
    ]


@pytest.mark.parametrize("count", [1, MOST_ROWS, MOST_ROWS + 1, 1000])
def test_long_tables_keep_both_ends(count):
    lines = grid(rows(count), SI).splitlines()
    assert lines[0].split() == ["x", "engine"]
    assert lines[1].split()[0] == "0"
    assert lines[-1].split()[0] == str(count - 1)
    cut = [line for line in lines if "rows more in sweep.csv" in line]
    if count <= MOST_ROWS:
        assert cut == []
        assert len(lines) == 1 + count
    else:
        assert cut == [f"({count - MOST_ROWS} rows more in sweep.csv)"]
        assert len(lines) == 2 + MOST_ROWS


def test_warnings_are_counted():
    assert warnings(rows(3)) == ["warning, averaged at 1 of 3 points: beware"]
    assert warnings(rows(1)) == []
