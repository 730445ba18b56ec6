"""`harvester identify`: its intervals hold the truth, it says what the data do not tell, and refuses in one line."""

import json
import os

import numpy as np
import pytest

import harvester as hv
from tests.support.bench import KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_intervals_hold_the_truth(tmp_path, kind):
    """Three devices of each kind, whose measurements come from other equations: benchmarks/identify.py makes 100.

    An interval misses one time in twenty: no error may be beyond twice it, and few beyond it.
    """
    missed, asked = [], 0
    for seed in range(1 if kind in ("bounce", "voltage", "ring_downs") else 2):
        names, truth = KINDS[kind](np.random.default_rng([22, seed]), tmp_path)
        found = hv.identify(names)
        assert found.residual_rms < 0.05
        for key, value in truth.items():
            one = found[key]
            half = 0.5 * (one.high - one.low)
            assert abs(one.value - value) < 2.2 * half, (seed, key)
            missed += [key] * (not one.low <= value <= one.high)
            asked += 1
        if kind == "bounce":
            assert abs(found["stop.restitution"].value - truth["stop.restitution"]) < 0.005
    assert len(missed) <= 0.3 * asked, missed


def test_impedance_alone_gives_no_mass(harvester, tmp_path):
    """It tells theta^2/M: the scene says so and takes a known mass, with which it is whole."""
    (name,), truth = KINDS["impedance"](np.random.default_rng(5), tmp_path)
    status, out, err = harvester("identify", name, "--out", tmp_path / "a.toml")
    assert (status, err) == (0, "")
    assert (
        "not determined: oscillator.mass, oscillator.stiffness, piezo.coupling: these data do not tell the mass" in out
    )
    text = (tmp_path / "a.toml").read_text()
    assert "# mass = ?" in text
    assert "F, 95 %: " in text
    with pytest.raises(hv.InputError, match=r"oscillator\.mass must be given"):
        hv.load(tmp_path / "a.toml")
    args = ("identify", name, "--known", "mass=20 g", "--out", tmp_path / "b.toml", "--json")
    answer = json.loads(harvester(*args)[1])
    assert answer["parameters"]["oscillator.mass"]["value"] == 0.02
    theta = truth["coupling_squared_per_mass"] * 0.02
    assert hv.load(tmp_path / "b.toml").piezo.coupling ** 2 == pytest.approx(theta, rel=0.02)
    assert (tmp_path / "b_fit.png").stat().st_size > 20_000
    assert harvester(*args)[2].endswith("is there: another name, or --force\n")
    assert harvester(*args, "--force")[0] == 0


def test_one_ring_down_is_that_state_alone(tmp_path):
    """Neither coupling nor the mechanical damping is told by a voltage's decay: nothing is said of them."""
    names, truth = KINDS["ring_downs"](np.random.default_rng(3), tmp_path)
    found = hv.identify(names[1])  # open circuit
    expected = truth["short_circuit_frequency"] * np.sqrt(1 + truth["coupling_coefficient"])
    assert found["resonance_frequency"].value == pytest.approx(expected, rel=1e-3)
    assert {key for key, _ in found.missing} >= {"oscillator.mass", "piezo.capacitance"}
    with pytest.raises(hv.InputError, match=r"unknown parameter 'oscillator\.damping_ratio'"):
        _ = found["oscillator.damping_ratio"]
    assert "one ring-down in open circuit" in str(found)


def test_a_clamped_impedance_is_a_capacitance(tmp_path):
    """All that it has, with the loss; `@clamped` behind the name or in a comment."""
    f = np.geomspace(100.0, 1e4, 40)
    noise = 1 + 1e-3 * np.random.default_rng(1).standard_normal((2, 40))
    rows = zip(f, 50e-9 * noise[0], 0.02 * noise[1], strict=True)
    text = "f (Hz),Cp (nF),D\n" + "\n".join(f"{a:.6g},{1e9 * c:.6g},{d:.6g}" for a, c, d in rows)
    (tmp_path / "c.csv").write_text(text)
    (tmp_path / "d.csv").write_text("# clamped\n" + text)
    for name in ("c.csv@clamped", "d.csv"):
        found = hv.identify(str(tmp_path / name))
        assert found["piezo.capacitance"].low < 50e-9 < found["piezo.capacitance"].high
        assert found["dielectric_loss"].value == pytest.approx(0.02, rel=1e-2)
        assert len(found.parameters) == 2


GOOD = "Frequency (Hz),Voltage (V/g)\n" + "".join(f"{f},{1 / (1 + (f - 50) ** 2):.4g}\n" for f in range(40, 60))


@pytest.mark.parametrize(
    ("text", "more", "says"),
    [
        ("", "", "FILE must have rows of numbers below the names of its columns (CSV), but "),
        (
            "a,b\n1,2\n3,4\n",
            "",
            "must hold frequency with |Z| and phase, R and X, or G and B; frequency with a voltage",
        ),
        (GOOD, "", "must say over which load the voltage was measured: write it behind the name, as in 'a.csv@100k'"),
        (GOOD, "@5 kg", "must be a load resistance (ohm), such as '1 Mohm', above 0, but is '5 kg': the unit 'kg' is"),
        (GOOD, "@-1k", "must be a load resistance (ohm)"),
        (GOOD.replace("(Hz)", "(kg)"), "@1k", "must have a unit such as Hz, but is 'kg'"),
        (GOOD.replace("45,", "45,x"), "@1k", "FILE 'a.csv' column 'Voltage' row 6 must be a number, but is 'x0.03846'"),
        ("\n".join(GOOD.split("\n")[:9]), "@1k", "must have at least 12 points with numbers, but is 8"),
        ("time (s),u (V)\n" + "".join(f"{k},1\n" for k in range(30)), "", "must show a ring-down, but its voltage is"),
        ("time (s),u (V)\n" + "".join(f"{-k},{k}\n" for k in range(30)), "", "must have ascending times"),
    ],
)
def test_what_is_no_measurement(harvester, tmp_path, text, more, says):
    """One line, exit status 2, and no file."""
    (tmp_path / "a.csv").write_text(text)
    status, out, err = harvester("identify", f"{tmp_path / 'a.csv'}{more}", "--out", tmp_path / "a.toml")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not (tmp_path / "a.toml").exists()


def test_options_that_cannot_be(harvester, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "is not: it is a pipe or a device" in harvester("identify", tmp_path / "pipe")[2]
    (tmp_path / "a.csv").write_text(GOOD)
    name = f"{tmp_path / 'a.csv'}@10k"
    assert (
        "--known must be KEY=VALUE, such as mass='12 g', but is 'mass'"
        in harvester("identify", name, "--known", "mass")[2]
    )
    assert "unknown key of --known 'gain'" in harvester("identify", name, "--known", "gain=1")[2]
    assert "--out must be a scene file that ends in .toml" in harvester("identify", name, "--out", "a.csv")[2]
