"""`harvester new`: the file says exactly what the flags said, in words that are true."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_lyapunov

import harvester as hv
from harvester.devices.best_load import best_load
from harvester.devices.device import device
from harvester.devices.meaning import engines, meaning, noise_share
from harvester.devices.scene_file import text
from harvester.devices.stop import amplitude, variances
from harvester.equations.problem import Problem
from harvester.equations.scaling import Equations, equations
from harvester.errors import CannotServeError
from tests.support.paths import EXAMPLES
from tests.support.terminal import on_terminal

FLAGS = {
    "mass": "40 g",
    "stiffness": "16 N/m",
    "damping_ratio": "0.004",
    "coupling": "1e-3 N/V",
    "capacitance": "50.2 nF",
}
NOISE = {"acceleration_psd": "1e-5 g^2/Hz"}


def options(flags):
    return [part for name, value in flags.items() for part in ("--" + name.replace("_", "-"), value)]


def numbers(unit, prefixes, least=1e-6, most=1e6):
    """Values as people write them, and what they are in SI units by plain arithmetic."""
    return st.tuples(
        st.floats(least, most, allow_subnormal=False).map(lambda x: float(f"{x:.6g}")),
        st.sampled_from(prefixes),
    ).map(lambda pair: (f"{pair[0]!r} {pair[1]}{unit}" if unit else repr(pair[0]), pair[0]))


@settings(max_examples=40, deadline=None)
@given(
    mass=numbers("g", ["", "m", "k"], 0.1, 1e3),
    spring=st.one_of(
        st.tuples(st.just("stiffness"), numbers("N/m", ["", "k"], 1.0, 1e3)),
        st.tuples(st.just("frequency"), numbers("Hz", ["", "k"], 0.1, 1e3)),
    ),
    damping=st.one_of(
        st.tuples(st.just("damping_ratio"), numbers("", [""], 1e-4, 0.9)),
        st.tuples(st.just("q"), numbers("", [""], 1.0, 1e4)),
    ),
    capacitance=numbers("F", ["n", "p", "u"], 0.1, 1e3),
    coupling=numbers("N/V", ["m", "u", ""], 1.0, 100.0),
    ratio=st.one_of(st.none(), st.floats(1.001, 3.0)),
    stop=st.one_of(
        st.none(),
        st.tuples(
            st.sampled_from([0.0, 1.0]) | st.floats(0.01, 0.99), st.one_of(st.none(), numbers("m", ["m", "u", ""]))
        ),
    ),
    shaking=st.one_of(st.none(), numbers("g^2/Hz", [""], 1e-6, 1e-2), st.just("harmonic")),
    resistance=st.one_of(st.none(), numbers("ohm", ["k", "M", ""], 1.0, 1e3)),
    title=st.text(max_size=30),
)
def test_round_trip(mass, spring, damping, capacitance, coupling, ratio, stop, shaking, resistance, title):  # noqa: PLR0912
    """`loads` gives what each flag's text is to the scene's own reader, to the last digit."""
    flags = {"mass": mass[0], spring[0]: spring[1][0], damping[0]: damping[1][0], "capacitance": capacitance[0]}
    read = hv.Scene(
        oscillator=hv.Oscillator(mass=mass[0], stiffness=1.0), piezo=hv.Piezo(coupling=1.0, capacitance=capacitance[0])
    )
    m, cp = read.oscillator.mass, read.piezo.capacitance
    if spring[0] == "stiffness":
        k = hv.Oscillator(mass=1.0, stiffness=spring[1][0]).stiffness
    else:
        f = hv.Excitation(acceleration_amplitude=1.0, frequency=spring[1][0]).frequency
        k = m * (2.0 * math.pi * f) ** 2
    short = math.sqrt(k / m) / (2.0 * math.pi)
    if ratio is None:
        flags["coupling"] = coupling[0]
    else:
        flags["open_circuit_frequency"] = repr(ratio * short)
    if stop is not None:
        flags["restitution"] = repr(stop[0])
        if stop[1] is not None:
            flags["gap"] = stop[1][0]
    if shaking == "harmonic":
        flags |= {"acceleration_amplitude": "0.1 g", "drive_frequency": "7 Hz"}
    elif shaking is not None:
        flags["acceleration_psd"] = shaking[0]
    if resistance is not None:
        flags["resistance"] = resistance[0]
    scene = hv.loads(text(device(flags, title)))
    assert scene.title == title
    assert (scene.oscillator.mass, scene.piezo.capacitance) == (m, cp)
    assert scene.oscillator.stiffness == pytest.approx(k, rel=1e-15, abs=0.0)
    assert scene.oscillator.damping_ratio == (damping[1][1] if damping[0] == "damping_ratio" else 0.5 / damping[1][1])
    if ratio is None:
        assert scene.piezo == hv.Piezo(coupling=coupling[0], capacitance=capacitance[0])
    else:
        beta = scene.piezo.coupling**2 / (scene.oscillator.stiffness * cp)
        assert math.sqrt(1.0 + beta) * short == pytest.approx(ratio * short, rel=1e-12)
    if stop is None:
        assert scene.stop is None
    else:
        gap = None if stop[1] is None else stop[1][0]
        assert scene.stop == hv.Stop(restitution=stop[0], **({} if gap is None else {"gap": gap}))
    if shaking == "harmonic":
        assert scene.excitation == hv.Excitation(acceleration_amplitude="0.1 g", frequency="7 Hz")
    elif shaking is None:
        assert scene.excitation is None
    else:
        assert scene.excitation == hv.Excitation(acceleration_psd=shaking[0])
    assert scene.load == (None if resistance is None else hv.Load(resistance=resistance[0]))


def test_file_is_readable(harvester, tmp_path):
    """A comment a line, values as they were given, what is left out shown as such."""
    path = tmp_path / "a.toml"
    args = options({**FLAGS, **NOISE, "resistance": "1M"})
    status, out, err = harvester("new", path, *args, "--title", "Mine")
    assert (status, err) == (0, "")
    assert out.startswith(f"written: {path}\n")
    lines = path.read_text().splitlines()
    assert [line for line in lines if line and "#" not in line] == ['title = "Mine"']
    assert [line.split(" #")[0].strip() for line in lines if line.startswith(("mass", "capac", "accel", "resis"))] == [
        'mass = "40 g"',
        'capacitance = "50.2 nF"',
        'acceleration_psd = "1e-5 g^2/Hz"',
        'resistance = "1 Mohm"',
    ]
    assert "# [stop]" in path.read_text()
    assert hv.load(path).load.resistance == 1e6


def test_netlist_with_parameters(harvester, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").mkdir()
    (tmp_path / "own.cir").write_text((EXAMPLES.parent / "netlists" / "bridge.cir").read_text())
    for name, file in (("bridge", "a.toml"), ("own.cir", "scenes/b.toml")):
        args = ("--netlist", name, "--parameter", "R=2 Mohm", "--parameter", "C=1e-6")
        status, out, _ = harvester("new", file, *options({**FLAGS, **NOISE}), *args)
        assert status == 0
        assert "harvester optimise" in out
        load = hv.load(file).load
        assert load.parameters == {"R": 2e6, "C": 1e-6}
        assert load.netlist == name or Path(load.netlist).resolve() == tmp_path / "own.cir"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"mass": "40 N"}, "--mass must be a mass (kg), such as '40 g', above 0, but is '40 N'"),
        ({"mass": "-1 g"}, "--mass must be a mass"),
        ({"capacitance": "nan"}, "--capacitance must be a clamped capacitance (F)"),
        ({"damping_ratio": "4 %"}, "--damping-ratio must be a number"),
        ({"stiffness": "-16 N/m"}, "--stiffness must be above 0"),
        ({"restitution": "1.1"}, "--restitution must be a restitution coefficient, such as 0.96, between 0 and 1"),
        ({"gap": "1 mm"}, "--restitution must be given with --gap, but is left out"),
        ({"frequency": "3 Hz"}, "one of --mass, --stiffness and --frequency must be left out, but all three are given"),
        ({"q": "125"}, "one of --damping-ratio, --q must be left out, but both are given"),
        ({"open_circuit_frequency": "5 Hz"}, "one of --coupling, --open-circuit-frequency must be left out"),
        (
            {"coupling": None, "open_circuit_frequency": "3 Hz"},
            "--open-circuit-frequency must be above the resonance in short circuit, 3.183 Hz, but is '3 Hz'",
        ),
        ({"acceleration_amplitude": "1 g"}, "--drive-frequency must be given with --acceleration-amplitude"),
        ({"q": "0", "damping_ratio": None}, "--q must be a quality factor, such as 125, above 0, but is '0'"),
        ({"mass": None}, "these must be given: --frequency or --mass, but are left out"),
        (
            dict.fromkeys(FLAGS),
            "these must be given: --mass or --stiffness, --frequency, --damping-ratio or --q, --capacitance, "
            "--coupling or --open-circuit-frequency, but are left out",
        ),
    ],
)
def test_flags_that_cannot_be(harvester, tmp_path, changes, says):
    """One line, exit status 2, and no file; what is missing is named and never asked for in a pipe."""
    flags = {name: value for name, value in {**FLAGS, **changes}.items() if value is not None}
    status, out, err = harvester("new", tmp_path / "a.toml", *options(flags))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"harvester: {says}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("--netlist", "brige"), "unknown netlist 'brige': did you mean 'bridge'?"),
        (("--netlist", "bridge", "--parameter", "R"), "--parameter must be NAME=VALUE"),
        (("--netlist", "bridge", "--parameter", "R=x"), "--parameter R must be a number or a quantity"),
        (("--netlist", "bridge", "--parameter", "R=1", "--parameter", "R=2"), "--parameter must name each only once"),
        (("--parameter", "R=1"), "--netlist must be given with --parameter"),
        (("--netlist", "bridge", "--resistance", "1 ohm"), "one of --resistance, --netlist must be left out"),
    ],
)
def test_loads_that_cannot_be(harvester, tmp_path, args, says):
    status, _, err = harvester("new", tmp_path / "a.toml", *options(FLAGS), *args)
    assert status == 2
    assert err.startswith(f"harvester: {says}")
    assert list(tmp_path.iterdir()) == []


def test_never_over_a_file_unasked(harvester, tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("mine")
    status, _, err = harvester("new", path, *options(FLAGS))
    assert (status, path.read_text()) == (2, "mine")
    assert "or --force" in err
    assert harvester("new", path, *options({**FLAGS, "mass": "x"}), "--force")[0] == 2
    assert path.read_text() == "mine"  # whole or not at all
    assert harvester("new", path, *options(FLAGS), "--force")[0] == 0
    assert hv.load(path).oscillator.mass == 0.04
    assert harvester("new", tmp_path, *options(FLAGS), "--force")[0] == 2
    assert "FILE must be in a folder that is there" in harvester("new", tmp_path / "no" / "a.toml", *options(FLAGS))[2]


def test_questions_on_a_terminal(tmp_path):
    """Real keys on a real terminal: an answer that cannot be is asked for again, an empty one goes on to the next."""
    answers = [
        "40 kN",
        "40 g",
        "",
        "16 N/m",
        "",
        "125",
        "50.2 nF",
        "",
        "4.8 Hz",
        ".96",
        "",
        "1e-5 g^2/Hz",
        "1 Mohm",
        "T",
    ]
    status, screen = on_terminal("new", "a.toml", answers=answers, cwd=tmp_path)
    assert status == 0, screen
    assert "--mass must be a mass (kg), such as '40 g', above 0, but is '40 kN'" in screen
    assert "coupling: strong" in screen
    scene = hv.load(tmp_path / "a.toml")
    assert (scene.title, scene.oscillator.mass, scene.oscillator.stiffness) == ("T", 0.04, 16.0)
    assert scene.oscillator.damping_ratio == 0.004
    assert scene.stop == hv.Stop(restitution=0.96)
    assert scene.load == hv.Load(resistance=1e6)
    assert equations(scene).beta == pytest.approx((4.8 / math.sqrt(16 / 0.04) * 2 * math.pi) ** 2 - 1)


def test_json(harvester, tmp_path):
    status, out, _ = harvester(
        "new", tmp_path / "a.toml", *options({**FLAGS, **NOISE, "resistance": "1 Mohm"}), "--json"
    )
    told = json.loads(out)
    scene = hv.load(tmp_path / "a.toml")
    assert status == 0
    assert told["scene"] == json.loads(json.dumps(scene.tables()))
    eqs = equations(scene)
    assert told["numbers"]["beta"] == eqs.beta
    assert told["numbers"]["mu"] == eqs.mu
    assert told["numbers"]["Q"] == pytest.approx(125.0)
    assert told["figure_of_merit"] == pytest.approx(eqs.beta * 125.0)
    assert told["coupling"] == "strong"
    assert told["engines"] == ["published", "averaged", "ensemble", "spice"]


def scene_of(flags):
    return hv.loads(text(device(flags)))


@pytest.mark.parametrize(("coupling", "how"), [("1e-3 N/V", "strong"), ("1e-4 N/V", "medium"), ("3e-5 N/V", "weak")])
def test_coupling(coupling, how):
    """From `strong_from` on a resistor takes (M a)^2/(8 c) on a harmonic base at its best frequency, and not before."""
    found = meaning(scene_of({**FLAGS, "coupling": coupling}), "a.toml").facts
    assert found["coupling"] == how
    c = 0.008
    for beta, reached in ((0.98 * found["strong_from"] * c, False), (1.02 * found["strong_from"] * c, True)):
        w = np.linspace(0.99, 1.2, 4001)[:, None]
        mu = np.geomspace(0.05, 20.0, 801)[None, :]
        velocity = 1.0 / np.abs((1.0 - w * w) / (1j * w) + c + beta / (mu + 1j * w))
        power = 0.5 * beta * mu / (mu * mu + w * w) * velocity**2
        assert (power.max() * 8.0 * c > 0.99999) == reached


@pytest.mark.parametrize("stop", [{}, {"restitution": "0.9"}])
def test_best_load(stop):
    """The scan finds the peak that a fine one finds; without a stop it is the exact mu = sqrt(1 + beta)."""
    scene = scene_of({**FLAGS, **NOISE, **stop, "resistance": "1 Mohm"})
    found = best_load(scene, 1e6)
    fine = {r: hv.Averaged().run(scene.with_load(r)).mean_power.value for r in np.geomspace(2e5, 2e6, 60)}
    assert found.power.value >= max(fine.values()) * (1.0 - 1e-6)
    for edge in (found.low, found.high):
        share = hv.Averaged().run(scene.with_load(edge)).mean_power.value / found.power.value
        assert share == pytest.approx(0.95, abs=0.005)
    if not stop:
        exact = 1.0 / (math.sqrt(1.0 + equations(scene).beta) * scene.piezo.capacitance * 20.0)
        assert found.resistance == pytest.approx(exact, rel=0.02)
    share = meaning(scene, "a.toml").facts["best_load"]["share"]
    assert share == pytest.approx(hv.Averaged().run(scene).mean_power.value / found.power.value)


def test_share_of_white_noise():
    """The most that beta mu S/N1 is over all loads."""
    for beta, c in ((1.25, 0.008), (0.01, 0.1)):
        mu = np.geomspace(0.01, 100.0, 20001)
        share = beta * mu / (c * (1.0 + beta + mu**2 + c * mu) + beta * mu)
        assert noise_share(beta, c) == pytest.approx(share.max(), rel=1e-6)


def test_stop_without_noise_or_with():
    """Variances by the Lyapunov equation; the drive's amplitude by the linear system."""
    eqs = Equations(beta=0.7, mu=0.6, c1=-0.1, n1=0.3, drive=2.0, drive_frequency=1.3)
    a = np.array([[0.0, 1.0, 0.0], [-1.0, eqs.c1, -eqs.beta], [0.0, 1.0, -eqs.mu]])
    covariance = solve_continuous_lyapunov(a, -np.diag([0.0, 2.0 * eqs.n1, 0.0]))
    assert variances(eqs) == pytest.approx((covariance[0, 0], covariance[1, 1]))
    x = np.linalg.solve(1.3j * np.eye(3) - a, np.array([0.0, eqs.drive, 0.0]))
    assert amplitude(eqs) == pytest.approx(abs(x[0]))


@pytest.mark.parametrize(("gap", "often"), [("0.1 mm", "often"), ("0.5 mm", "at times"), ("3 mm", "seldom or never")])
def test_rate_of_a_distant_stop(gap, often):
    """Rice's rate of a linear mass, counted on one path."""
    flags = {**FLAGS, **NOISE, "restitution": "1", "gap": gap, "resistance": "1 Mohm"}
    scene = scene_of(flags)
    found = meaning(scene, "a.toml").facts
    assert found["stop"] == often
    if often == "often":
        path = hv.motion(scene.without_stop(), duration=300.0)
        x = path.x[path.t > 20.0]
        passed = np.count_nonzero((x[1:] < -1e-4) & (x[:-1] >= -1e-4)) / (path.t[-1] - 20.0)
        assert passed == pytest.approx(found["stop_hits_a_second"], rel=0.1)


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("plate*.toml")), ids=lambda path: path.stem)
def test_engines_that_serve(example):
    """Those that are named do not refuse; those that are not do."""
    scene = hv.load(example)
    if scene.excitation.acceleration_file or scene.excitation.filtered:
        return
    named = engines(Problem(scene))
    for name in ("published", "averaged", "ideal"):
        kind = getattr(hv, name.capitalize())
        try:
            kind(trajectories=64, duration=1.0).run(scene) if name == "ideal" else kind().run(scene)
        except CannotServeError:
            assert name not in named
        else:
            assert name in named


def test_what_to_type_next():
    """It starts with what is missing."""
    assert meaning(scene_of(FLAGS), "a.toml").commands[0].startswith("harvester keys excitation")
    assert meaning(scene_of(FLAGS | NOISE), "a.toml").commands[0].startswith("harvester optimise a.toml --over load.")
    far = scene_of({**FLAGS, **NOISE, "resistance": "10 kohm"})
    assert [line.split()[1] for line in meaning(far, "a.toml").commands] == ["run", "optimise"]
    near = scene_of({**FLAGS, **NOISE, "resistance": "700 kohm"})
    assert [line.split()[1] for line in meaning(near, "a.toml").commands] == ["run", "sweep"]
