"""CSV files as loggers, analysers and spreadsheets write them: read alike, or refused with the remedy."""

import math
import time

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.quantities.kinds import ACCELERATION
from harvester.records.csv_table import read_table
from harvester.records.record_files import read_density, read_record
from tests.support.paths import EXAMPLES

G = 9.80665
ROWS = [(0.01 * k, round(math.sin(k), 3)) for k in range(40)]


def body(sep=",", sign=".", time="{:.3f}", factor=1.0, scale=1.0):
    """The rows, with the delimiter, the decimal sign and the form of the times."""
    lines = (
        (time.format(t * factor).replace(".", sign), f"{a * scale:.3f}".replace(".", sign))
        for t, a in ROWS
    )
    return "".join(sep.join(line) + "\n" for line in lines)


RECORDS = {
    "Time,Acceleration (g)\n" + body(): G,
    "t [s],a [m/s^2]\n" + body(): 1.0,
    "Time (ms),X (mg)\n" + body(time="{:.0f}", factor=1e3, scale=1e3): G,
    "Zeit [s];Beschleunigung [g]\n" + body(";", ","): G,
    "Time (s)\tAccel (G)\n" + body("\t"): G,
    "Time,Accel\ns,g\n" + body(): G,
    "Time,Accel\n(s),(m/s²)\n" + body(): 1.0,
    "timestamp,acc_z_mg\n" + body(time="2024-05-01T12:00:{:06.3f}", scale=1e3): G,
    "Time,acc z (g)\n" + body(time="23:59:{:06.3f}"): G,
    "time_s,acceleration_g\n" + body(): G,
    "Time / s,Acceleration / g\n" + body(): G,
    "Logger 3000\nSerial: 12\n\nTime (s),Acc (g)\n" + body(): G,
    "# time (s),acceleration (g)\n" + body(): G,
    "t(s) a(g)\n" + body(" "): G,
    '"Time (s)","Acceleration (m/s²)"\r\n' + body(): 1.0,
    "Time (s),Acc_m_s2\n" + body(): 1.0,
    "Sample,Time (s),Z (g)\n" + "".join(f"{k},{t},{a}\n" for k, (t, a) in enumerate(ROWS)): G,
}


@pytest.mark.parametrize("text", RECORDS, ids=lambda text: text[:30])
def test_records_of_many_loggers(tmp_path, text):
    """One excitation, written in seventeen ways."""
    path = tmp_path / "a.csv"
    path.write_text(text)
    record = read_record(str(path))
    assert record.spacing == pytest.approx(0.01)
    np.testing.assert_allclose(record.values[:40], [RECORDS[text] * a for _, a in ROWS], atol=1e-12)


@pytest.mark.parametrize("code", ["cp1252", "utf-16", "utf-8-sig"])
def test_letters_of_other_systems(tmp_path, code):
    path = tmp_path / "a.csv"
    path.write_bytes(("Time (s);Acc (m/s²)\n" + body(";", ",")).encode(code))
    assert read_record(str(path)).values[1] == pytest.approx(0.841)


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("Frequency (Hz),PSD (g2/Hz)\n5,0.01\n100,0.02\n", G**2),
        ("f [Hz];PSD [(m/s²)²/Hz]\n5;0,01\n100;0,02\n", 1.0),
        ("Freq,PSD\nHz,g^2/Hz\n5,0.01\n100,0.02\n", G**2),
        ("Frequency_Hz,g2/Hz\n5,0.01\n100,0.02\n", G**2),
    ],
)
def test_densities(tmp_path, text, factor):
    path = tmp_path / "a.csv"
    path.write_text(text)
    found = read_density(str(path))
    np.testing.assert_allclose(found.frequencies, [5.0, 100.0])
    np.testing.assert_allclose(found.values, [0.01 * factor, 0.02 * factor])
    path.write_text("freq,asd (mg/rtHz)\n5,10\n100,20\n")  # the root of a density is squared
    np.testing.assert_allclose(read_density(str(path)).values, [(0.01 * G) ** 2, (0.02 * G) ** 2])


def test_a_prefix_is_no_unit_of_a_column(tmp_path):
    """A column named M would be read as mega, and T for tera."""
    path = tmp_path / "a.csv"
    path.write_text("T,acc_M\n" + body())
    column = read_table(path, "FILE").columns[1]
    assert column.scale(ACCELERATION) is None
    with pytest.raises(InputError, match="column 'acc_M' must have a unit"):
        read_record(str(path))


def test_a_standard_as_a_density():
    """MIL-STD-810's minimum integrity has 7.7 g rms: 39.2 g^2 of the plateau and 20 g^2 of the slope."""
    found = read_density(str(EXAMPLES / "mil_std_810_minimum_integrity.csv"))
    assert found.rms == pytest.approx(np.sqrt(39.2 + 20.0) * G, rel=1e-9)


@pytest.mark.parametrize(
    "text", ["t (s),a (g)\n" + "1" * 200_000 + "x,2\n", "a" + "( " * 50_000 + ",b\n1,2\n"]
)
def test_long_cells_take_no_time(tmp_path, text):
    """Patterns over a long run of digits or brackets needed the square of its length: minutes."""
    path = tmp_path / "a.csv"
    path.write_text(text)
    begin = time.perf_counter()
    with pytest.raises(InputError, match="must have"):
        read_table(path, "FILE")
    assert time.perf_counter() - begin < 5.0


def test_dates_with_and_without_a_fraction(tmp_path):
    """A logger that leaves `.000` away; and dates that are none of the calendar."""
    path = tmp_path / "a.csv"
    stamps = [f"01.05.2024 12:00:{k / 2:06.3f}".removesuffix(".000") for k in range(40)]
    path.write_text("Time,a (g)\n" + "".join(f"{one},1\n" for one in stamps))
    np.testing.assert_allclose(read_table(path, "FILE").columns[0].values, np.arange(40) / 2)
    path.write_text("Time,a (g)\n" + "2024-13-45 12:00:00,1\n" * 20)
    with pytest.raises(InputError, match="FILE column 'Time' must have dates of the calendar"):
        read_table(path, "FILE")


def test_a_table_of_too_many_columns(tmp_path):
    """400 kB of columns needed 45 s."""
    path = tmp_path / "a.csv"
    path.write_text(
        ",".join(f"c{k}" for k in range(20_000)) + "\n" + (",".join(["1"] * 20_000) + "\n") * 5
    )
    begin = time.perf_counter()
    with pytest.raises(InputError, match=r"FILE must have at most 1000 columns, but .* has 20000"):
        read_table(path, "FILE")
    assert time.perf_counter() - begin < 1.0


def test_control_characters_in_names_are_shown(tmp_path):
    """They could move the cursor of a terminal, or turn its text round."""
    path = tmp_path / "a.csv"
    path.write_text("Time (s),\x1b[31mz\u202e (g)\n" + body())
    assert read_table(path, "FILE").heads == "Time (s),\\x1b[31mz\\u202e (g)"


@pytest.mark.parametrize(
    "text, rms",
    [
        (
            "Frequency (Hz),Amplitude (g^2/Hz)\n20,0.01\n80,0.05\n350,0.05\n2000,0.01\n",
            6.92030892086149 * 9.80665,
        ),
        (
            "Frequency;PSD\nHz;(m/s^2)^2/Hz\n10;10\n100;10\n300;0,51\n500;5\n2000;5\n",
            96.5651501276714,
        ),
        (
            "f (Hz),PSD (g^2/Hz)\n5,.02\n20,.02\n20,.005\n200,.005\n200,.001\n500,.001\n",
            1.5**0.5 * 9.80665,
        ),
    ],
    ids=["named by its unit alone", "a row of units", "steps"],
)
def test_densities_as_standards_and_engines_write_them(tmp_path, text, rms):
    path = tmp_path / "psd.csv"
    path.write_text(text)
    assert read_density(str(path)).rms == pytest.approx(rms, rel=1e-8)


def test_three_equal_frequencies_are_no_step(tmp_path):
    path = tmp_path / "psd.csv"
    path.write_text("f (Hz),PSD (g^2/Hz)\n5,.02\n20,.02\n20,.01\n20,.005\n200,.005\n")
    with pytest.raises(InputError, match="ascending frequencies"):
        read_density(str(path))
