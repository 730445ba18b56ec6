"""Facts that a file states twice, or leaves open: each is decided with a note, or asked for."""

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.identification.impedance_table import impedance
from harvester.records.cleaning import clean
from harvester.records.csv_table import read_table
from harvester.records.record_facts import AskedError, RecordFacts
from harvester.records.record_files import read_record
from tests.support.loggers import COUNT, RATE, RIGHT, G, T, Z, clock, octave_rms, rows, seconds


def written(folder, text):
    path = folder / "mine.csv"
    path.write_text(text)
    return str(path)


def codes(record):
    return {line.code for line in (*record.notes, *record.warnings)}


def test_a_rate_above_that_contradicts_the_times(tmp_path):
    """The lines state 500 Hz, the times 200 Hz: a warning; a scene asks for the correction."""
    path = written(tmp_path, "# Sample rate: 500 Hz\ntime (s),z (g)\n" + rows(seconds()))
    record = clean(path)
    assert record.rate == pytest.approx(RATE)
    [doubt] = [line for line in record.warnings if line.code == "rate_contradicts"]
    assert doubt.numbers == {"rate": pytest.approx(200.0), "stated": 500.0}
    with pytest.raises(InputError, match="one sampling rate, but has 500 Hz above"):
        read_record(path)
    agreeing = written(tmp_path, "# Sample rate: 201 Hz\ntime (s),z (g)\n" + rows(seconds()))
    assert "rate_contradicts" not in codes(clean(agreeing))


def test_the_rate_above_decides_the_unit_of_the_times(tmp_path):
    """Steps of 20 may be ms (50 Hz) or us (50 kHz)."""
    rest = "time,z (g)\n" + rows(seconds("{:.0f}", 4e3))
    with pytest.raises(AskedError, match="`time_unit` ms for 50 per second"):
        clean(written(tmp_path, rest))
    record = clean(written(tmp_path, "# Sample rate: 50 kHz\n" + rest))
    assert record.rate == pytest.approx(50e3)
    assert "unit_by_stated_rate" in codes(record)


@pytest.mark.parametrize(
    ("line", "rate", "code"),
    [
        ("Sampling Period,0.005", 200.0, "unit_of_period"),
        ("Sampling Period,20", None, ""),  # ms or us
        ("Sampling Period,20 us", 50e3, ""),
        ("Sampling Period (ms),5", 200.0, ""),
    ],
)
def test_a_period_without_a_unit(tmp_path, line, rate, code):
    path = written(tmp_path, f"{line}\nz (g)\n" + "".join(f"{z:.4f}\n" for z in Z))
    if rate is None:
        with pytest.raises(
            AskedError, match="`rate` 50 if it is in ms, `rate` 50000 if it is in us"
        ):
            clean(path)
        assert clean(path, RecordFacts(rate=50.0)).rate == pytest.approx(50.0)
        return
    record = clean(path)
    assert record.rate == pytest.approx(rate)
    assert not code or code in codes(record)


@pytest.mark.parametrize(
    ("head", "stamps"),
    [
        ("sec,usec", [f"{1000 + k // 200},{5000 * (k % 200)}" for k in range(COUNT)]),
        ("time (s),time (ms)", [f"{k // 200},{5 * (k % 200)}" for k in range(COUNT)]),
        ("Time,ms", [f"{clock(k)[:8]},{int(clock(k)[9:])}" for k in range(COUNT)]),
        ("Time,uptime (ms)", [f"{clock(k)[:8]},{90000 + 5 * k}" for k in range(COUNT)]),
    ],
)
def test_fractions_of_a_second_in_a_second_column(tmp_path, head, stamps):
    """Without them the clock is coarse, and a gap in it is not seen."""
    keep = [k for k in range(COUNT) if k not in (301, 302)]
    path = written(tmp_path, f"{head},z (g)\n" + rows([stamps[k] for k in keep], Z[keep]))
    record = clean(path)
    assert record.rate == pytest.approx(RATE, rel=1e-6)
    assert len(record.values) == COUNT
    assert octave_rms(record.values, RATE) / G == pytest.approx(RIGHT, rel=3e-3)
    assert "coarse_clock" not in codes(record)
    told = codes(record) & {"fraction_column", "finer_times"}
    assert told or head == "Time,ms"  # the layout has joined these two


@pytest.mark.parametrize("slower", [1.3, 2.0])
@pytest.mark.parametrize("tick", [0.0, 0.02])
def test_a_rate_that_changes_for_good_is_refused(tmp_path, slower, tick):
    """Rows at 200 Hz, then slower ones: they were all read at the mean rate, with a note on jitter.

    At one rate the same clock, which is coarse if it has a tick, is read.
    """
    steps = np.where(np.arange(800) < 400, 0.005, 0.005 * slower)
    for every, refused in ((steps, tick == 0.0), (np.full(800, 0.005 * slower), False)):
        t = np.cumsum(every)
        t = np.floor(t / tick) * tick if tick else t
        lines = "\n".join(f"{at:.5f},{np.sin(9.0 * at):.5f}" for at in t)
        path = written(tmp_path, f"time (s),z (g)\n{lines}\n")
        if refused:
            with pytest.raises(InputError, match=rf"changes from 200 to {200 / slower:.4g} Hz"):
                clean(path)
        elif every is not steps:
            assert clean(path).rate == pytest.approx(200.0 / slower, rel=0.01)


@pytest.mark.parametrize(
    ("text", "facts", "code"),
    [
        ("time (s),z (g)\n" + rows(seconds()), {"unit": "mg"}, "given_unit"),
        ("time (s),z (g)\n" + rows(seconds()), {"time_unit": "ms"}, "given_unit"),
        ("# rate: 100 Hz\nz (g)\n" + "\n".join(map(str, Z)), {"rate": 200.0}, "given_rate"),
    ],
)
def test_an_option_over_the_fact_of_the_file_is_noted(tmp_path, text, facts, code):
    assert code in codes(clean(written(tmp_path, text), RecordFacts(**facts)))


def test_an_option_that_agrees_is_not_noted(tmp_path):
    path = written(tmp_path, "time (s),z (g)\n" + rows(seconds()))
    assert "given_unit" not in codes(clean(path, RecordFacts(unit="g", time_unit="s")))


F = np.linspace(50.0, 150.0, 40)
ZED = 1.0 / (2j * np.pi * F * 40e-9 * (1 - 0.02j))
DEG = np.degrees(np.angle(ZED))


def of(tmp_path, head, *columns):
    lines = "\n".join(",".join(f"{v:.9g}" for v in row) for row in zip(F, *columns, strict=True))
    return impedance(read_table(written(tmp_path, f"f (Hz),{head}\n{lines}\n"), "FILE"), F, "FILE")


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("|Z| (ohm),phase of Y (deg)", (np.abs(ZED), -DEG)),
        ("|Y| (S),phase of Z (deg)", (1 / np.abs(ZED), DEG)),
        ("|Y| (S),phase (deg)", (1 / np.abs(ZED), -DEG)),
        ("|Z| (ohm),phase Z (rad),phase Y (rad)", (np.abs(ZED), DEG / 57.29578, -DEG / 57.29578)),
        ("|Z| (ohm),theta", (np.abs(ZED), DEG)),
    ],
)
def test_phases_are_of_the_quantity_that_they_name(tmp_path, head, columns):
    """The phase of Y was read as that of Z: a negative capacitance."""
    z, known = of(tmp_path, head, *columns)
    assert known
    np.testing.assert_allclose(z, ZED, rtol=1e-5)


@pytest.mark.parametrize(
    ("head", "columns", "says"),
    [
        (
            "|Z| (ohm),phase",
            (np.abs(ZED), DEG / 57.29578),
            "must have a unit, but has none: name it",
        ),
        ("|Z| (ohm),phase (V)", (np.abs(ZED), DEG), "must have the unit deg or rad"),
        (
            "|Z| (ohm),phase 1 (deg),phase 2 (deg)",
            (np.abs(ZED), DEG, DEG + 5.0),
            "must have one column of a phase",
        ),
        (
            "|Z| (ohm),|Y| (S),phase (deg)",
            (np.abs(ZED), 1 / np.abs(ZED), DEG),
            "name it 'phase of Z",
        ),
    ],
)
def test_open_phases_are_asked_for(tmp_path, head, columns, says):
    with pytest.raises(InputError, match=says):
        of(tmp_path, head, *columns)


def test_the_times_of_a_ring_down_are_read_as_those_of_a_record(tmp_path):
    """One reader: whole seconds and their fractions in another column."""
    from harvester.identification.read import read_file

    volts = np.exp(-T) * np.sin(300.0 * T)
    stamps = [f"{k // 200},{5 * (k % 200)}" for k in range(COUNT)]
    path = written(tmp_path, "time (s),time (ms),voltage (V)\n" + rows(stamps, volts))
    [decay] = read_file(path + "@open")
    np.testing.assert_allclose(decay.t, T, atol=1e-9)
