"""The exported part in `ngspice -b` moves as the scene does in our engines."""

import itertools
import re
import subprocess

import numpy as np
import pytest

import harvester as hv
from harvester.devices.export import export, part
from harvester.equations.problem import Problem
from harvester.errors import InputError
from tests.support.paths import EXAMPLES
from tests.support.systems import BEAM, SECOND, THIRD

DEVICE = """
[oscillator]
mass = 0.04
stiffness = 16.0
damping = 0.16
{more}
[piezo]
coupling = 1e-3
capacitance = 50.2e-9
{stop}
[excitation]
{shaking}
[load]
resistance = "1 Mohm"
"""
HARMONIC = 'acceleration_amplitude = "0.05 g"\nfrequency = 3.2'


def scene(more="", stop="", shaking=HARMONIC):
    return hv.loads(DEVICE.format(more=more, stop=stop, shaking=shaking))


def bench(one, end, step):
    """Time, voltage on 1 Mohm and displacement, shape (n, 3), of the part in its own source."""
    text = part(Problem.of(one), "device")
    options = re.search(r"^\*   (\.options .*)$", text, re.MULTILINE)[1]
    lines = [
        "bench",
        text,
        "Xbase acc device_base",
        "Xdevice p 0 acc x device",
        "Rload p 0 1Meg",
        options,
    ]
    lines += [f".tran {step} {end} 0 {step} uic", ".control", "set nobreak", "set width=120", "run"]
    lines += ["linearize v(p) v(x)", "print col time v(p) v(x)", ".endc", ".end"]
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    rows = [row.split()[1:] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)]
    return np.array(rows, dtype=float)


def apart(one, end, step, dt="0.5 ms"):
    """The relative RMS difference of the voltage from that of engine `spice`, and of its mean square."""
    ours = hv.charge(one, "1000 V", probe="v(p)", duration=end, dt=dt)
    found = bench(one, end, step)
    theirs = np.interp(ours.t, found[:, 0], found[:, 1])
    mean = np.mean(theirs**2)
    difference = np.mean((theirs - ours.voltage) ** 2)
    return np.sqrt(difference / mean), abs(np.mean(ours.voltage**2) / mean - 1.0)


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "more",
    [
        pytest.param("", id="linear", marks=pytest.mark.thorough("test_with_a_stop")),
        pytest.param(
            "quadratic_stiffness = 2e3\ncubic_stiffness = 1e6\ndamping_x2 = 1e3\ndamping_x4 = 1e8",
            id="not linear",
            marks=pytest.mark.thorough("test_with_a_stop"),
        ),
    ],
)
def test_without_a_stop(more):
    """From rest to the response, which grows within half a second: within 0.1 %."""
    assert max(apart(scene(more), 2.0, 1e-3)) < 1e-3


@pytest.mark.ngspice
def test_the_bench_is_right_to_a_thousandth():
    """With the step that the file prints: E[V^2] of the response to a sinusoid, which was up to 0.5 % off."""
    one = scene(shaking='acceleration_amplitude = "0.05 g"\nfrequency = 4.1')
    step = float(re.search(r"\.tran (\S+)", part(Problem.of(one), "device"))[1])
    true = hv.Exact().run(one)
    t, v, _ = bench(one, 40.0, step).T
    even = 40.0 - 60.0 / 4.1 * np.linspace(1.0, 0.0, 8001)[:-1]
    found = np.mean(np.interp(even, t, v) ** 2)
    assert found == pytest.approx(true.mean_square_voltage.value, rel=1e-3)


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "stop",
    [
        pytest.param(
            '[stop]\nrestitution = 0.96\ngap = "1 mm"',
            marks=pytest.mark.thorough("test_with_a_stop"),
        ),
        pytest.param(
            '[stop]\nrestitution = 0.3\ngap = "1 mm"\n[opposite_stop]\nrestitution = 0.5\ngap = "0.9 mm"',
            marks=pytest.mark.thorough("test_with_a_stop"),
        ),
        '[stop]\nstiffness = 1e4\ndamping = 2.0\ngap = "1 mm"',
    ],
    ids=["elastic", "both sides", "compliant"],
)
def test_with_a_stop(stop):
    """The whole path, impacts included, within 2 %."""
    assert max(apart(scene(stop=stop), 2.0, 5e-5)) < 0.02


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "stop, within",
    [
        pytest.param({}, 1e-4, marks=pytest.mark.thorough("test_with_a_stop")),
        pytest.param(
            {"stop": hv.Stop(stiffness="2e4 N/m", damping="5 N s/m", gap="0.05 mm")},
            1e-3,
            marks=pytest.mark.thorough("test_with_a_stop"),
        ),
        pytest.param(
            {"stop": hv.Stop(restitution=0.5, gap="0.05 mm")},
            0.01,
            marks=pytest.mark.thorough("test_with_a_stop"),
        ),
    ],
    ids=["linear", "compliant", "rigid"],
)
def test_several_modes(stop, within):
    """Three modes, a branch each, under a sinusoid from rest: the path of engine `spice`, impacts included."""
    drive = hv.Excitation(acceleration_amplitude="0.5 g", frequency="45 Hz")
    three = BEAM.replace(mode=(SECOND, THIRD), excitation=drive, **stop).with_load(
        resistance="1 Mohm"
    )
    assert max(apart(three, 0.1, 2e-6 if within == 0.01 else 5e-6, "5 us")) < within


@pytest.mark.slow
def test_noise_reaches_the_highest_mode():
    """A part of three modes has points of noise for its highest, and as few periods as a file may hold."""
    three = BEAM.replace(mode=(SECOND, THIRD))
    steps = [
        float(re.search(r"TRNOISE\(\S+ (\S+)", part(Problem.of(one), "device"))[1])
        for one in (three, BEAM.replace(mode=()))
    ]
    assert steps[0] == pytest.approx(1.0 / (64.0 * 880.0), rel=0.05)
    assert steps[1] == pytest.approx(1.0 / (64.0 * 50.0), rel=0.05)
    coloured = three.replace(excitation=BEAM.excitation.replace(correlation_time="1 ms"))
    assert part(Problem.of(coloured), "device").count("+ ") > 1000


@pytest.mark.ngspice
def test_record(tmp_path):
    """Played from its beginning: within 0.5 %."""
    text = (EXAMPLES / "plate_recorded.toml").read_text()
    (tmp_path / "shake.csv").write_bytes((EXAMPLES / "shake.csv").read_bytes())
    (tmp_path / "one.toml").write_text(text)
    one = hv.load(tmp_path / "one.toml")
    assert one.load.resistance == 1e6
    assert max(apart(one, 4.0, 1e-3)) < 5e-3


@pytest.mark.thorough("test_with_a_stop")
@pytest.mark.ngspice
def test_white_noise_has_its_density():
    """The mean square of the voltage is the closed form's: z of means over blocks of 2 s, which is 8 relaxation times.

    ngspice 39 draws TRNOISE anew in each run, whatever `setseed` or `rndseed` is: with no seed to choose, chance must
    not fail the test.  Among 79 blocks, |z| > 5 once in 300,000 runs.
    """
    one = scene(shaking='acceleration_psd = "1e-4 g^2/Hz"')
    found = bench(one, 160.0, 1e-2)
    blocks = (found[len(found) % 80 :, 1] ** 2).reshape(80, -1).mean(axis=1)[1:]
    exact = hv.run(one, "exact").mean_square_voltage.value
    z = (blocks.mean() - exact) / (blocks.std(ddof=1) / np.sqrt(len(blocks)))
    assert abs(z) < 5.0
    assert blocks.mean() == pytest.approx(exact, rel=0.5)


def test_each_number_is_explained():
    """A comment above each element but those that only measure; nothing that LTspice reads otherwise."""
    text = part(
        Problem.of(scene("cubic_stiffness = 1e6", '[stop]\nrestitution = 0.9\ngap = "1 mm"')),
        "device",
    )
    lines = text.splitlines()
    body = lines[lines.index(".subckt device p n acc x") + 1 : lines.index(".ends device")]
    known = ("Edisplacement", "Hspeed", "Cmass", "Vforce", "Hmass", "Vspeed", "Fpiezo", "Cpiezo")
    for before, line in itertools.pairwise(body):
        assert line.startswith(("*", *known)) or before.startswith("*"), line
    assert "^" not in "".join(line for line in body if not line.startswith("*"))
    assert "**" not in "".join(body)


def test_drawn_noise_is_a_table_of_points():
    """Coloured noise is written point by point, as long as asked for, the same for the same seed."""
    problem = Problem.of(
        scene(shaking='acceleration_psd = "1e-4 g^2/Hz"\ncorrelation_time = "50 ms"')
    )
    short, again, other = (part(problem, "device", "10 s", seed) for seed in (0, 0, 1))
    assert short == again != other
    numbers = [
        float(one)
        for line in short.splitlines()
        if re.match(r"\+ \d", line)
        for one in line[2:].split()
    ]
    times, values = np.array(numbers).reshape(-1, 2).T
    assert times[-1] == pytest.approx(10.0, rel=0.01)
    assert 0.1 < values.std() / np.sqrt(1e-4 * 9.80665**2 / (4 * 0.05)) < 2.0


def test_command(tmp_path, harvester):
    out = tmp_path / "my device.lib"
    status, said, _ = harvester("export", EXAMPLES / "plate_with_stop.toml", "--out", out)
    assert (status, "subcircuit my_device" in said) == (0, True)
    assert ".subckt my_device p n acc x" in out.read_text()
    (tmp_path / "other.toml").write_text(
        "[nondimensional]\nc1 = -0.1\nbeta = 0.1\nmu = 1.0\nD11 = 0.01\n"
    )
    (tmp_path / "noise.toml").write_text(
        DEVICE.format(more="", stop="", shaking="stiffness_noise = 0.01")
    )
    for words, what in (
        ((tmp_path / "other.toml", "--out", out), "must be a device"),
        ((tmp_path / "noise.toml", "--out", out), "leave excitation.stiffness_noise out"),
        ((EXAMPLES / "plate.toml", "--out", out, "--name", "2 x"), "--name must be letters"),
        ((EXAMPLES / "plate.toml", "--out", "/proc/no/x.lib"), "--out must"),
        (
            (EXAMPLES / "plate.toml", "--out", out, "--duration", "5s"),
            "--duration must be used with noise",
        ),
        (
            (EXAMPLES / "plate_coloured.toml", "--out", out, "--duration", "5 V"),
            "--duration must be a time",
        ),
    ):
        status, _, wrong = harvester("export", *words)
        assert (status, what in wrong) == (2, True), wrong


def test_the_file_is_neither_a_folder_nor_the_scene(tmp_path):
    """If it would be no file, or replace what it is made of, nothing is written."""
    whole = tmp_path / "mine.toml"
    whole.write_text((EXAMPLES / "plate.toml").read_text())
    before = whole.read_text()
    for out, word in (
        (".", "be a file"),
        (tmp_path, "be a file"),
        (whole, "another file than the scene"),
    ):
        with pytest.raises(InputError, match=word):
            export(whole, out, name="device")
    assert whole.read_text() == before


def test_after_its_last_point_a_base_stands_still():
    """A source through points keeps its last value, which would push for ever."""
    problem = Problem.of(
        scene(shaking='acceleration_psd = "1e-4 g^2/Hz"\ncorrelation_time = "50 ms"')
    )
    text = part(problem, "device", "1 s", 0)
    points = text[text.index("PWL(") :].split("+ )")[0].replace("+", " ").split()[1:]
    assert float(points[-1]) == 0.0
    assert float(points[-2]) > 1.0
