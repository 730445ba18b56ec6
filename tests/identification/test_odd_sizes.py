"""Measurements whose numbers no device has: one line with the remedy, and no infinite residual."""

import json

import numpy as np
import pytest

from tests.support.judge import fault
from tests.support.paths import EXAMPLES


def scaled(path, name, factors):
    """A copy of a bench's file with columns times factors."""
    head = name.read_text().splitlines()[1]
    numbers = np.loadtxt(name, delimiter=",", skiprows=2) * factors
    np.savetxt(path, numbers, delimiter=",", header=head, comments="")


@pytest.mark.parametrize(
    ("bench", "state", "factors"),
    [
        ("bounce", "", [1e-200, 1.0]),
        ("bounce", "", [1.0, 1e-200]),
        ("bounce", "", [1.0, 1e200]),
        ("impedance", "", [1e200, 1.0, 1.0]),
        ("impedance", "", [1.0, 1e-200, 1.0]),
        ("voltage", "@100k", [1e-200, 1.0]),
        ("voltage", "@100k", [1.0, 1e200]),
    ],
)
def test_numbers_beyond_all_units_are_refused(harvester, tmp_path, bench, state, factors):
    """A step of 1e-203 s ended in a traceback, and a voltage of 1e200 V in a residual of inf."""
    scaled(tmp_path / "odd.csv", EXAMPLES / f"bench_{bench}.csv", factors)
    answer = harvester("identify", f"{tmp_path / 'odd.csv'}{state}", "--json")
    assert (answer[0], fault(*answer)) == (2, "")
    assert "between 1e-50 and 1e+50" in answer[2]


def test_a_voltage_in_short_circuit_is_refused(harvester):
    """It is 0 for each device, so that the fit was off by inf %."""
    answer = harvester("identify", f"{EXAMPLES / 'bench_voltage.csv'}@short", "--json")
    assert (answer[0], fault(*answer)) == (2, "")
    assert "short circuit" in answer[2]
    assert "@100k" in answer[2]


def test_a_load_of_0_in_a_column_is_deleted(harvester, tmp_path):
    """The column precedes a load behind the name; without the row the file is read."""
    rows = [f"{80 + k},{100 + k},{load}\n" for k in range(16) for load in (0, 1000)]
    path = tmp_path / "loads.csv"
    path.write_text("f (Hz),V (V/g),load (ohm)\n" + "".join(rows))
    answer = harvester("identify", path, "--known", "mass=40g")
    assert answer[0] == 2
    assert "delete the rows whose load is 0" in answer[2]
    path.write_text("f (Hz),V (V/g),load (ohm)\n" + "".join(r for r in rows if ",0\n" not in r))
    assert "short circuit, a voltage of 0" not in harvester("identify", path)[2]


def test_units_change_nothing_of_a_fit(harvester, tmp_path):
    """Hz or GHz, ohm or mohm: the quality factor is that of the file as it is."""
    quality = []
    for factors in ([1.0, 1.0, 1.0], [1e9, 1.0, 1.0], [1.0, 1e-3, 1.0]):
        scaled(tmp_path / "scaled.csv", EXAMPLES / "bench_impedance.csv", factors)
        _, out, _ = harvester("identify", str(tmp_path / "scaled.csv"), "--json")
        quality.append(json.loads(out)["parameters"]["quality_factor"]["value"])
    np.testing.assert_allclose(quality, quality[0], rtol=1e-5)
