"""`harvester record`: what loggers do wrong is mended and told, or refused with the remedy; nothing is guessed."""

import json

import numpy as np
import pytest
from scipy.signal import detrend

import harvester as hv
from harvester.presentation.diagnostic import has
from harvester.records.cleaning import CleanRecord, clean
from harvester.records.record_files import read_record
from harvester.studies.record import record_spectra

G = 9.80665
N = 2000
RATE = 500.0
T = np.arange(N) / RATE
SHAKING = np.sin(2 * np.pi * 20 * T) + 0.5 * np.sin(2 * np.pi * 3 * T + 1)


def written(path, heads, *columns, keep=None):
    rows = [
        ",".join("" if np.isnan(v) else f"{v:.6f}" for v in row)
        for row in zip(*columns, strict=True)
    ]
    rows = rows if keep is None else [row for row, one in zip(rows, keep, strict=True) if one]
    path.write_text("\n".join([heads, *rows]) + "\n")
    return path


@pytest.mark.slow
def test_three_axes_with_offset_and_drift(harvester, tmp_path):
    """The z axis in mg with gravity on it: at even times, without gravity and drift, as a scene reads it."""
    z = 1000.0 * (SHAKING + 1.0 + 0.05 * T)
    path = written(tmp_path / "a.csv", "Time (s),X (mg),Y (mg),Z (mg)", T, z + 5, z - 7, z)
    status, out, err = harvester(
        "record", path, "--axis", "z", "--out", tmp_path / "c.csv", "--report"
    )
    assert (status, err) == (0, "")
    assert "found: offset of 10.79 m/s^2 removed (1.1 g)" in out
    assert "found: drift of 1." in out
    found = read_record(str(tmp_path / "c.csv"))
    assert found.spacing == pytest.approx(1 / RATE)
    np.testing.assert_allclose(found.values[:N], G * SHAKING, atol=0.15 * G)
    assert (tmp_path / "c.png").stat().st_size > 20_000
    assert "rms" in (tmp_path / "report.html").read_text()
    assert (
        "--axis must be given if FILE 'a.csv' has several columns, 'X, Y, Z', but is left out"
        in harvester("record", path)[2]
    )
    assert (
        "--axis must be one of the columns of FILE" in harvester("record", path, "--axis", "w")[2]
    )


@pytest.mark.slow
def test_gaps_repeats_and_jitter(harvester, tmp_path):
    """Five samples lost and one time repeated are mended and reported; thirty in a row are not invented."""
    keep = np.ones(N, bool)
    keep[300:305] = False
    times = np.where(np.arange(N) == 700, T[699], T)
    values = SHAKING.copy()
    values[1000] = np.nan
    path = written(tmp_path / "a.csv", "t [s],a [g]", times, values, keep=keep)
    answer = json.loads(harvester("record", path, "--out", tmp_path / "c.csv", "--json")[1])
    assert any("1 times repeat" in line for line in answer["found"])
    assert any("missing samples filled in, 5 in a row" in line for line in answer["found"])
    np.testing.assert_allclose(
        read_record(str(tmp_path / "c.csv")).values[:N], G * SHAKING, atol=0.2 * G
    )
    keep[300:330] = False
    path = written(tmp_path / "a.csv", "t [s],a [g]", T, SHAKING, keep=keep)
    assert "must have no gap of more than 10 samples" in harvester("record", path)[2]


def logged(seed):
    """A logger's record: jitter and rounding of its stamps, lost samples, doubled rows, a clock that begins anywhere.

    Returns times in s, values, the rate, the true samples (m/s^2), and how many of them are lost.
    """
    rng = np.random.default_rng([8, seed])
    rate = np.exp(rng.uniform(np.log(200.0), np.log(900.0)))
    n = 3000
    sample = np.arange(n)
    truth = np.convolve(rng.standard_normal(n + 40), np.hanning(41), "valid")[:n]
    times = sample / rate + rng.uniform(0.0, 0.3) / rate * rng.standard_normal(n)
    keep = np.ones(n, bool)
    for begin in rng.choice(np.arange(100, n - 100, 60), rng.integers(0, 6), replace=False):
        keep[begin : begin + rng.integers(1, 9)] = False
    rows = np.flatnonzero(keep)
    if seed % 3 == 0:
        rows = np.sort(np.append(rows, rng.choice(rows[200:-200], 2, replace=False)))
    times = np.sort(times[rows]) if seed % 2 else times[rows]
    if seed % 4 == 1:
        times = np.round(times, 3)
    return times + (1.7e9 if seed % 5 == 0 else 0.0), truth[rows], rate, truth, n - int(keep.sum())


@pytest.mark.parametrize("seed", range(40))
def test_jitter_is_no_missing_sample(tmp_path, seed):
    """40 records with jitter, gaps, doubled rows and milliseconds: the rate, and the missing parts, to the sample."""
    times, values, rate, truth, lost = logged(seed)
    unit, name = ((1e3, "timestamp_ms"), (1.0, "time (s)"))[seed % 4 != 1]
    rows = [f"{unit * t:.4f},{v:.6f}" for t, v in zip(times, values, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([f"{name},a (m/s^2)", *rows]) + "\n")
    found = clean(str(tmp_path / "a.csv"))
    assert found.rate == pytest.approx(rate, rel=2e-4)
    assert len(found.values) == len(truth)
    told = {one.code: one.numbers for one in found.notes}
    assert told.get("samples_filled_in", {"samples": 0})["samples"] == lost
    assert told.get("unit_of_times") == (
        {"unit": "ms", "column": name} if name == "timestamp_ms" else None
    )
    off = found.values - detrend(truth)
    # a place that is off by a row or two near a gap
    assert np.sqrt(np.mean(off**2)) < 0.1 * truth.std()


def test_a_part_of_a_record(harvester, tmp_path):
    """From and to in s from the first row, and the longest part without a gap, wherever the clock begins."""
    keep = np.ones(N, bool)
    keep[300:340] = keep[1500:1540] = False
    path = written(tmp_path / "a.csv", "t [s],Acc Z [g]", 1e6 + T, SHAKING, keep=keep)
    status, _, err = harvester("record", path)
    assert status == 2 and "40 at 0.598 s from the beginning: --longest uses" in err
    answer = json.loads(harvester("record", path, "--longest", "--axis", "acc z [g]", "--json")[1])
    assert answer["samples"] == 1160
    assert any("the longest of 3 parts: from 0.68 to 2.998 s" in line for line in answer["found"])
    answer = json.loads(harvester("record", path, "--from", "700ms", "--to", "1.698", "--json")[1])
    assert answer["samples"] == 500
    answer = json.loads(harvester("record", path, "--to", "0.598", "--json")[1])
    assert answer["samples"] == 300  # from the first row on
    assert (
        "--to must be later than --from" in harvester("record", path, "--from", "2", "--to", "1")[2]
    )
    assert (
        "--from and --to must leave at least 16 samples of the 3.998 s"
        in harvester("record", path, "--from", "9")[2]
    )
    assert "--from must be at least 0 s" in harvester("record", path, "--from=-1")[2]


def test_a_tone_has_no_error_of_a_random_signal(tmp_path):
    """Next to noise a sine of twice its rms: 35 % were stated for a tone that is known to a per cent."""
    noise = np.random.default_rng(4).standard_normal(N)
    path = written(tmp_path / "a.csv", "t (s),a (m/s2)", T, noise + np.sin(2 * np.pi * 50 * T))
    bands = record_spectra(clean(str(path))).bands
    (tone,) = [band for band in bands if band.low < 50 < band.high]
    assert tone.rms.stderr is None and tone.rms.unknown == "a tone" and tone.rms.error95 is None
    assert all(band.rms.stderr for band in bands if not band.low < 50 < band.high)


@pytest.mark.parametrize("column", ["time", "value"])
def test_numbers_without_a_size(harvester, tmp_path, column):
    """The square of 1e300 overflows: it was an internal error of the figure."""
    path = written(tmp_path / "a.csv", "t (s),a (g)", T, SHAKING)
    lines = path.read_text().splitlines()
    lines[-1] = "1e300,1" if column == "time" else f"{T[-1]},1e300"
    path.write_text("\n".join(lines))
    status, out, err = harvester("record", path, "--out", tmp_path / "c.csv")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "row 2000 must be at most 1e+50 in size, but is 1e+300" in err


def test_no_times_and_coarse_times(harvester, tmp_path):
    path = written(tmp_path / "a.csv", "Z (g)", SHAKING)
    assert "--rate must be given for a file without times" in harvester("record", path)[2]
    answer = json.loads(harvester("record", path, "--rate", "0.5kHz", "--json")[1])
    assert (answer["rate"], answer["samples"]) == (RATE, N)
    path = written(tmp_path / "a.csv", "time (s),Z (g)", np.floor(5 * T) / 5, SHAKING)
    answer = json.loads(harvester("record", path, "--json")[1])
    assert any("the clock is coarse" in line for line in answer["found"])
    assert answer["rate"] == pytest.approx(RATE, rel=1e-9)
    path = written(tmp_path / "a.csv", "time (s),Z (g)", np.floor(3.7 * T) / 3.7, SHAKING)
    answer = json.loads(harvester("record", path, "--json")[1])
    assert answer["rate"] == pytest.approx(RATE, rel=1.1 / 1700)
    path = written(tmp_path / "a.csv", "time (s),Z (g)", np.floor(T / 3), SHAKING)
    assert "its clock is too coarse" in harvester("record", path)[2]


@pytest.mark.slow
def test_rows_without_times_stay(harvester, tmp_path):
    """A time in every fifth row alone: 90 Hz stay 90 Hz at 500 samples per second, where 100 would fold them to 10."""
    times = np.where(np.arange(N) % 5 == 0, T, np.nan)
    path = written(tmp_path / "a.csv", "time (s),Z (g)", times, np.sin(2 * np.pi * 90 * T))
    answer = json.loads(harvester("record", path, "--out", tmp_path / "c.csv", "--json")[1])
    assert answer["rate"] == pytest.approx(RATE, rel=1e-4)
    power = np.abs(np.fft.rfft(read_record(str(tmp_path / "c.csv")).values[:1500])) ** 2
    assert np.argmax(power) == 270


def test_a_coarse_crest_is_not_clipped(harvester, tmp_path):
    """A slow sine in steps of 0.1 g is at rest at its crests; what jumps to its end is clipped."""
    coarse = np.round(SHAKING, 1)
    slow = np.round(np.sin(2 * np.pi * 2 * T), 1)
    assert harvester("record", written(tmp_path / "a.csv", "t (s),a (g)", T, coarse))[0] == 0
    status, out, _ = harvester("record", written(tmp_path / "a.csv", "t (s),a (g)", T, slow))
    assert status == 0 and "too coarse to determine" in out
    path = written(tmp_path / "a.csv", "t (s),a (g)", T, np.clip(coarse, -0.8, 0.8))
    assert "must not be clipped" in harvester("record", path)[2]


def test_paired_times_and_a_record_too_large(harvester, tmp_path, monkeypatch):
    """Times two and two together have no rate; a clean file that no scene would read is not written."""
    times = np.repeat(np.arange(10.0), 2)[:19] + np.tile([0.0, 0.001], 10)[:19]
    path = written(tmp_path / "a.csv", "t (s),a (g)", times, SHAKING[:19])
    assert "must have times at about even steps" in harvester("record", path)[2]
    monkeypatch.setattr("harvester.studies.record.MOST_BYTES", 10_000)
    path = written(tmp_path / "a.csv", "t (s),a (g)", T, SHAKING)
    status, out, err = harvester("record", path, "--out", tmp_path / "c.csv")
    assert (status, out) == (2, "") and "at most 10000 bytes" in err
    assert not (tmp_path / "c.csv").exists()


@pytest.mark.slow
def test_resampling_folds_nothing_back(harvester, tmp_path):
    """170 Hz at 200 samples per second would be 30 Hz: the filter removes it, and the rest stays."""
    path = written(
        tmp_path / "a.csv", "time (s),a (m/s^2)", T, SHAKING + np.sin(2 * np.pi * 170 * T)
    )
    answer = json.loads(
        harvester("record", path, "--rate", "200", "--out", tmp_path / "c.csv", "--json")[1]
    )
    assert answer["rate"] == 200.0
    values = read_record(str(tmp_path / "c.csv")).values[:800]
    power = np.abs(np.fft.rfft(values)) ** 2
    f = np.fft.rfftfreq(800, 1 / 200)
    assert power[np.argmin(np.abs(f - 30))] < 1e-4 * power[np.argmin(np.abs(f - 20))]
    assert np.sqrt(np.mean(values**2)) == pytest.approx(np.sqrt(np.mean(SHAKING**2)), rel=0.02)


def test_rms_by_octave_is_the_whole(tmp_path):
    """The octaves' squares add up to that of the record, and white noise lies within its stated error."""
    noise = np.random.default_rng(4).standard_normal(N)
    found = record_spectra(clean(str(written(tmp_path / "a.csv", "t (s),a (m/s2)", T, noise))))
    assert sum(b.rms.value**2 for b in found.bands) == pytest.approx(found.record.rms**2, rel=1e-9)
    for band in found.bands[3:]:
        high = min(band.high, RATE / 2)
        expected = np.sqrt((high - band.low) / (RATE / 2))
        assert abs(band.rms.value - expected) < 4 * band.rms.stderr
    assert has(found.record.warnings, "rate_too_low")


def test_error_of_an_octave_is_its_scatter():
    """White noise 60 times: the deviations over the stated errors scatter by 1, not by the root of a half."""
    rng = np.random.default_rng(8)
    z = []
    for _ in range(60):
        for band in record_spectra(CleanRecord(RATE, rng.standard_normal(N), "a", (), ())).bands[
            5:
        ]:
            expected = np.sqrt((min(band.high, RATE / 2) - band.low) / (RATE / 2))
            z.append((band.rms.value - expected) / band.rms.stderr)
    assert np.std(z) == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * len(z)))


@pytest.mark.parametrize(
    ("heads", "values", "says"),
    [
        ("t (s),a (g)", np.clip(SHAKING, -0.8, 0.8), "FILE 'a.csv' must not be clipped, but "),
        (
            "t (s),a (kg)",
            SHAKING,
            "FILE 'a.csv' column 'a' must have a unit such as g, mg or m/s^2",
        ),
        (
            "t (s),a",
            SHAKING,
            "must have a unit such as g, mg or m/s^2 behind its name, but has none: give --unit g",
        ),
        ("t (s),a (g)", 0 * SHAKING, "FILE 'a.csv' must have accelerations that change"),
    ],
)
def test_what_is_refused(harvester, tmp_path, heads, values, says):
    status, out, err = harvester(
        "record", written(tmp_path / "a.csv", heads, T, values), "--out", tmp_path / "c.csv"
    )
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not (tmp_path / "c.csv").exists()


def test_files_that_are_none(harvester, tmp_path):
    path = written(tmp_path / "a.csv", "t (s),a (g)", T[::-1], SHAKING)
    assert "must have ascending times, but row 2 does not" in harvester("record", path)[2]
    assert (
        "--out must be another file than the record itself"
        in harvester("record", path, "--out", path)[2]
    )
    (tmp_path / "a.csv").write_text("")
    assert "must have rows of numbers below the names" in harvester("record", path)[2]
    with pytest.raises(hv.InputError, match=r"harvester record .*b\.csv --axis x --out clean\.csv"):
        read_record(str(written(tmp_path / "b.csv", "t (s),x (g),y (g)", T, SHAKING, SHAKING)))


@pytest.mark.parametrize("n", [1000, 1001])
def test_octaves_have_all_the_power(harvester, tmp_path, n):
    """Parseval, at even and odd numbers of samples: the line at half the rate counts once, and no line is left out."""
    t = np.arange(n) / RATE
    values = SHAKING[:n] + 0.2 * np.cos(np.pi * np.arange(n)) * (t < 1.0)
    path = written(tmp_path / "a.csv", "t [s],a [g]", t, values)
    answer = json.loads(harvester("record", path, "--json")[1])
    assert answer["rms"] == pytest.approx(
        sum(band["rms"] ** 2 for band in answer["bands"]) ** 0.5, rel=1e-9
    )


def test_what_a_mass_could_take_of_a_record_before_there_is_a_device():
    """A tone a sin(w t) has the mean jerk 2 w a/pi; no device between stops draws more, and a bound needs both."""
    a = 2.0
    w = 2.0 * np.pi * 25.0
    t = np.arange(1000) / 500.0
    tone = CleanRecord(500.0, a * np.sin(w * t), "a", (), ())
    found = record_spectra(tone, 0.01, 2e-3)
    assert found.possible == pytest.approx(0.01 * 2e-3 * 2.0 * w * a / np.pi, rel=1e-3)
    assert "no device of that mass and stroke absorbs more than 4 mW" in str(found)
    assert (
        found.as_json()["possible_power"] == found.possible
        and record_spectra(tone).possible is None
    )
    with pytest.raises(hv.InputError, match="`mass` and `stroke` must be given together"):
        record_spectra(tone, 0.01)
    with pytest.raises(hv.InputError, match="`stroke` must be above 0"):
        record_spectra(tone, 0.01, -1e-3)


@pytest.mark.parametrize(
    ("unit", "likely"), [("g", "m/s^2"), ("mg", "m/s^2"), ("m/s^2", ""), ("cm/s^2", "m/s^2")]
)
def test_a_given_unit_is_compared_with_gravity(harvester, tmp_path, unit, likely):
    """A column in m/s^2 without a unit, read as g, was 9.8 times too large without a warning."""
    path = written(tmp_path / "a.csv", "time (s),z", T, 9.81 + SHAKING)
    answer = json.loads(harvester("record", path, "--unit", unit, "--json")[1])
    said = [line for line in answer["warnings"] if "gravity" in line]
    assert [f"in {likely} and not in {unit}" in line for line in said] == [True] * bool(likely)


@pytest.mark.parametrize(
    ("head", "unit", "rest"), [("z", "0.977 mg", 1024.0), ("z (V)", "10 g", 1.0)]
)
def test_counts_and_volts_are_not_taken_for_gravity_in_another_unit(
    harvester, tmp_path, head, unit, rest
):
    """1024 counts of 0.977 mg are 1 g, but were stated to be in mg, and one volt of 10 g to be in g."""
    path = written(tmp_path / "a.csv", f"time (s),{head}", T, rest * (1.0 + 0.1 * SHAKING))
    answer = json.loads(harvester("record", path, "--unit", unit, "--json")[1])
    assert not [line for line in answer["warnings"] if "gravity" in line]
