"""Recorded excitation: reading, repeating and resampling; responses against solve_ivp; noise of a tabulated density."""

import dataclasses
import itertools
import math
import os
import re

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.equations.coefficients import Equations
from harvester.equations.scales import scales
from harvester.errors import CannotServeError, InputError, SimulationError
from harvester.mechanics.ensemble.richardson import RichardsonPair
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.shaking import samples_of
from harvester.mechanics.trace import trace
from harvester.records.record_files import read_density, read_record
from harvester.records.records import BRIDGE, SPAN, Record, TabulatedDensity, bridge
from tests.support.lockstep import device, rms_difference
from tests.support.systems import PAPER, changed, linear_v2, z
from tests.support.to_scene import equations

SEED = np.random.SeedSequence(20261121)
TONES = ((0.5, 0.7, 0.3), (0.3, 1.31, 1.0), (0.2, 3.17, 2.0))


def signal(t):
    """Three tones without a common period."""
    return sum(a * np.cos(w * t + phase) for a, w, phase in TONES)


def written(tmp_path, text, name="shake.csv"):
    (tmp_path / name).write_text(text)
    return str(tmp_path / name)


def table(spacing=0.1, rows=601):
    values = signal(spacing * np.arange(rows))
    return Record(spacing, np.append(values, bridge(values)))


def test_record_is_read_as_it_is(tmp_path):
    text = "# a logger\nacceleration (g),temperature (degC),time (ms)\n"
    values = np.sin(np.arange(40))
    record = read_record(
        written(tmp_path, text + "".join(f"{v},20,{5 * k}\n" for k, v in enumerate(values)))
    )
    assert record.spacing == pytest.approx(5e-3)
    assert record.values[:40] == pytest.approx(9.80665 * values, rel=1e-6)
    assert len(record.values) == 40 + BRIDGE - 1


def test_bridge_is_smooth():
    """The period's end meets its beginning in value and slope."""
    whole = table(0.02, 3001).values
    twice = np.concatenate([whole, whole])
    steps = np.diff(twice)[len(whole) - BRIDGE - 2 : len(whole) + 2]
    assert np.abs(np.diff(steps)).max() < 0.5  # no jump: the ends are 0.6 apart
    assert abs(twice[len(whole) - BRIDGE] - signal(60.0)) < 1e-12


def test_between_samples_it_is_the_signal():
    """Ten samples to the fastest tone's half period: 1e-5 off the ends, at any time."""
    record = table()
    t = np.random.default_rng(1).uniform(5.0, 55.0, 1000)
    assert record.at(t, 0.01) == pytest.approx(signal(t), abs=2e-4)
    assert record.at(t + 3 * record.period, 0.01) == pytest.approx(record.at(t, 0.01), abs=1e-9)
    k = np.arange(100)
    assert record.at(k * 0.1, 0.01) == pytest.approx(record.values[:100], abs=1e-4)


@pytest.mark.parametrize("count", [64, 128, 1000])
def test_nothing_is_folded_back(count):
    """Tones of whole periods: those below half the sampling rate are exact, those above are removed."""
    n = 512
    t = np.arange(n) / n
    record = Record(
        1.0 / n, 1.0 + np.cos(2 * math.pi * 20 * t + 0.4) + np.sin(2 * math.pi * 100 * t)
    )
    s = np.arange(count) / count
    exact = 1.0 + np.cos(2 * math.pi * 20 * s + 0.4) + (count > 200) * np.sin(2 * math.pi * 100 * s)
    assert record.at_even_times(count) == pytest.approx(exact, abs=1e-12)
    assert record.at(s, 1.0 / count) == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize("alpha", [None, 0.3])
def test_path_against_solve_ivp(alpha):
    """x, x' and V of the trace, extrapolated to h = 0, agree to 1e-4 with DOP853 on the signal itself."""
    eqs = Equations(alpha=alpha, beta=0.6, mu=0.4, c1=-0.05, record=table(0.05, 1201))

    def rates(t, y):
        x, v, voltage = y
        force = signal(t) - x - (alpha or 0.0) * x**3 - eqs.beta * voltage
        return v, force + eqs.c1 * v, v - eqs.mu * voltage

    t = np.arange(1, 51)
    exact = solve_ivp(rates, (0, 50), (0, 0, 0), "DOP853", t, rtol=1e-11, atol=1e-12).y
    found = []
    for parts in (40, 80):
        path = trace(eqs, np.zeros(50 * parts), 1.0 / parts, parts)
        found.append(path.samples[:, :2])
    extrapolated = (4 * found[1] - found[0]) / 3
    for k, row in enumerate((0, 2)):
        assert extrapolated[:, k] == pytest.approx(exact[row], abs=1e-4 * np.abs(exact[row]).max())
    errors = [np.abs(one[:, 0] - exact[0]).max() for one in found]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.thorough("test_a_record_begins_at_its_beginning")
@pytest.mark.statistics
def test_ensemble_runs_whole_periods():
    """Linear: E[V^2] from every start is the sum over the lines of the series, and nothing is random."""
    record = table(0.1, 597)
    eqs = Equations(beta=0.6, mu=0.4, c1=-0.2, record=record)
    pair = RichardsonPair(Trajectories(eqs, 64, SEED, 0.02), 100.0)
    exact = linear_v2(eqs)
    assert pair.extrapolated("V2")[0] == pytest.approx(exact, rel=1e-5)
    assert pair.mean("V2")[1] < 1e-6 * exact
    assert pair.trajectories.run(1.0).balance(eqs) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.thorough("test_a_record_begins_at_its_beginning")
@pytest.mark.ngspice
def test_spice_on_the_record():
    eqs = changed(PAPER, n1=None, n2=None, restitution=None, record=table())
    zeros = np.zeros(500)
    ours = worker.path_in_worker(device(eqs, 0.1, 4), zeros)
    exact = trace(eqs, zeros, 0.1, 4)
    assert np.abs(exact.x).max() > 0.3
    assert rms_difference(ours, exact) < 5e-5
    assert rms_difference(ours, exact, "x") < 1e-5


LEVEL = TabulatedDensity(np.array([0.01, 0.1, 0.3, 2.0]), np.array([0.5, 0.5, 2.0, 0.02]))


def power_density(frequency):
    """Straight lines in log-log, written out."""
    for a, b in itertools.pairwise(range(4)):
        f0, f1, g0, g1 = *LEVEL.frequencies[[a, b]], *LEVEL.values[[a, b]]
        if f0 <= frequency <= f1:
            return g0 * (frequency / f0) ** (math.log(g1 / g0) / math.log(f1 / f0))
    return 0.0


def test_density_between_its_points():
    f = np.array([0.005, 0.01, 0.05, 0.2, 1.0, 2.0, 2.1])
    assert LEVEL.below(f) == pytest.approx(
        [quad(power_density, 0.01, one, points=[0.1, 0.3])[0] for one in f.clip(0.01)]
    )


RAMPS = TabulatedDensity(np.array([0.1, 0.2, 0.5, 1.0]), np.array([0.0, 2.0, 2.0, 0.0]))
PEAK = TabulatedDensity(np.array([3.0, 3.1, 3.2]), np.array([0.0, 1e-5, 0.0]))


def test_density_that_begins_and_ends_at_zero():
    """A 0 has no logarithm: next to it the density is a straight line."""
    assert RAMPS.below(np.array([0.05, 0.15, 0.2, 0.5, 0.75, 3.0])) == pytest.approx(
        [0, 0.025, 0.1, 0.7, 1.075, 1.2]
    )
    assert PEAK.rms**2 == pytest.approx(1e-6)
    nothing_between = TabulatedDensity(
        np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 0.0, 0.0, 1.0])
    )
    assert nothing_between.below(np.array([2.0, 3.0, 4.0])) == pytest.approx([0.5, 0.5, 1.0])


@pytest.mark.parametrize(
    "density", [RAMPS, *(pytest.param(one, marks=pytest.mark.slow) for one in (LEVEL, PEAK))]
)
def test_record_of_a_density_has_it(density):
    """Its lines have the density's power half-way to their neighbours, whatever the phases."""
    record = density.record(0.1, np.random.default_rng(1))
    powers = 2.0 * np.abs(np.fft.rfft(record.values) / len(record.values)) ** 2
    edges = (np.arange(len(powers)) + 0.5) / record.period
    assert record.period == pytest.approx(SPAN)
    assert np.cumsum(powers)[:-1] == pytest.approx(
        density.below(edges)[:-1], rel=1e-9, abs=1e-12 * density.rms**2
    )


@pytest.mark.parametrize("centre", [0.9, 1.0, 1.03])
@pytest.mark.parametrize("width, c", [(2e-3, 0.1), (6e-3, 0.004), (0.5, 0.002)])
def test_narrow_bands_and_resonances_are_held(centre, width, c):
    """The record is so long that a linear mass has its variance to 1 %, where 1/`SPAN` is up to half the band."""
    low, high = (centre + end * width for end in (-0.5, 0.5))
    band = TabulatedDensity(np.array([low, high]) / (2.0 * math.pi), np.array([1.0, 1.0]))
    eqs = Equations(c1=-c, density=band)
    drawn = changed(
        eqs, density=None, record=Record(0.1, samples_of(eqs, 0.1, np.random.default_rng(1)))
    )
    assert linear_v2(drawn) == pytest.approx(linear_v2(eqs), rel=0.01)


def test_a_band_too_narrow_for_any_record_is_refused():
    band = TabulatedDensity(np.array([0.16, 0.16 * (1 + 1e-6)]), np.array([1.0, 1.0]))
    with pytest.raises(
        InputError, match=r"^excitation\.acceleration_psd_file must have no band.* `dt`"
    ):
        band.record(0.1, np.random.default_rng(1))


@pytest.mark.thorough("test_places_apart_see_the_whole_record")
@pytest.mark.statistics
@pytest.mark.parametrize("c", [0.1, 0.4])
def test_variance_under_a_tabulated_density(c):
    """E[x^2] = integral of |H|^2 G df, within four standard errors, which do not fall short of the true spread."""
    eqs = Equations(c1=-c, density=LEVEL)
    exact = linear_v2(eqs)  # without a load V = x
    scores = []
    for seed in range(5):
        pair = RichardsonPair(Trajectories(eqs, 1024, np.random.SeedSequence(seed), 0.1), 100.0)
        found = pair.extrapolated("x2")
        assert found[1] < 0.03 * exact
        scores.append(z(found, exact))
    assert np.abs(scores).max() < 4
    assert np.sqrt(np.mean(np.square(scores))) < 1.8


GOOD = "time (s),acceleration (g)\n" + "".join(
    f"{0.01 * k:.2f},{math.sin(k):.3f}\n" for k in range(20)
)


@pytest.mark.parametrize(
    "text, line",
    [
        ("", "must have rows of numbers below"),
        ("root:sesame\n", "must have rows of numbers below the names of its columns (CSV)"),
        ("root:x:0\n1,2\n3,4\n", "must have a column 'time (s)', but has none with a unit"),
        (
            GOOD.replace("acceleration", "speed"),
            "must have a column 'acceleration (m/s^2)', but has",
        ),
        (
            GOOD.replace("(g)", "(kg)"),
            "column 'acceleration' must have a unit such as m/s^2, but is 'kg'",
        ),
        (GOOD.replace("(s)", "(kg)"), "column 'time' must have a unit such as s, but is 'kg'"),
        (
            GOOD.replace("(g)", ""),
            "column 'acceleration' must have a unit, such as 'acceleration (m/s^2)', but has none",
        ),
        (GOOD.replace("time (s)", "no"), "but has 'no,acceleration (g)': 'harvester record "),
        (re.sub(r",(.*)\n", r",\1,\1\n", GOOD), "--axis 'column 2' --out clean.csv' mends"),
        (GOOD.replace("0.05,", "0.02,"), "must have ascending times, but row 6 does not"),
        (GOOD.replace("0.05,", "0.055,"), "must have equal time steps, but row 6 is off"),
        (
            GOOD.replace("0.05,-0.959", "0.05,nan"),
            "column 'acceleration' row 6 must be a number of at most 1e+50 in size, but is 'nan'",
        ),
        (
            GOOD.replace("0.05,-0.959", "0.05"),
            "column 'acceleration' row 6 must be a number of at most 1e+50 in size, but is ''",
        ),
        ("\n".join(GOOD.split("\n")[:10]), "must have at least 16 rows, but is 9"),
        (re.sub(r",-?[0-9.]+\n", ",0\n", GOOD), "must have accelerations other than 0"),
        ("\x00\x01", "must"),
    ],
)
def test_bad_record_is_one_line(tmp_path, text, line):
    with pytest.raises(InputError, match=re.escape(line)) as caught:
        read_record(written(tmp_path, text))
    assert str(caught.value).startswith("excitation.acceleration_file")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "rows", ["", "1,2\n", "2,1\n1,1\n", "0,1\n1,1\n", "1,-1\n2,1\n", "1,0\n2,0\n"]
)
def test_bad_density_is_one_line(tmp_path, rows):
    with pytest.raises(InputError, match=r"^excitation\.acceleration_psd_file must have"):
        read_density(written(tmp_path, "frequency (Hz),psd (g^2/Hz)\n" + rows))


PLATE = """
[oscillator]
mass = 0.04
stiffness = 16.0
damping = 6.4e-3
[piezo]
coupling = 1e-3
capacitance = 50.2e-9
[load]
resistance = 1e6
[excitation]
"""


def plate(folder, line):
    (folder / "scene.toml").write_text(PLATE + line)
    return hv.load(folder / "scene.toml")


def test_file_is_found_beside_the_scene(tmp_path, monkeypatch):
    (tmp_path / "data").mkdir()
    written(tmp_path / "data", GOOD)
    scene = plate(tmp_path, 'acceleration_file = "data/shake.csv"')
    monkeypatch.chdir("/")
    record = equations(scene).record
    s = scales(scene)
    assert record.spacing == pytest.approx(0.01 * 20.0)
    assert record.values[1] == pytest.approx(-9.80665 * 0.841 / (s.length * 400.0))
    assert record.rms == pytest.approx(1.0)
    before = scene.digest
    written(tmp_path / "data", GOOD.replace("0.841", "0.842"))
    assert scene.digest != before
    assert equations(scene).record.values[1] == pytest.approx(
        -9.80665 * 0.842 / (scales(scene).length * 400.0)
    )


@pytest.mark.parametrize(
    "name", ["../shake.csv", "/etc/passwd", "data/../../shake.csv", "a\\u0000b", "loop"]
)
def test_file_outside_the_folder_is_refused(tmp_path, name):
    written(tmp_path, GOOD)
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "loop").symlink_to("loop")
    with pytest.raises(
        InputError, match=r"excitation\.acceleration_file must be in the folder of the scene file"
    ):
        plate(tmp_path / "scenes", f'acceleration_file = "{name}"')


@pytest.mark.parametrize(
    "name, why", [("none.csv", "No such file"), ("pipe", "it is a pipe"), (".", "Is a directory")]
)
def test_what_is_no_file_is_one_line(tmp_path, name, why):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(
        InputError, match=rf"acceleration_file must be a readable file, but .* is not: {why}"
    ):
        equations(plate(tmp_path, f'acceleration_file = "{name}"'))


@pytest.mark.parametrize("key", ["acceleration_file", "acceleration_psd_file"])
def test_theories_refuse(key):
    name = {
        "acceleration_file": "examples/shake.csv",
        "acceleration_psd_file": "examples/shake_psd.csv",
    }[key]
    scene = dataclasses.replace(
        hv.load("examples/plate.toml"), excitation=hv.Excitation(**{key: name})
    )
    for engine in (hv.Published(), hv.Averaged()):
        with pytest.raises(CannotServeError, match="use engine 'ensemble'"):
            engine.run(scene)
    assert hv.Ensemble(trajectories=64).run(scene).mean_power.value > 0.0


@pytest.mark.parametrize(
    "spacing, why",
    [
        (
            1e-12,
            r"repeats after 6\.8e-10/w0, too fast for the mass to follow: a step would be 1\.1e-11/w0$",
        ),
        (1e4, r"would need 1.0e\+08 steps of 0\.067/w0: too slow for the response"),
        (1e6, r"would need 1.0e\+10 steps of 0\.067/w0: too slow for the response"),
        (1e48, r"would need 1.0e\+52 steps of 0\.067/w0: too slow for the response"),
    ],
)
def test_a_record_of_another_time_is_refused(tmp_path, spacing, why):
    """Before anything of its length is made: steps of 1e6 s would take 150 GiB."""
    written(
        tmp_path,
        "time (s),acceleration (g)\n"
        + "".join(f"{spacing * k},{math.sin(k)}\n" for k in range(31)),
    )
    with pytest.raises(SimulationError, match=why):
        hv.Ensemble(budget=1.0).run(plate(tmp_path, 'acceleration_file = "shake.csv"'))


def test_times_that_no_number_holds(tmp_path):
    text = "time (s),acceleration (g)\n" + "".join(
        f"{1e300 * k},{math.sin(k)}\n" for k in range(31)
    )
    line = r"acceleration_file column 'time' row 2 must be a number of at most 1e\+50 in size, but is '1e\+300'$"
    with pytest.raises(InputError, match=line):
        read_record(written(tmp_path, text))


def test_a_density_that_no_step_carries(tmp_path):
    """It would shake nothing, and the balance of power would be nan."""
    written(tmp_path, "frequency (Hz),psd (g^2/Hz)\n1e4,1e-3\n2e4,1e-3\n", "psd.csv")
    line = (
        r"acceleration_psd_file must have densities below .* times w0, which .* but has none there$"
    )
    with pytest.raises(InputError, match=line):
        hv.Ensemble(budget=1.0).run(plate(tmp_path, 'acceleration_psd_file = "psd.csv"'))
