"""Rows and columns of a measurement that are not used are stated, or the file is refused."""

import numpy as np
import pytest

import harvester as hv
from harvester.identification.read import read_file
from tests.support.analysers import ANGLE, SIZE, F, table

HEAD = "Frequency (Hz),|Z| (ohm),Phase (deg)"
SWEEP = "Frequency (Hz),Voltage (V/g)"
RINGING = np.exp(-0.5 * F) * np.cos(F)


def written(folder, head, *columns, changed=None):
    """A file with these columns, one row of which has been replaced: number from 1, text."""
    lines = table(*columns).splitlines()
    if changed is not None:
        row, text = changed
        lines[row - 1] = text
    path = folder / "a.csv"
    path.write_text("\n".join([head, *lines]) + "\n")
    return str(path)


@pytest.mark.parametrize(
    "text", ["0,1e5,-80", "80,0,-80", "80,,-80", "-3,1e5,-80"], ids=["f", "Z", "empty", "below 0"]
)
def test_a_row_of_zero_is_reported(tmp_path, text):
    """It was left out without a word."""
    name = written(tmp_path, HEAD, F, SIZE, ANGLE, changed=(7, text))
    found = hv.identify(name)
    [remark] = [one for one in found.diagnostics if one.code == "rows_left_out"]
    assert (remark.numbers["rows"], remark.numbers["first"]) == (1, 7)
    assert "note: a.csv: 1 of its rows was left out (first: row 7)" in str(found)
    assert hv.identify(name)["piezo.capacitance"].low > 0.0


def test_a_whole_file_has_no_such_remark(tmp_path):
    found = hv.identify(written(tmp_path, HEAD, F, SIZE, ANGLE))
    assert not [one for one in found.diagnostics if one.code == "rows_left_out"]


def test_rows_of_a_response_and_of_a_ring_down(tmp_path):
    [data] = read_file(written(tmp_path, SWEEP, F, 1.0 / F, changed=(1, "0,1")) + "@100k")
    assert data.left_out == (1,)
    [data] = read_file(written(tmp_path, "t (s),x (mm)", F, RINGING, changed=(3, "70.3,")))
    assert data.left_out == (3,)


def test_rows_of_other_loads_are_used(tmp_path):
    """Each load is a measurement: its rows are not left out by the others."""
    loads = np.where(np.arange(len(F)) % 2, 1e3, 1e5)
    name = written(tmp_path, f"{SWEEP},Load (ohm)", F, 1.0 / F, loads, changed=(2, "0,1,1e3"))
    assert [data.left_out for data in read_file(name)] == [(2,), ()]


@pytest.mark.parametrize(
    ("head", "columns", "named"),
    [
        (HEAD + ",|Z| (ohm)", (F, SIZE, ANGLE, 2.0 * SIZE), "|Z|, |Z|"),
        ("Frequency (Hz),R (ohm),X (ohm),Rs (ohm)", (F, SIZE, ANGLE, 2.0 * SIZE), "R, Rs"),
        ("Frequency (Hz)," + HEAD, (2.0 * F, F, SIZE, ANGLE), "Frequency, Frequency"),
        (SWEEP + ",Load (ohm),Load (ohm)", (F, SIZE, F, 2.0 * F), "Load, Load"),
        ("t (s),x (mm),x (mm)", (F, RINGING, 2.0 * RINGING), "x, x"),
        ("t (s),x (mm),Voltage (V)", (F, RINGING, 2.0 * RINGING), "Voltage, x"),
    ],
)
def test_two_columns_of_one_quantity_are_refused(tmp_path, head, columns, named):
    """The first was used without a word."""
    name = written(tmp_path, head, *columns)
    with pytest.raises(hv.InputError) as error:
        read_file(name)
    assert f"but has '{named}': delete the others" in str(error.value)


def test_two_equal_columns_are_one(tmp_path):
    """As analysers write the frequencies of each trace."""
    name = written(tmp_path, HEAD + ",Frequency (Hz)", F, SIZE, ANGLE, F)
    [data] = read_file(name)
    np.testing.assert_allclose(np.abs(data.z), SIZE, rtol=1e-8)


def test_an_empty_state_is_refused(tmp_path):
    """`a.csv@` was read as a.csv: an unset variable of a shell."""
    name = written(tmp_path, HEAD, F, SIZE, ANGLE)
    with pytest.raises(hv.InputError, match=r"behind the @.*such as @100k.*or leave the @ out"):
        read_file(name + "@")
