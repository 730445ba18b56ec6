"""A sweep on the screen: all of a short table, both ends of a long one; powers with prefixes and whole errors."""

import pytest

from harvester.presentation.answer_units import SI
from harvester.studies.sweep.printed_rows import MOST_ROWS, cells, failures, grid, warnings
from harvester.studies.sweep.rows import COLUMNS


def row(engine="averaged", keys=None, **given):
    return (keys or {}) | dict.fromkeys(COLUMNS, "") | {"engine": engine, "seconds": "0.0077481"} | given


def rows(count):
    told = {1: "beware"}
    return [
        row(keys={"load.resistance": str(k)}, mean_power="1e-6", warnings=told.get(k, ""), error="no" * (k == 2))
        for k in range(count)
    ]


@pytest.mark.parametrize("count", [1, MOST_ROWS, MOST_ROWS + 1, 1000])
def test_long_tables_keep_both_ends(count):
    lines = grid(rows(count), SI).splitlines()
    assert lines[0].split() == ["load.resistance", "engine", "mean", "power", "error,", "95", "%", "seconds"]
    assert lines[1].split()[0] == "0"
    assert lines[-1].split()[0] == f"{count - 1}"
    cut = [line for line in lines if "rows more in sweep.csv" in line]
    if count <= MOST_ROWS:
        assert cut == []
        assert len(lines) == 1 + count
    else:
        assert cut == [f"({count - MOST_ROWS} rows more in sweep.csv)"]
        assert len(lines) == 2 + MOST_ROWS


def test_warnings_and_failures_are_counted():
    assert warnings(rows(3)) == ["warning, averaged at 1 of 3 points: beware"]
    assert failures(rows(3)) == ["failed, averaged at 1 of 3 points: no"]
    assert warnings(rows(1)) == failures(rows(1)) == []


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ({"mean_power": "8.361e-06", "mean_power_stderr": "1e-8", "mean_power_bias": "2e-8"}, ["8.361 uW", "0.47 %"]),
        ({"mean_power": "8.361e-06", "mean_power_bias": "2e-8"}, ["8.361 uW", "0.24 %"]),
        ({"mean_power": "8.361e-06", "mean_power_stderr": "1e-8"}, ["8.361 uW", "at least 0.23 %"]),  # of the step: ?
        ({"mean_power": "8.361e-06"}, ["8.361 uW", "not known"]),
        (
            {"mean_power": "8.361e-06", "mean_power_stderr": "1e-8", "mean_power_bias": "0", "engine": "ideal"},
            ["8.361 uW", "at least 0.23 %"],
        ),
        ({"mean_power": "0", "mean_power_bias": "0"}, ["0 W", ""]),
        ({"error": "it failed"}, ["failed", ""]),
    ],
)
def test_powers_carry_their_whole_error(given, shown):
    head, body = cells([row(keys={"load.resistance": "23713.7"}, **given)], SI)
    assert head == ["load.resistance", "engine", "mean power", "error, 95 %", "seconds"]
    assert body == [["23.71 kohm", given.get("engine", "averaged"), *shown, "0.0077"]]


def test_no_line_is_wider_than_100_letters():
    keys = {"excitation.acceleration_psd": "1e-3", "oscillator.damping_ratio": ".01", "excitation.bandwidth": "20"}
    lines = grid([row(keys=keys, mean_power="1e-6", mean_power_stderr="1e-8")], SI).splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[0].split()[:3] == ["acceleration_psd", "damping_ratio", "bandwidth"]
