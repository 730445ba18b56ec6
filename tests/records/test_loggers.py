"""Files of loggers as they are: each is read with the right value, or asks for one fact that makes it right."""

import json
import shlex

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.records.cleaning import clean
from harvester.records.record_facts import RecordFacts
from harvester.records.record_files import read_density, read_record
from tests.support.loggers import (
    ASKED,
    COUNT,
    RATE,
    RIGHT,
    STATED,
    G,
    T,
    Z,
    clock,
    octave_rms,
    rows,
    seconds,
)


def rms_of(path, axis=None, **facts):
    """The rms in the octave in g, and the rate, of a file that is cleaned."""
    record = clean(str(path), RecordFacts(axis=axis, **facts))
    return octave_rms(record.values, record.rate) / G, record.rate


@pytest.mark.parametrize("name", STATED)
def test_files_that_state_what_they_are(tmp_path, name):
    text, axis = STATED[name]
    (tmp_path / "a.csv").write_text(text)
    rms, rate = rms_of(tmp_path / "a.csv", axis)
    assert rate == pytest.approx(RATE, rel=1e-4)
    assert rms == pytest.approx(RIGHT, rel=3e-3)


@pytest.mark.parametrize("name", ASKED)
def test_files_that_ask_for_one_fact(tmp_path, harvester, name):
    """The refusal is one line with the option; with it the value is right."""
    text, axis, option, value = ASKED[name]
    path = tmp_path / "a.csv"
    path.write_text(text)
    status, _, err = harvester("record", path, *axis.split())
    assert status == 2
    assert option in err
    assert err.count("\n") == 1
    status, out, err = harvester("record", path, *axis.split(), option, value, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert found["rate"] == pytest.approx(RATE, rel=1e-4) or option == "--time-unit"
    if option == "--time-unit":
        assert found["rate"] == pytest.approx(50e3)
        return
    bands = [b["rms"] / G for b in found["bands"] if b["low"] == pytest.approx(22.1, abs=0.1)]
    assert bands[0] == pytest.approx(RIGHT, rel=3e-3)


@pytest.mark.parametrize("name", sorted({*STATED, *ASKED}))
@pytest.mark.slow
def test_a_scene_reads_the_file_or_names_a_command_that_works(
    tmp_path, harvester, monkeypatch, name
):
    text = STATED[name][0] if name in STATED else ASKED[name][0]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log 1.csv").write_text(text)
    try:
        record = read_record("log 1.csv")
    except InputError as error:
        command = shlex.split(str(error).split(": '")[-1].removesuffix("' mends it"))
        values = {"HZ": "200", "UNIT": ASKED[name][3] if name in ASKED else ""}
        status, _, err = harvester(*(values.get(word, word) for word in command[1:]))
        assert (status, err) == (0, "")
        record = read_record("clean.csv")
    if name not in ("ms or us", "a restart"):  # whose remedy is not the user's own answer
        assert 1.0 / record.spacing == pytest.approx(RATE, rel=1e-4)
        assert octave_rms(record.values[:COUNT], RATE) / G == pytest.approx(RIGHT, rel=5e-3)


def test_units_of_times_that_differ_by_1000(tmp_path):
    """What is possible for an accelerometer decides; the note has the unit and the rate."""
    for factor, unit in ((1e3, "ms"), (1e6, "us")):
        (tmp_path / "a.csv").write_text("t,z (g)\n" + rows(seconds("{:.0f}", factor)))
        notes = [str(line) for line in clean(str(tmp_path / "a.csv")).notes]
        assert any(f"read in {unit}, at 200 samples per second" in line for line in notes)
    (tmp_path / "a.csv").write_text("t (s),z (g)\n" + rows(seconds("{:.0f}", 1e3)))
    record = clean(str(tmp_path / "a.csv"))  # a unit that is stated holds, with a warning
    assert record.rate == pytest.approx(0.2)
    assert "(`time_unit` ms), it is 200" in str(record.warnings[0])


@pytest.mark.parametrize("value", [1.0, 0.0])
def test_a_sensor_that_died_is_reported_with_the_part_that_lives(tmp_path, harvester, value):
    """From 3 s on the values are constant: a warning, and the options for the first 3 s."""
    dead = np.where(T < 3.0, Z - 1.0 + value, value)
    (tmp_path / "a.csv").write_text("time (s),z (g)\n" + rows(seconds(), dead))
    status, out, _ = harvester("record", tmp_path / "a.csv")
    assert status == 0
    assert "600 samples are constant, a share of 0.5, longest from 3 to 5.995 s" in out
    assert "--from 0 --to 2.995 selects" in out
    living = harvester("record", tmp_path / "a.csv", "--from", "0", "--to", "2.995")[1]
    assert "constant" not in living
    assert "clipped" not in out


def test_a_coarse_sensor_at_rest_is_not_dead(tmp_path):
    """Values of a coarse resolution repeat by chance."""
    rng = np.random.default_rng(3)
    coarse = np.round(0.4 * rng.standard_normal(COUNT))
    (tmp_path / "a.csv").write_text("time (s),z (g)\n" + rows(seconds(), coarse))
    assert not [w for w in clean(str(tmp_path / "a.csv")).warnings if w.code == "stands_still"]


def test_files_of_times_alone(tmp_path, harvester):
    (tmp_path / "a.csv").write_text("Timestamp,X,Y,Z\n" + "".join(f"{t:.3f}\n" for t in T))
    status, _, err = harvester("record", tmp_path / "a.csv")
    assert status == 2
    assert "export its axes as well" in err


def test_all_samples_of_a_clipped_sensor_are_counted(tmp_path):
    """Crests that are cut for three samples and for two: all five are at the end of the range."""
    values = np.random.default_rng(7).uniform(-1.0, 0.8, COUNT)
    values[100:103] = values[300:302] = 1.0
    (tmp_path / "a.csv").write_text("time (s),z (g)\n" + rows(seconds(), values))
    [clipped] = [w for w in clean(str(tmp_path / "a.csv")).warnings if w.code == "clipped"]
    assert clipped.numbers["samples"] == 5


def test_a_rate_that_changes_is_named(tmp_path, harvester):
    """200 Hz for 3 s, then 100 Hz: the refusal selects either part by options that work."""
    path = tmp_path / "a.csv"
    times = [*T[:600], *(T[599] + 0.01 * np.arange(1, 301))]
    values = [*Z[:600], *Z[600::2]]
    path.write_text("time (s),z (g)\n" + rows([f"{t:.4f}" for t in times], values))
    status, _, err = harvester("record", path)
    assert status == 2
    assert "changes from 200 to 100 Hz after 2.72 s: --to 2.72 selects" in err
    assert json.loads(harvester("record", path, "--to", "2.72", "--json")[1])[
        "rate"
    ] == pytest.approx(200)
    rest = harvester("record", path, "--from", "3.085", "--json")[1]
    assert json.loads(rest)["rate"] == pytest.approx(100)


def test_more_columns_than_names_are_refused(tmp_path, harvester):
    path = tmp_path / "a.csv"
    path.write_text(
        "time (s),z (g)\n" + "".join(f"{t:.3f},1,{z:.4f}\n" for t, z in zip(T, Z, strict=True))
    )
    status, _, err = harvester("record", path)
    assert status == 2
    assert "has 2 names above 3 columns" in err


def test_parts_between_long_gaps_are_joined(tmp_path, harvester):
    """A gap of 3 s: the parts one behind the other have the samples and the rms of both."""
    path = tmp_path / "a.csv"
    path.write_text("time (s),z (g)\n" + rows([f"{t + 3.0 * (t > 2.5):.3f}" for t in T]))
    status, _, err = harvester("record", path)
    assert status == 2
    assert "--join all of them" in err
    found = json.loads(harvester("record", path, "--join", "--json")[1])
    assert found["samples"] == COUNT
    assert found["rate"] == pytest.approx(RATE)
    bands = [b["rms"] / G for b in found["bands"] if b["low"] == pytest.approx(22.1, abs=0.1)]
    assert bands[0] == pytest.approx(RIGHT, rel=0.01)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            't (ms),z (mg)\n"995","1.5"\n"1,000","1,096.20"\n',
            "thousands, but .* has '1,096.20' in line 3",
        ),
        (
            "t (ms);z (mg)\n995,0;1,5\n1.000,0;1.096,20\n",
            "thousands, but .* has '1.000,0' in line 3",
        ),
        ("t (ms);z (mg)\n995,0;1,5\n1\u202f000,0;1,5\n", "thousands, but .* in line 3"),
        ("    -1\n    58\nacc z\n  0.1  0.2  0.3\n    -1\n", "universal file .*: export"),
        ("t (s),z (g)\n" + "0.1,0.2\n0.2,\n0.3,0.2,7,8\n" * 3, "4 cells in row 3, '0.3,0.2,7,8'"),
        ('t (s),z (g)\n0.1,0.2\n0.2,\n0.3,"0.2\n', "a quotation mark that is not closed"),
    ],
)
def test_forms_that_no_number_has_are_refused(tmp_path, text, says):
    """Each was a false reason, such as 'has numbers in its times alone', or the words of pandas."""
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        clean(str(path), RecordFacts())


def test_a_summary_that_nothing_reports_is_refused(tmp_path):
    path = tmp_path / "psd.csv"
    path.write_text("f (Hz),psd (g^2/Hz)\n20,0.01\n80,0.05\n2000,0.01\nOverall,6.06\n")
    with pytest.raises(InputError, match=r"ends with .Overall,6\.06.: delete it"):
        read_density(str(path))


def test_a_start_of_dates_among_the_settings(tmp_path):
    """A cell other than a date, in a column that begins with one, was an internal error."""
    path = tmp_path / "a.csv"
    path.write_text("2031-04-10;11:59:55;1.0\nx;11:59:56;1.0\n2031-04-10;11:59:57;1.0\n" * 3)
    with pytest.raises(InputError, match="dates of the calendar"):
        clean(str(path), RecordFacts(unit="g"))


SEMICOLONS = "time (s);z (g)\n" + rows(seconds(sign=","), sep=";", sign=",")
COUNTED = "".join(f"{k}\t{t}\t{z:.4f}\n" for k, (t, z) in enumerate(zip(T, Z, strict=True)))


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("Samples;1 200\nRange;12.345,6\n" + SEMICOLONS, {}),
        ("# Samples; 1 200\n" + SEMICOLONS, {}),
        ("time[s]: z[g]:\n" + rows(seconds(), sep=" "), {}),
        ("time[s] z[g]:\n" + rows(seconds(), sep=" "), {}),
        ("Rate: 200 Hz\nAvg\n" + "".join(f"{z:.4f}\n" for z in Z), {"unit": "g"}),
        ("time (s),z (g)\n0.000\nERROR\n" + rows(seconds()[1:], Z[1:]), {}),
        ("Sample rate: 200 Hz\nUpdate rate: 2 Hz\nz (g)\n" + "".join(f"{z:.4f}\n" for z in Z), {}),
        ("".join(f"{clock(k)} -> {z:.4f} 0 1\n" for k, z in enumerate(Z)), {"axis": "x", "unit": "g"}),
        (
            "".join(f"{clock(k)} -> {z:.4f};0,1;1\n".replace(".", ",") for k, z in enumerate(Z)),
            {"axis": "x", "unit": "g"},
        ),
        (
            "".join(f"{clock(k)} -> x:0 y:0.1 z:{z:.4f}\n" for k, z in enumerate(Z)),
            {"axis": "z", "unit": "g"},
        ),
        ("time (s),z (g)\n" + rows(seconds()) + "nan,nan\n", {}),
    ],
    ids=[
        "settings with thousands", "remark with thousands", "colons behind names", "one colon",
        "a name that is a kind of value", "a short first row", "updates of a display",
        "an arrow and spaces", "an arrow and semicolons", "an arrow and labels", "a row of missing values",
    ],
)  # fmt: skip
def test_forms_near_others_are_read(tmp_path, text, facts):
    """Each was refused, or read wrong, by the rule of another form, as of thousands or sections."""
    path = tmp_path / "a.csv"
    path.write_text(text)
    record = clean(str(path), RecordFacts(**facts))
    assert record.rate == pytest.approx(RATE, rel=1e-4)
    assert octave_rms(record.values, record.rate) / G == pytest.approx(RIGHT, rel=3e-3)
    assert not any(note.code == "lines_below" for note in record.notes)


def test_a_column_of_counts_is_not_a_universal_file(tmp_path):
    (tmp_path / "a.csv").write_text("-1\n58\n" + "".join(f"{int(1000 * z)}\n" for z in Z[2:]))
    assert clean(str(tmp_path / "a.csv"), RecordFacts(rate=RATE, unit="mg")).rate == RATE


@pytest.mark.parametrize(
    "rows_of_data", [COUNTED, rows(seconds(), sep="\t")], ids=["counted", "plain"]
)
def test_a_spectrum_is_no_record(tmp_path, rows_of_data):
    """Its frequencies were named times, at 0.5 Hz each as 0.5 ms."""
    text = "X-axis unit: Hz\nX-axis delta: 5.0E-1\nY-axis unit: m/s2\n\n" + rows_of_data
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match="'Hz' as the unit of the first axis"):
        clean(str(tmp_path / "a.csv"), RecordFacts())


def test_a_part_with_other_columns_is_not_left_out(tmp_path):
    """100 rows of two columns above a table of three were left out without a word."""
    more = rows(seconds()[100:], Z[100:], tail=",20")
    text = "time (s),z (g)\n" + rows(seconds()[:100], Z[:100]) + "time (s),z (g),T (C)\n" + more
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match="2 names above 3 columns"):
        clean(str(tmp_path / "a.csv"), RecordFacts())


@pytest.mark.parametrize(("zeros", "offset"), [(1, 1.0), (3, -1.0), (1, 0.0), (0, 1.0)])
def test_zeros_before_the_first_sample_are_reported(tmp_path, harvester, zeros, offset):
    """They gave a peak of 1 g without a word; --from begins behind them, and a signal about 0 has none."""
    values = Z - Z.mean() + offset
    values[:zeros] = 0.0
    (tmp_path / "a.csv").write_text("time (s),z (g)\n" + rows(seconds(), values))
    told = [w.code for w in clean(str(tmp_path / "a.csv"), RecordFacts()).warnings]
    assert ("zeros_at_the_beginning" in told) == (zeros > 0 and offset != 0.0)
    if "zeros_at_the_beginning" in told:
        start = f"--from {zeros / RATE:g}"
        answer = harvester("record", tmp_path / "a.csv")
        assert start in answer[1] + answer[2]
        status, out, _ = harvester("record", tmp_path / "a.csv", *start.split(), "--json")
        found = json.loads(out)
        assert (status, found["samples"], found["warnings"]) == (0, COUNT - zeros, [])


@pytest.mark.parametrize(
    "text, begin",
    [
        ('{"t": 0, "a": 1}\n{"t": 1, "b": 2}\n', "FILE must have JSON records of the same names"),
        ('{"t": 0, "a": [1, 2]}\n', "FILE must have JSON records of the same names"),
        ('{"t": 0, "a": 1}\n{"t": 1,\n', "FILE must have rows of numbers"),
    ],
)
def test_json_that_is_no_table_is_refused(tmp_path, text, begin):
    """One line names the first record that differs."""
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=begin):
        clean(str(tmp_path / "a.json"))


def test_steps_that_differ_are_no_clock(tmp_path):
    """A column dX of other numbers than one step leaves the rate open."""
    lines = "".join(f"0,{1 + k % 2},{z:.4f}\n" for k, z in enumerate(Z))
    (tmp_path / "a.csv").write_text("X0 (s),dX (s),az (g)\n" + lines)
    with pytest.raises(InputError, match="must be given"):
        clean(str(tmp_path / "a.csv"), RecordFacts(axis="az"))
