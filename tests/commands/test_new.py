"""`harvester new`: the file, the errors, the questions and the next command."""

import json
import math
from pathlib import Path

import pytest

import harvester as hv
from harvester.commands.new import next_lines
from harvester.devices.interpretation import meaning
from tests.support.datasheet import NOISE, SHEET, problem_of
from tests.support.paths import EXAMPLES
from tests.support.terminal import on_terminal
from tests.support.to_scene import equations


def options(sheet):
    """The options that state what a datasheet states."""
    return [
        part for name, value in sheet.items() for part in ("--" + name.replace("_", "-"), value)
    ]


def test_file_is_readable(harvester, tmp_path):
    """A comment a line, values as they were given, what is left out shown as such."""
    path = tmp_path / "a.toml"
    args = options({**SHEET, **NOISE, "resistance": "1M"})
    status, out, err = harvester("new", path, *args, "--title", "Mine")
    assert (status, err) == (0, "")
    assert out.startswith(f"written: {path}\n")
    lines = path.read_text().splitlines()
    assert [line for line in lines if line and "#" not in line] == ['title = "Mine"']
    assert [
        line.split(" #")[0].strip()
        for line in lines
        if line.startswith(("mass", "capac", "accel", "resis"))
    ] == [
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
        status, out, _ = harvester("new", file, *options({**SHEET, **NOISE}), *args)
        assert status == 0
        assert "harvester optimise" in out
        load = hv.load(file).load
        assert load.parameters == {"R": 2e6, "C": 1e-6}
        # a copy
        assert load.netlist == name or Path(load.netlist) == tmp_path / "scenes" / "own.cir"
    again = ("new", file, *options({**SHEET, **NOISE}), *args, "--force")
    assert harvester(*again)[0] == 0
    (tmp_path / "scenes" / "own.cir").write_text("mine")
    (tmp_path / "scenes" / "b.toml").unlink()
    _, _, err = harvester(*again[:-1])
    assert err.endswith("/scenes/own.cir', which must be new, but is there: or --force\n")
    (tmp_path / "own.cir").write_text(".include parts.lib\n")
    (tmp_path / "parts.lib").write_text(".param R=1\n")
    assert (
        "must be in the folder of FILE with all that it includes, but is '../own.cir'"
        in harvester(*again)[2]
    )


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"mass": "40 N"}, "--mass must be a mass (kg), such as '40 g', above 0, but is '40 N'"),
        ({"mass": "-1 g"}, "--mass must be a mass"),
        ({"capacitance": "nan"}, "--capacitance must be a clamped capacitance (F)"),
        ({"damping_ratio": "4 kg"}, "--damping-ratio must be a number"),
        ({"stiffness": "-16 N/m"}, "--stiffness must be above 0"),
        (
            {"restitution": "1.1"},
            "--restitution must be a restitution coefficient, such as 0.96, between 0 and 1",
        ),
        ({"gap": "1 mm"}, "--restitution must be given with --gap, but is left out"),
        (
            {"frequency": "3 Hz"},
            "one of --mass, --stiffness and --frequency must be left out, but all three are given",
        ),
        ({"q": "125"}, "one of --damping-ratio, --q must be left out, but both are given"),
        (
            {"open_circuit_frequency": "5 Hz"},
            "one of --coupling, --open-circuit-frequency must be left out",
        ),
        (
            {"coupling": None, "open_circuit_frequency": "3 Hz"},
            "--open-circuit-frequency must be above the resonance in short circuit, 3.183 Hz, but is '3 Hz'",
        ),
        (
            {"acceleration_amplitude": "1 g"},
            "--drive-frequency must be given with --acceleration-amplitude",
        ),
        (
            {"q": "0", "damping_ratio": None},
            "--q must be a quality factor, such as 125, above 0, but is '0'",
        ),
        ({"mass": None}, "these must be given: --frequency or --mass, but are left out"),
        (
            dict.fromkeys(SHEET),
            "these must be given: --mass or --stiffness, --frequency, --damping-ratio or --q, --capacitance, "
            "--coupling or --open-circuit-frequency, but are left out",
        ),
    ],
)
def test_flags_that_cannot_be(harvester, tmp_path, changes, says):
    """One line, exit status 2, and no file; missing options are named and never asked for in a pipe."""
    flags = {name: value for name, value in {**SHEET, **changes}.items() if value is not None}
    status, out, err = harvester("new", tmp_path / "a.toml", *options(flags))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"harvester: {says}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("--netlist", "brige"), "unknown netlist 'brige': did you mean 'bridge'?"),
        (("--netlist", "bridge", "--parameter", "R"), "--parameter must be NAME=VALUE"),
        (
            ("--netlist", "bridge", "--parameter", "R=x"),
            "--parameter R must be a number or a quantity",
        ),
        (
            ("--netlist", "bridge", "--parameter", "R=1", "--parameter", "R=2"),
            "--parameter must name each only once",
        ),
        (("--parameter", "R=1"), "--netlist must be given with --parameter"),
        (
            ("--netlist", "bridge", "--resistance", "1 ohm"),
            "one of --resistance, --netlist must be left out",
        ),
    ],
)
def test_loads_that_cannot_be(harvester, tmp_path, args, says):
    status, _, err = harvester("new", tmp_path / "a.toml", *options(SHEET), *args)
    assert status == 2
    assert err.startswith(f"harvester: {says}")
    assert list(tmp_path.iterdir()) == []


def test_never_over_a_file_unasked(harvester, tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("mine")
    status, _, err = harvester("new", path, *options(SHEET))
    assert (status, path.read_text()) == (2, "mine")
    assert "or --force" in err
    assert harvester("new", path, *options({**SHEET, "mass": "x"}), "--force")[0] == 2
    assert path.read_text() == "mine"  # whole or not at all
    assert harvester("new", path, *options(SHEET), "--force")[0] == 0
    assert hv.load(path).oscillator.mass == 0.04
    assert harvester("new", tmp_path, *options(SHEET), "--force")[0] == 2
    assert (
        "FILE must be in a folder that can be written"
        in harvester("new", path / "a.toml", *options(SHEET))[2]
    )


@pytest.mark.thorough("nothing: keys are pressed on a terminal")
@pytest.mark.slow
def test_questions_on_a_terminal(tmp_path):
    """Real keys on a real terminal: an answer that cannot be is asked for again, an empty one leads to the next."""
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
    assert equations(scene).beta == pytest.approx(
        (4.8 / math.sqrt(16 / 0.04) * 2 * math.pi) ** 2 - 1
    )


def test_json(harvester, tmp_path):
    status, out, _ = harvester(
        "new", tmp_path / "a.toml", *options({**SHEET, **NOISE, "resistance": "1 Mohm"}), "--json"
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
    assert told["engines"] == ["exact", "published", "averaged", "density", "ensemble", "spice"]


def next_words(sheet):
    """The commands that `harvester new` proposes for a datasheet, without the word harvester."""
    problem = problem_of(sheet)
    return [
        line.removeprefix("harvester ")
        for line in next_lines(problem, "a.toml", meaning(problem).facts)
    ]


def test_what_to_type_next():
    """It starts with the missing parts."""
    assert next_words(SHEET)[0].startswith("keys excitation")
    assert next_words(SHEET | NOISE)[0].startswith("optimise a.toml --vary load.")
    far, near = ({**SHEET, **NOISE, "resistance": load} for load in ("10 kohm", "700 kohm"))
    assert [line.split()[0] for line in next_words(far)] == ["run", "optimise"]
    assert [line.split()[0] for line in next_words(near)] == ["run", "sweep"]


def test_the_proposed_sweep_has_drive_and_resonance():
    """The resonance is at 3.183 Hz; the step between two frequencies stays about the same."""
    steps = []
    for frequency in (3.2, 10.0, 0.5):
        sheet = {
            **SHEET,
            "acceleration_amplitude": "0.5 g",
            "drive_frequency": f"{frequency} Hz",
            "resistance": "1M",
        }
        low, high, count = next_words(sheet)[1].split()[3].replace("Hz", "").split(":")
        assert float(low) < min(3.18, frequency)
        assert float(high) > max(5.0, frequency)
        steps.append((float(high) - float(low)) / (int(count) - 1))
    assert steps == pytest.approx([steps[0]] * 3, rel=0.05)


def test_the_peak_over_a_lifetime_is_named_where_it_can_be_had(harvester, tmp_path):
    """`run --lifetime` refuses a harmonic drive."""
    beam = [
        "--bimorph",
        "--length",
        "50.8mm",
        "--width",
        "31.8mm",
        "--substrate-thickness",
        "0.14mm",
    ]
    beam += [
        "--piezo-thickness",
        "0.26mm",
        "--tip-mass",
        "12g",
        "--piezo",
        "PZT-5A",
        "--substrate",
        "brass",
    ]
    beam += ["--damping-ratio", "1.5%", "--resistance", "100k"]
    noise = ["--acceleration-psd", "1e-4 g^2/Hz"]
    drive = ["--acceleration-amplitude", "0.5g", "--drive-frequency", "50Hz"]
    for shaking, named in ((noise, True), (drive, False)):
        status, out, _ = harvester("new", tmp_path / f"{named}.toml", *beam, *shaking)
        assert status == 0
        assert ("--lifetime" in out) == named


@pytest.mark.parametrize(
    ("lengths", "says"),
    [
        (
            ("60", "15mm", "0.15mm"),
            "--length must be at most 10 m, but is 60 m: a number without a unit is in m",
        ),
        (
            ("60mm", "15mm", "0.15"),
            "--substrate-thickness must be less than the length of 0.06 m, but is 0.15 m",
        ),
    ],
)
def test_millimetres_without_their_unit(harvester, tmp_path, lengths, says):
    names = ("--length", "--width", "--substrate-thickness")
    sizes = [part for pair in zip(names, lengths, strict=True) for part in pair]
    beam = [
        "--bimorph",
        *sizes,
        "--piezo-thickness",
        "0.26mm",
        "--piezo",
        "PZT-5A",
        "--substrate",
        "brass",
    ]
    status, _, err = harvester("new", tmp_path / "a.toml", *beam, "--q", "50")
    assert status == 2
    assert says in err
