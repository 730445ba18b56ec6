"""What a file states is read as it states, or refused: lines that are not samples, zones of clocks, several columns."""

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.identification.impedance_table import impedance
from harvester.identification.instrument_files import touchstone
from harvester.identification.read import read_file
from harvester.records.cleaning import clean
from harvester.records.clock_times import seconds
from harvester.records.csv_table import read_table
from harvester.records.current_trace import read_trace
from harvester.records.density_slopes import SLOPE
from harvester.records.efficiency_table import read_efficiencies
from harvester.records.record_files import read_density, read_record


def written(folder, text):
    path = folder / "mine.csv"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("line", ["Trigger,99", "Mean,0.01"])
def test_a_line_that_is_no_sample_is_refused(tmp_path, line):
    """It became a sample of 99 g, whose time came from its neighbours."""
    rows = [f"{0.005 * k:.3f},{np.sin(0.3 * k):.5f}" for k in range(600)]
    rows.insert(300, line)
    with pytest.raises(InputError, match=line.partition(",")[0]):
        clean(written(tmp_path, "t (s),a (g)\n" + "\n".join(rows) + "\n"))


@pytest.mark.parametrize("zone", ["+0200", "+02:00", "Z", ""])
def test_a_clock_may_have_a_zone(zone):
    cells = [f"2024/05/01 12:00:0{k}.5 {zone}".strip() for k in range(3)]
    assert seconds(cells, "FILE") == pytest.approx([0.0, 1.0, 2.0])


def test_one_of_several_columns_is_not_chosen(tmp_path):
    """The first one was accepted without a word."""
    psd = written(tmp_path, "f (Hz),psd x (g^2/Hz),psd z (g^2/Hz)\n20,0.01,0.04\n80,0.01,0.04\n")
    with pytest.raises(InputError, match=r"one column .* but has 'psd x, psd z'"):
        read_density(psd)
    trace = written(tmp_path, "t (s),I1 (mA),I2 (mA)\n" + "0,1,2\n0.1,1,2\n0.2,1,2\n0.3,1,2\n")
    with pytest.raises(InputError, match="one column"):
        read_trace(trace)
    table = "input voltage (V),input current (A),efficiency 25C,efficiency 85C\n1,1e-5,0.8,0.7\n"
    with pytest.raises(InputError, match="one column 'efficiency'"):
        read_efficiencies(written(tmp_path, table))


def test_the_reference_of_touchstone_2():
    """Z = R (1 + S)/(1 - S) is 225 ohm at S = 0.5 and R = 75 ohm; the options state 50."""
    text = "[Version] 2.0\n# Hz S RI R 50\n[Reference] 75\n1e3 0.5 0\n2e3 0.5 0\n"
    assert touchstone(text, "FILE")[1] == pytest.approx([225.0, 225.0])


def test_pairs_of_columns_that_disagree(tmp_path):
    w = 2.0 * np.pi * np.array([1e3, 2e3, 3e3])
    rows = [f"{f / 2 / np.pi:g},10,{-1.0 / (f * 1e-9):g},{{}},{{}}" for f in w]
    head = "f (Hz),R (ohm),X (ohm),G (S),B (S)\n"
    y = [1.0 / (10.0 + 1.0 / (1j * f * 1e-9)) for f in w]
    good = "".join(
        r.format(f"{a.real:g}", f"{a.imag:g}") + "\n" for r, a in zip(rows, y, strict=True)
    )
    bad = "".join(r.format("1e-3", "0") + "\n" for r in rows)
    table = read_table(written(tmp_path, head + good), "FILE")
    z, _ = impedance(table, w / (2.0 * np.pi), "FILE")
    assert z.imag == pytest.approx(-1.0 / (w * 1e-9), rel=1e-4)
    table = read_table(written(tmp_path, head + bad), "FILE")
    with pytest.raises(InputError, match="two pairs of them disagree"):
        impedance(table, w / (2.0 * np.pi), "FILE")


def test_slopes_are_found_in_linear_time():
    """20,000 digits in one line needed 24 s; a hundred times as many are looked through at once now."""
    assert SLOPE.search("1" * 2_000_000) is None
    assert SLOPE.search(" " * 2_000_000) is None
    assert SLOPE.findall("20,+3 dB/oct\n80,-3 dB/oct\n350,6 dB/oct") == ["+3", "-3", "6"]


def test_an_impedance_has_no_load(tmp_path):
    """What was behind the @ was dropped."""
    path = tmp_path / "z.csv"
    path.write_text("f (Hz),R (ohm),X (ohm)\n" + "".join(f"{f},10,-{f}\n" for f in range(10, 60)))
    with pytest.raises(
        InputError, match="holds an impedance, which has no load: leave '@100k' out"
    ):
        read_file(f"{path}@100k")


def test_rows_beside_settings_are_refused(tmp_path):
    """An oscilloscope writes its first samples next to its settings; these six rows were lost."""
    settings = ["Record Length,600", "Sample Interval,0.005", "Trigger Point,0", "Source,CH1"]
    rows = [f"{0.005 * k:.3f},{np.sin(0.3 * k):.5f}" for k in range(600)]
    beside = [f"{head},,{row}" for head, row in zip(settings, rows, strict=False)]
    text = "\n".join([*beside, *(f",,,{row}" for row in rows[4:])]) + "\n"
    with pytest.raises(InputError, match="4 rows of numbers next to them: delete the columns"):
        read_table(written(tmp_path, text), "FILE")


def test_a_line_without_numbers_in_a_scene_s_record_is_refused(tmp_path):
    """Its place was bridged without a word; `harvester record` reports it."""
    rows = [f"{0.005 * k:.3f},{np.sin(0.3 * k):.5f}" for k in range(600)]
    rows.insert(300, "OVERLOAD")
    with pytest.raises(InputError, match="OVERLOAD"):
        read_record(written(tmp_path, "t (s),a (m/s^2)\n" + "\n".join(rows) + "\n"))


def test_a_clock_may_have_two_halves_of_a_day():
    """Twelve is the first hour of either half."""
    cells = ["12:00:00 AM", "01:00:00 AM", "11:59:59 AM", "12:00:00 PM", "01:30:00 PM"]
    assert seconds(cells, "FILE") == pytest.approx([0.0, 3600.0, 43199.0, 43200.0, 48600.0])
