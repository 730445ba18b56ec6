"""Records with numbers beyond all units, and words of no letters: one line each."""

import numpy as np
import pytest

from tests.support.judge import fault


@pytest.mark.parametrize("factors", [[1e-200, 1.0], [1.0, 1e-200], [1e200, 1.0], [1.0, 1e200]])
def test_numbers_beyond_all_units_are_refused(harvester, tmp_path, factors):
    """A rate of 5e201 Hz had an rms of inf."""
    t = np.arange(200) / 50.0
    rows = np.stack([t, np.sin(20.0 * t)], axis=1) * factors
    head = "time (s),acceleration (g)"
    np.savetxt(tmp_path / "odd.csv", rows, delimiter=",", header=head, comments="")
    answer = harvester("record", str(tmp_path / "odd.csv"), "--json")
    assert (answer[0], fault(*answer)) == (2, "")
    assert "in size" in answer[2]


def test_words_of_sensors_are_quoted(harvester, tmp_path):
    """A control character in the name of a sensor was sent to the terminal as it is."""
    names = ["A", "\x1b[31mB"]
    rows = [f"{k / 50},{(-1) ** k},{names[k % 2]}" for k in range(100)]
    (tmp_path / "two.csv").write_text("\n".join(["time (s),acceleration (g),sensor", *rows]))
    answer = harvester("record", str(tmp_path / "two.csv"), "--json")
    assert (answer[0], fault(*answer)) == (2, "")
    assert r"'\x1b[31mB'" in answer[2]
