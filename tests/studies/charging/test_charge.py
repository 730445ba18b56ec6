"""Charging from empty: the closed form of a bridge, ngspice alone, both engines, and runs that never arrive."""

import csv
import json
import math
import re
import subprocess

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import has
from tests.support.judge import fault
from tests.support.paths import EXAMPLES

BRIDGE = EXAMPLES / "plate_bridge.toml"
G = 9.80665
# Moved far below its resonance, without overshoot: x is a/w0^2, and the weak coupling leaves it
# alone.
STIFF = """
[oscillator]
mass = 1.0
stiffness = 3600.0
damping = 120.0
[piezo]
coupling = 1e-4
capacitance = 50e-9
[excitation]
acceleration_amplitude = 18.0
frequency = 0.5
[load]
netlist = "bridge"
parameters = { R = 1e12, C = 1e-6, N = 0.02, Is = 1e-12 }
"""
RESONANT = """
[oscillator]
mass = 0.04
stiffness = 16.0
damping = 0.16
[piezo]
coupling = 1e-3
capacitance = 50.2e-9
[excitation]
acceleration_amplitude = "0.05 g"
frequency = 3.2
[load]
netlist = "bridge"
parameters = { R = 1e9, C = 1e-6 }
"""
# The whole device as one netlist: force as voltage, velocity as current.
MESH = """whole device
Vbase b0 0 SIN(0 {force!r} 3.2 0 0 90)
Lmass b0 b1 0.04
Rdamping b1 b2 0.16
Cspring b2 b3 0.0625
Etransformer b3 b4 p 0 1e-3
Vspeed b4 0 0
Ftransformer 0 p Vspeed 1e-3
Cp p 0 50.2e-9
{text}
.options method=gear maxord=2 reltol=1e-6
.tran 1m 8 0 1m uic
.control
set nobreak
set width=120
run
print col time v(xload.a,xload.b)
.endc
.end
"""


@pytest.mark.thorough("test_the_compiled_circuit_charges_as_the_ideal_one")
@pytest.mark.ngspice
def test_closed_form_of_a_bridge():
    """Half a period brings the share 2/(1 + C/Cp) of what is left of Voc less two drops, from the first turn on."""
    w = math.pi
    far = 18.0 / abs(3600.0 - w * w + 120.0j * w)
    top = 1e-4 * far / 50e-9 - 2 * 0.02 * 0.02585 * math.log(1e-6 / 1e-12)
    found = hv.charge(hv.loads(STIFF), f"{0.5 * top} V", duration="8 s")
    halves = np.arange(7)
    # just after a turn: no current flows
    reached = np.interp(1.15 + halves, found.t, found.voltage)
    left = (1.0 - 2.0 / (1.0 + 1e-6 / 50e-9)) ** halves
    assert reached == pytest.approx(top - (top - reached[0]) * left, rel=0.01)
    jump = np.interp(0.15, found.t, found.voltage)
    # from rest to the first turn
    assert jump == pytest.approx(top / (1.0 + 1e-6 / 50e-9), rel=0.05)
    assert found.runs == 1
    assert found.time.known_error95 < 0.01 * found.time.value
    energy = 0.5 * 1e-6 * found.target**2
    assert found.levels[-1].energy == pytest.approx(energy)


@pytest.mark.ngspice
def test_a_target_of_a_nondimensional_scene():
    """The last level is the target, in the scene's own unit of voltage."""
    scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.1, D11=0.1, mu=1.0))
    found = hv.charge(scene, 0.5, probe="v(p)", trajectories=2, duration=60.0)
    assert found.levels[-1].voltage == pytest.approx(found.target) == 0.5
    assert found.reached == 1.0
    assert found.time.value < 30.0


@pytest.mark.thorough("test_the_compiled_circuit_charges_as_the_ideal_one")
@pytest.mark.ngspice
def test_ngspice_alone():
    """A resonant device charges its storage capacitor as in one netlist of ngspice with the mass as
    an inductor."""
    scene = hv.loads(RESONANT)
    found = hv.charge(scene, "6 V", duration="8 s")
    text = MESH.format(force=0.04 * G * 0.05, text=Problem(scene).circuit.text)
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"], input=text, capture_output=True, text=True, check=False
    )
    rows = np.array(
        [row.split()[1:3] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)],
        dtype=float,
    )
    t, u = rows.T
    assert np.abs(np.interp(found.t, t, u) - found.voltage).max() < 0.01 * u.max()
    reached = t[np.argmax(u >= 6.0)]
    assert found.time.value == pytest.approx(
        reached, abs=0.005 * reached + found.time.known_error95
    )


@pytest.mark.thorough("test_the_compiled_circuit_charges_as_the_ideal_one")
@pytest.mark.ngspice
def test_engines_agree_under_noise():
    """The mean time by ideal diodes is that by ngspice: z of independent runs, time-step errors added."""
    ideal = hv.charge(BRIDGE, "1 V", trajectories=512)
    spice = hv.charge(BRIDGE, "1 V", engine="spice", trajectories=16, duration="6 s", seed=1)
    assert (ideal.engine, ideal.reached, spice.reached) == ("ideal", 1.0, 1.0)
    bias = ideal.time.bias + spice.time.bias
    apart = max(abs(ideal.time.value - spice.time.value) - bias, 0.0)
    assert apart < 4.0 * math.hypot(ideal.time.stderr, spice.time.stderr)
    assert ideal.low < ideal.time.value < ideal.high
    assert ideal.time.known_error95 < 0.08 * ideal.time.value


@pytest.mark.slow
def test_the_compiled_circuit_charges_as_the_ideal_one():
    """On the same noise the mean time of a bridge of real diodes is that of ideal ones, but for their difference."""
    ideal, compiled = (
        hv.charge(BRIDGE, "1 V", engine=name, trajectories=128) for name in ("ideal", "compiled")
    )
    assert (compiled.engine, compiled.reached) == ("compiled", 1.0)
    assert compiled.time.value == pytest.approx(ideal.time.value, rel=0.01)
    assert compiled.time.unknown == "the difference from ngspice"
    assert compiled.levels[-1].energy == ideal.levels[-1].energy


@pytest.mark.slow
def test_runs_that_never_arrive_are_told(harvester):
    """No mean of those that do: a bound, the share with its interval, and a warning; the JSON is finite."""
    asked = ("charge", BRIDGE, "--to", "3.5V", "--trajectories", "256", "--duration", "2s")
    status, said, _ = harvester(*asked, "--json")
    assert fault(*harvester(*asked, "--json")) == ""
    answer = json.loads(said)
    assert (status, answer["probe"], answer["target"], answer["engine"]) == (
        0,
        "store",
        3.5,
        "ideal",
    )
    low, high = answer["reached_between"]
    assert 0.0 < low < answer["reached"] < high < 1.0
    assert answer["time"]["value"] is None
    assert answer["time"]["high"] is None
    assert 0.0 < answer["time"]["low"] < answer["at_least"]["value"] < 2.0
    assert "do not reach the target within 2 s" in answer["warnings"][0]
    status, said, _ = harvester(
        "charge", BRIDGE, "--to", "90V", "--trajectories", "64", "--duration", "1s"
    )
    lines = [line.split() for line in said.splitlines()]
    assert ["mean", "time", "at", "least", "1", "s"] in lines and [
        "reached",
        "by",
        "0",
        "%",
    ] in lines
    assert ["reached,", "95", "%", "0", "%", "to", "5.601", "%"] in lines


@pytest.mark.slow
def test_files(tmp_path, harvester):
    """The curve rises to the band; at each level the storage capacitor has C U^2/2, and powers
    times times add up to that."""
    words = ("charge", BRIDGE, "--to", "1.5 V", "--trajectories", "256", "--out", tmp_path)
    status, said, wrong = harvester(*words)
    assert (status, wrong) == (0, "")
    assert "written:" in said
    with (tmp_path / "levels.csv").open() as file:
        rows = [
            {name: cell for name, cell in row.items() if not name.endswith("_unknown")}
            for row in csv.DictReader(file)
        ]
    levels = [{name: float(cell or "nan") for name, cell in row.items()} for row in rows]
    assert levels[-1]["energy (J)"] == pytest.approx(0.5e-6 * 1.5**2)
    times = np.diff([0.0, *(row["time (s)"] for row in levels)])
    powers = np.array([row["power (W)"] for row in levels])
    assert (times * powers).sum() == pytest.approx(levels[-1]["energy (J)"], rel=1e-6)
    with (tmp_path / "charge.csv").open() as file:
        curve = [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]
    assert curve[0]["store_mean (V)"] == 0.0
    assert all(
        row["store_low (V)"] <= row["store_mean (V)"] <= row["store_high (V)"] for row in curve
    )
    assert curve[-1]["share_arrived"] == 1.0
    assert (tmp_path / "charge.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "provenance.json").read_text())["chosen_engine"] == "ideal"


@pytest.mark.ngspice
def test_a_record_begins_at_its_beginning(tmp_path, harvester):
    """One shock, then silence: one run, and a probe of any node; the record is not played twice in silence."""
    t = 0.01 * np.arange(200)
    shock = np.where(t < 0.1, 3.0 * np.sin(10.0 * math.pi * t), 0.0)
    rows = "\n".join(f"{a:.2f},{b:.6f}" for a, b in zip(t, shock, strict=True))
    (tmp_path / "shock.csv").write_text(f"time (s),acceleration (g)\n{rows}\n")
    text = RESONANT.replace('acceleration_amplitude = "0.05 g"', 'acceleration_file = "shock.csv"')
    (tmp_path / "shock.toml").write_text(text.replace("frequency = 3.2", ""))
    status, said, _ = harvester(
        "charge", tmp_path / "shock.toml", "--to", "1V", "--duration", "1.9s", "--json"
    )
    answer = json.loads(said)
    assert (status, answer["engine"], answer["runs"], answer["reached"]) == (0, "spice", 1, 1.0)
    assert 0.005 < answer["time"]["value"] < 0.1
    assert answer["time"]["stderr"] is None
    assert answer["time"]["error95"] < 0.1 * answer["time"]["value"]
    words = (
        "charge",
        tmp_path / "shock.toml",
        "--to",
        "0.5V",
        "--probe",
        "v(p)",
        "--duration",
        "3s",
        "--json",
    )
    again = json.loads(harvester(*words)[1])
    assert again["probe"] == "v(p)"
    assert "repeated to fill the run" in " ".join(again["warnings"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "-1V"], "--to must be a voltage (V), such as '3.3 V', above 0, but is '-1V'"),
        (["--to", "5 ohm"], "--to must be a voltage"),
        (
            ["--to", "2V", "--probe", "v(q)"],
            "unknown node of netlist bridge 'q': it must be one of",
        ),
        (["--to", "2V", "--probe", "p(rlaod)"], "did you mean 'rload'?"),
        (["--to", "2V", "--probe", "v(p)", "--engine", "ideal"], "use engine 'spice'"),
        (
            ["--to", "2V", "--probe", "v(p)", "--engine", "compiled"],
            "engine 'compiled' supports only --probe store",
        ),
        (["--to", "2V", "--engine", "averaged"], "it must be one of ideal, compiled, slow, spice"),
        (
            ["--to", "2V", "--anywhere"],
            "--anywhere must be used with a record or a harmonic excitation",
        ),
        (["--to", "2V", "--trajectories", "1"], "--trajectories must be between 2 and"),
        (["--to", "2V", "--duration", "0"], "--duration must be a time (s)"),
        (["--to", "2V", "--dt", "0"], "--dt must be a time (s)"),
        (["--to", "2V", "--dt", "10s"], "--dt must be between"),
    ],
)
def test_refusals(words, said, harvester):
    status, out, err = harvester("charge", BRIDGE, *words)
    assert (status, out) == (2, "")
    assert said in err


def test_a_resistance_has_no_store(harvester):
    status, _, err = harvester("charge", EXAMPLES / "plate.toml", "--to", "1V")
    assert (status, "a resistor alone: set load.netlist, for instance to 'bridge'" in err) == (
        2,
        True,
    )


@pytest.mark.ngspice
@pytest.mark.parametrize(("periods", "repeats"), [(0.7, False), (1.0, False), (1.001, True)])
def test_a_record_repeats_in_a_longer_run_alone(tmp_path, periods, repeats):
    """A run that lasts as long as the record sees each of its shocks once."""
    t = np.arange(0.0, 4.0, 0.02)
    a = 2.0 * np.sin(2.0 * np.pi * 3.2 * t) * np.sin(np.pi * t / 4.0) ** 2
    record = tmp_path / "record.csv"
    rows = "".join(f"{at:.4f},{value:.6f}\n" for at, value in zip(t, a, strict=True))
    record.write_text(f"time (s),acceleration (m/s^2)\n{rows}")
    scene = hv.load(BRIDGE).replace(excitation=hv.Excitation(acceleration_file=str(record)))
    problem = Problem.of(scene)
    period = problem.equations.record.period / problem.units.frequency
    found = hv.charge(scene, "0.5 V", engine="spice", duration=periods * period)
    assert has(found.warnings, "record_repeats") == repeats
