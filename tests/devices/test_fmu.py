"""FMUs of devices in FMPy, without this package: validity, paths, impacts, energies, states, instances, events."""

import math
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import harvester as hv
from harvester.errors import CannotServeError, InputError
from tests.support import fmu
from tests.support.paths import EXAMPLES, ROOT

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

BRIDGE = 'netlist = "bridge"\nparameters = { R = "1.5 Mohm", C = "1 uF" }'
PATH = """
rows = []
for n in (1, 10, 100):
    r = simulate_fmu(fmu, stop_time=2000 * h, step_size=n * h, output_interval=n * h)
    rows.append([float(r[name][-1]) for name in ("displacement", "velocity", "voltage", "input_energy")])
print(json.dumps({"problems": validate_fmu(fmu), "rows": rows}))
"""


@pytest.mark.parametrize("fmi", [2, 3])
def test_valid_and_the_same_path_for_any_communication_step(fmi):
    """FMPy finds no problem, and steps of 1, 10 and 100 inner ones give one path to 1e-12 of its size."""
    found = fmu.run(fmu.built(fmi=fmi), PATH)
    assert found["problems"] == []
    rows = np.array(found["rows"])
    assert np.all(np.abs(rows - rows[0]) <= 1e-12 * np.abs(rows[0])), rows - rows[0]


def test_noise_is_the_same_path_to_the_last_digit():
    """On the grid of steps the path does not depend on the communication step at all."""
    rows = np.array(fmu.run(fmu.built("plate_with_stop.toml"), PATH)["rows"])
    assert np.array_equal(rows, rows[[0, 0, 0]])


def test_impacts_are_those_of_the_exact_flow():
    """Within 1e-9 s over 24 impacts, and their speeds within 1e-9 m/s; later this motion, which is chaotic, differs."""
    found = fmu.run(
        fmu.built(),
        """
slave, t, found = begun(opened()), 0.0, []
while t < 7.995:
    slave.doStep(t, 0.01)
    t += 0.01
    found.append(shown(slave, "impact_time", "impact_speed"))
print(json.dumps(found))
""",
    )
    found = np.unique(np.array(found), axis=0)
    found = found[found[:, 0] > 0.0]
    exact = fmu.exact_impacts(fmu.plate(), 8.0)
    assert len(found) == len(exact) > 20
    assert np.abs(found[:, 0] - exact[:, 0]).max() < 1e-9
    assert np.abs(found[:, 1] - exact[:, 1]).max() < 1e-9


def test_event_mode_ends_steps_at_impacts():
    """FMI 3.0: a step ends early at each impact, where the speed jumps in event mode by the restitution."""
    found = fmu.run(
        fmu.built(fmi=3),
        """
slave = opened(3)
slave.instantiate(eventModeUsed=True, earlyReturnAllowed=True)
begun(slave, 3)
slave.enterStepMode()
t, events = 0.0, []
while t < 7.9:
    event, _, early, last = slave.doStep(t, min(0.05, 7.9 - t + 1e-9), noSetFMUStatePriorToCurrentPoint=True)
    t = last
    if event:
        before = shown(slave, "velocity", "displacement", version=3)
        slave.enterEventMode()
        slave.updateDiscreteStates()
        after = shown(slave, "velocity", version=3)
        slave.enterStepMode()
        events.append([t, before[0], before[1], after[0]])
print(json.dumps(events))
""",
    )
    found = np.array(found)
    exact = fmu.exact_impacts(fmu.plate(), 7.9)
    assert np.abs(found[:, 0] - exact[: len(found), 0]).max() < 1e-9 and len(found) == len(exact)
    assert found[:, 1] == pytest.approx(-exact[:, 1], abs=1e-9)
    assert found[:, 2] == pytest.approx(-5e-4, abs=1e-15)
    assert found[:, 3] == pytest.approx(-0.9 * found[:, 1], rel=1e-12)


@pytest.mark.parametrize(
    ("scene", "most"), [("plate_harmonic_stop.toml", 1e-9), ("plate_two_stops.toml", 1e-3)]
)
def test_ledger(scene, most):
    """What the shaking gives is what is dissipated and stored: with located impacts to rounding,
    with noise to 0.1 %."""
    found = fmu.run(
        fmu.built(scene),
        """
r = simulate_fmu(fmu, stop_time=60.0, step_size=0.05, output_interval=0.05)[-1]
print(json.dumps({name: float(r[name]) for name in r.dtype.names}))
""",
    )
    lost = (
        found["load_energy"]
        + found["damping_energy"]
        + found["impact_energy"]
        + found["stored_energy"]
    )
    assert found["impacts"] > 20
    assert lost == pytest.approx(found["input_energy"], rel=most)


@pytest.mark.parametrize("load", ["resistance = 1e6", BRIDGE], ids=["located", "grid"])
def test_force_and_velocity_of_a_mass_at_rest_on_its_stop(tmp_path, load):
    """A mass that its spring presses on the stop moves with the base: minus the mass times the base's acceleration."""
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text().partition("[stop]")[0]
    scene = tmp_path / f"pressed_{load[:3]}.toml"
    scene.write_text(f'{text}[stop]\nrestitution = 0.5\ngap = "-1 mm"\n\n[load]\n{load}\n')
    force, speed, x = fmu.run(
        fmu.built(str(scene)),
        """
one = begun(opened())
one.setReal([number["base_acceleration"]], [0.1])
one.doStep(0.0, 10.3 * h)
print(json.dumps(shown(one, "base_force", "velocity", "displacement")))
""",
    )
    assert force == pytest.approx(-0.04 * 0.1, rel=1e-12)
    assert speed == 0.0
    assert x == pytest.approx(1e-3, rel=1e-12)


def test_states_reset_and_instances():
    """A state saved, also as bytes, continues alike; reset begins again; two instances are apart."""
    found = fmu.run(
        fmu.built("plate_with_stop.toml"),
        """
names = "displacement", "velocity", "voltage", "input_energy"
one = begun(opened())
first = path(one, names, 0.0, 100)
state = one.getFMUstate()
rest = path(one, names, 1.23, 100)
bytes_ = one.serializeFMUstate(state)
one.setFMUstate(state)
again = path(one, names, 1.23, 100)
two = begun(opened())
two.setFMUstate(two.deSerializeFMUstate(bytes_))
elsewhere = path(two, names, 1.23, 100)
one.freeFMUstate(state)
one.reset()
one.setupExperiment(startTime=0.0)
one.enterInitializationMode()
one.exitInitializationMode()
anew = path(one, names, 0.0, 100)
three, four = begun(opened()), begun(opened())
mixed = []
for k in range(100):
    for slave in (three, four):
        slave.doStep(k * 0.0123, 0.0123)
    mixed.append(shown(three, *names))
    assert mixed[-1] == shown(four, *names)
print(json.dumps([rest == again == elsewhere, anew == first, bool(np.allclose(mixed, first, rtol=1e-9, atol=1e-15))]))
""",
    )
    assert found == [True, True, True]


def test_bad_values_have_a_status_and_no_crash():
    """A step of 0, nan, a value out of range, a fixed parameter set late, a wrong time, a start behind the stop."""
    found = fmu.run(
        fmu.built(),
        """
def refused(what):
    try:
        what()
    except Exception as error:
        return str(error)
    return "taken"
one = begun(opened())
a, m = number["base_acceleration"], number["oscillator.mass"]
answers = [
    refused(lambda: one.doStep(0.0, 0.0)),
    refused(lambda: one.doStep(0.0, float("nan"))),
    refused(lambda: one.doStep(5.0, 0.1)),
    refused(lambda: one.setReal([a], [float("nan")])),
    refused(lambda: one.setReal([a], [float("inf")])),
    refused(lambda: one.setReal([m], [0.05])),
    refused(lambda: one.setReal([number["displacement"]], [0.0])),
    refused(lambda: one.getReal([10_000])),
    refused(lambda: begun(opened(), initial__displacement=-1.0)),
    refused(lambda: begun(opened(), oscillator__mass=-1.0)),
]
one.doStep(0.0, 0.1)
print(json.dumps([answers, shown(one, "displacement")]))
""",
    )
    assert all(re.search("status|error|Discard|[1-4]", answer) for answer in found[0])
    assert "taken" not in found[0]
    assert math.isfinite(found[1][0])


def test_parameters_are_those_of_the_scene():
    """Changed in the FMU or in the scene and exported again: the same path, for each parameter."""
    changed = {
        "oscillator.mass": 0.05,
        "piezo.capacitance": 4e-8,
        "stop.gap": 3e-4,
        "load.resistance": 2e6,
    }
    changed |= {"oscillator.stiffness": 18.0, "piezo.coupling": 2e-3, "oscillator.damping": 8e-3}
    changed |= {
        "stop.restitution": 0.7,
        "excitation.acceleration_amplitude": 0.3,
        "excitation.frequency": 4.0,
    }
    code = """
r = simulate_fmu(fmu, stop_time=3.0, step_size=0.01, output_interval=0.01, start_values=VALUES)[-1]
print(json.dumps([float(r[name]) for name in ("displacement", "voltage", "power", "stored_energy", "base_impulse")]))
"""
    path = fmu.built()
    parameters = dict(changed)
    found = fmu.run(path, code.replace("VALUES", repr(parameters)))
    scene = hv.load(EXAMPLES / "plate_harmonic_stop.toml").varied(changed)
    other = path.parent / "changed.fmu"
    hv.export(scene, other, platforms=[fmu.HERE])
    assert found == pytest.approx(fmu.run(other, code.replace("VALUES", "{}")), rel=1e-6)


def test_a_changed_level_of_filtered_noise_is_there_from_the_start():
    """The noise began with the deviation of the scene's own level."""
    small, great = fmu.run(
        fmu.built("plate_coloured.toml"),
        """
found = []
for factor in (1.0, 1e4):
    level = factor * float(next(v.start for v in described.modelVariables if v.name == "excitation.acceleration_psd"))
    one = begun(opened(), excitation__acceleration_psd=level)
    one.doStep(0.0, 0.05)
    found += shown(one, "displacement")
print(json.dumps(found))
""",
    )
    assert great == pytest.approx(100.0 * small, rel=1e-9)


def test_library_needs_the_c_library_alone():
    """No Python, no package: the library depends on libc and libm, and shows the functions of FMI alone."""
    path = fmu.built()
    folder = path.parent / "inside"
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    (library,) = folder.rglob("*.so")
    needed = subprocess.run(
        ["readelf", "-dW", library], capture_output=True, text=True, check=True
    ).stdout
    symbols = subprocess.run(
        ["readelf", "--dyn-syms", "-W", library], capture_output=True, text=True, check=True
    ).stdout
    libraries = set(re.findall(r"NEEDED.*\[(.*?)\]", needed))
    assert libraries <= {
        "libc.so.6",
        "libm.so.6",
        "ld-linux-x86-64.so.2",
        "libpthread.so.0",
        "libdl.so.2",
    }
    defined = [
        line.split()[-1] for line in symbols.splitlines() if re.search(r"FUNC.*DEFAULT +\d", line)
    ]
    assert len(defined) > 30
    assert all(name.startswith("fmi2") for name in defined)


@pytest.mark.parametrize(
    ("scene", "options", "error", "words"),
    [
        ("plate_with_stop.toml", {"platforms": ["linux"]}, InputError, "unknown platform 'linux'"),
        ("plate_with_stop.toml", {"platforms": []}, InputError, "one at least"),
        ("plate_with_stop.toml", {"fmi": 1}, InputError, "be 2 or 3"),
        ("plate_with_stop.toml", {"circuit": "netlist"}, InputError, "a load without a netlist"),
        ("plate_with_stop.toml", {"circuit": "beside"}, InputError, "inside, outside or netlist"),
        ("plate_with_stop.toml", {"name": "x"}, InputError, "must belong to a subcircuit"),
        ("paper_figure3.toml", {}, InputError, "must be a device"),
        ("two_modes_with_stop.toml", {}, CannotServeError, "one mode"),
    ],
)
def test_refused(tmp_path, scene, options, error, words):
    out = tmp_path / "device.fmu"
    with pytest.raises(error, match=words):
        hv.export(EXAMPLES / scene, out, **options)
    assert not out.exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [("loss_tangent = 0.1", "dielectric loss"), ('coupling_x2 = "5 N/(V m^2)"', "coupling x2")],
)
def test_an_effect_that_an_fmu_lacks_is_refused(tmp_path, line, words):
    """It was left out in silence."""
    text = (EXAMPLES / "plate_harmonic.toml").read_text()
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace("[piezo]\n", f"[piezo]\n{line}\n"))
    with pytest.raises(CannotServeError, match=f"cannot model {words}"):
        hv.export(scene, tmp_path / "device.fmu")


def test_the_same_scene_gives_the_same_bytes(tmp_path):
    """In another process, the second time from the cache: without a compiler."""
    made = []
    for k, before in enumerate(("", "import subprocess; subprocess.run = None; ")):
        out = tmp_path / str(k) / "plate.fmu"
        out.parent.mkdir()
        scene = str(EXAMPLES / "plate_with_stop.toml")
        code = f"{before}import harvester as hv; hv.export({scene!r}, {str(out)!r})"
        subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
        made.append(out.read_bytes())
    assert made[0] == made[1]


def test_icon_and_terminals():
    """FMI 2 has model.png; the terminals and the icon of FMI 3 satisfy its schema."""
    etree = pytest.importorskip("lxml.etree")
    schema = Path(pytest.importorskip("fmpy").__file__).parent / "schema" / "fmi3"
    with zipfile.ZipFile(fmu.built()) as archive:
        assert archive.read("model.png").startswith(b"\x89PNG")
    with zipfile.ZipFile(fmu.built(fmi=3)) as archive:
        document = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        assert archive.read("terminalsAndIcons/icon.png").startswith(b"\x89PNG")
        assert etree.fromstring(archive.read("terminalsAndIcons/icon.svg")).tag.endswith("svg")
    valid = etree.XMLSchema(etree.parse(schema / "fmi3TerminalsAndIcons.xsd"))
    valid.assertValid(document)
    assert document.find("GraphicalRepresentation/Icon") is not None
    assert [port.get("name") for port in document.iter("Terminal")] == ["base"]


def test_licence_and_words_inside():
    with zipfile.ZipFile(fmu.built(fmi=3)) as archive:
        assert b"GPL-3.0-or-later" in archive.read("documentation/licenses/license.txt")
        assert b"base_acceleration" in archive.read("terminalsAndIcons/terminalsAndIcons.xml")
        assert b"<Unit " in archive.read("modelDescription.xml")
    assert "GPL" in (ROOT / "pyproject.toml").read_text()
