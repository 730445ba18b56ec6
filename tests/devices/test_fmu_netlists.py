"""FMUs with a netlist inside: the path of engine `compiled` to 1e-10, energies, states, and refusals."""

import zipfile

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.newton import MOST_WRITTEN
from harvester.devices.fmu import fixed_scales, parts
from harvester.devices.fmu.objects import PLATFORMS
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

BRIDGE = 'netlist = "bridge"\nparameters = { R = "1.5 Mohm", C = "1 uF" }\n'
NAMES = "displacement", "voltage", "store_voltage", "delivered_energy"
# Half-way through the steps, where the kernel has its samples; the energy is that of whole steps
HALF_WAY = """
names = "displacement", "voltage", "store_voltage", "delivered_energy"
rows = []
for n in (1, 10, 100):
    slave = begun(opened())
    slave.doStep(0.0, 0.5 * h)
    times = [(0.5 + n * k) * h for k in range(4000 // n + 1)]
    row = []
    for t, end in zip(times, times[1:]):
        slave.doStep(t, end - t)
        row.append(shown(slave, *names))
    rows.append(row[100 // n - 1 :: 100 // n])
print(json.dumps([h, rows, validate_fmu(fmu)]))
"""


@pytest.fixture(scope="module")
def struck(tmp_path_factory):
    """The plate of a harmonic base against a rigid stop with the package's bridge: the file of its scene."""
    scene = tmp_path_factory.mktemp("scene") / "struck.toml"
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text().partition("[load]")[0]
    scene.write_text(f"{text}[load]\n{BRIDGE}")
    return scene


def check_path(scene, kicks=4000):
    """The FMU has the path of the compiled circuit's own kernel, whatever the communication step."""
    h, rows, problems = fmu.run(fmu.built(str(scene), circuit="netlist"), HALF_WAY)
    assert problems == []
    rows = np.array(rows)
    sizes = np.maximum(np.abs(rows[0]).max(axis=0), 1e-12)  # a chip that has not started gives 0 J
    assert np.abs((rows - rows[0]) / sizes).max() < 1e-10
    problem = Problem(hv.load(scene)).plain
    part = parts.part_of(problem, problem.scales, "netlist")
    eqs = fixed_scales.equations(problem, problem.scales)
    step = part.plan.h
    assert step == pytest.approx(h * problem.scales.frequency, rel=1e-15)
    shaking = eqs.drive * np.cos(eqs.drive_frequency * (step * np.arange(kicks + 1)))
    path = part.board.trace(eqs, np.zeros(kicks), step, stride=100, shaking=shaking, keep=True)
    units = fixed_scales.units(problem, problem.scales)
    at = part.board.voltages_at
    expected = np.column_stack(
        [
            path.samples[:, 2] * units.length,
            path.samples[:, 4] * units.volts,
            path.states[:, at + 1],
            (path.square + path.states[:, at + 3 + part.board.sizes[2]]) / part.board.resistance,
        ]
    )
    found = rows[0]
    difference = np.abs(found - expected).max(axis=0) / sizes
    assert difference.max() < 1e-10, dict(zip(NAMES, difference, strict=True))
    assert difference[0] < 1e-11
    return path


def test_the_path_is_that_of_the_compiled_circuit(struck):
    """A bridge and a rigid stop: displacement, voltages and energy at 40 times, with impacts between."""
    path = check_path(struck)
    assert len(path.impacts) > 4
    assert path.failed == 0


def test_many_junctions_have_the_path_of_the_compiled_circuit(tmp_path):
    """A bridge of seven diodes in series per arm, whose equations are a tape of numbers."""
    arms = {"a": "p x", "b": "n x", "c": "0 p", "d": "0 n"}
    lines = []
    for name, ends in arms.items():
        first, last = ends.split()
        nodes = [first, *(f"{name}{k}" for k in range(1, 7)), last]
        lines += [f"D{name}{k} {nodes[k]} {nodes[k + 1]} DX" for k in range(7)]
    (tmp_path / "many.cir").write_text(
        ".subckt many p n\n" + "\n".join(lines) + "\nCsmooth x 0 100n\nRload x 0 1e6\n"
        ".model DX D(Is=1n N=1.5 Cjo=10p)\n.ends\n"
    )
    scene = tmp_path / "many.toml"
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text().partition("[load]")[0]
    scene.write_text(f'{text}[load]\nnetlist = "./many.cir"\n')
    problem = Problem(hv.load(scene)).plain
    assert len(parts.part_of(problem, problem.scales, "netlist").board.system.diodes) > MOST_WRITTEN
    path = check_path(scene)
    assert path.failed == 0
    assert np.abs(path.voltages[:, 1]).max() > 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["bimorph_board", "bimorph_bq25570", "bimorph_self_powered_sshi"])
def test_boards_and_chips(name):
    """A board from KiCad with a switched load, a chip's circuit, and a self-powered switch with a coil."""
    path = check_path(EXAMPLES / f"{name}.toml")
    assert np.abs(path.voltages[:, 1]).max() > 0.1
    assert path.failed == 0


def test_ledger_with_impacts(struck):
    """The energy of the base is lost or stored to 1e-4, of which the load has a part; 1.8e-5 was observed."""
    found = fmu.run(
        fmu.built(str(struck), circuit="netlist"),
        """
r = simulate_fmu(fmu, stop_time=60.0, step_size=0.05, output_interval=0.05)[-1]
print(json.dumps({name: float(r[name]) for name in r.dtype.names}))
""",
    )
    taken = (
        found["load_energy"]
        + found["damping_energy"]
        + found["impact_energy"]
        + found["stored_energy"]
    )
    assert found["impacts"] > 200
    assert taken == pytest.approx(found["input_energy"], rel=1e-4)
    assert 0.8 < found["delivered_energy"] / found["load_energy"] < 0.95


def test_states_instances_and_a_charged_store(struck):
    """A state holds the netlist's; two instances are apart; the store begins at its parameter."""
    found = fmu.run(
        fmu.built(str(struck), circuit="netlist"),
        """
names = "displacement", "voltage", "store_voltage", "load_energy", "delivered_energy"
one = begun(opened())
first = path(one, names, 0.0, 50)
state = one.getFMUstate()
rest = path(one, names, 0.615, 50)
bytes_ = one.serializeFMUstate(state)
one.setFMUstate(state)
again = path(one, names, 0.615, 50)
two = begun(opened(), initial__store_voltage=3.0)
charged = shown(two, "store_voltage")[0]
path(two, names, 0.0, 20)
two.setFMUstate(two.deSerializeFMUstate(bytes_))
elsewhere = path(two, names, 0.615, 50)
one.reset()
one.setupExperiment(startTime=0.0)
one.enterInitializationMode()
one.exitInitializationMode()
held = begun(opened(), initial__store_voltage=3.0)
held.doStep(0.0, 0.015)
same = rest == again == elsewhere
print(json.dumps([same, path(one, names, 0.0, 50) == first, charged, shown(held, "store_voltage")[0]]))
""",
    )
    assert found[:3] == [True, True, 3.0]
    # R C is 1.5 s: the store falls by exp(-0.015/1.5), as no current flows into it
    assert found[3] == pytest.approx(3.0 * np.exp(-0.01), rel=1e-3)


def test_power_and_current_are_those_of_the_first_voltages(struck, tmp_path):
    """The load across the store, and from n to p across the piezo, or across a capacitor with ic."""
    code = """
one = begun(opened(), VALUES)
print(json.dumps(shown(one, "power", "load_current")))
"""
    path = fmu.built(str(struck), circuit="netlist")
    charged = fmu.run(path, code.replace("VALUES", "initial__store_voltage=3.0"))
    assert charged == pytest.approx([9.0 / 1.5e6, 3.0 / 1.5e6], rel=1e-12)
    text = struck.read_text().partition("[load]")[0]
    cases = {
        "across": ("R1 p a 1e6\nC1 a n 1n\n", "n p", 2.0, -2.0),
        "given": ("R1 p a 1e6\nC1 a n 1u ic=0.5\n", "n a", 2.0, -0.5),
    }
    for name, (lines, nodes, voltage, expected) in cases.items():
        (tmp_path / f"{name}.cir").write_text(
            f".subckt {name} p n\n{lines}Rload {nodes} 1e6\n.ends\n"
        )
        scene = tmp_path / f"{name}.toml"
        scene.write_text(f'{text}[load]\nnetlist = "./{name}.cir"\n')
        path = fmu.built(str(scene), circuit="netlist")
        found = fmu.run(path, code.replace("VALUES", f"initial__voltage={voltage}"))
        assert found == pytest.approx([expected**2 / 1e6, expected / 1e6], rel=1e-12)


def test_the_stored_energy_is_that_beside_the_netlist(struck):
    """The description states so, and a charged store does not count, also that of an ideal circuit."""
    code = """
stored = next(v for v in described.modelVariables if v.name == "stored_energy")
one = begun(opened(), initial__store_voltage=3.0)
print(json.dumps([stored.description, *shown(one, "stored_energy")]))
"""
    for circuit in ("netlist", "inside"):
        words, energy = fmu.run(fmu.built(str(struck), circuit=circuit), code)
        assert words == "energy in mass, springs and the piezo's capacitance"
        assert energy < 1e-9


OTHERS = """
one = begun(opened())
one.doStep(0.0, 0.5)
bytes_ = one.serializeFMUstate(one.getFMUstate())
answers = []
for fmu in OTHERS:
    described = read_model_description(fmu)
    version = int(described.fmiVersion[0])
    other = opened(version)
    if version == 3:
        other.instantiate()
    begun(other, version)
    if version == 3:
        own = other.serializeFMUState(other.getFMUState())
        restore = other.deserializeFMUState
    else:
        own = other.serializeFMUstate(other.getFMUstate())
        restore = other.deSerializeFMUstate
    restore(own)
    try:
        restore(bytes_)
        answers.append([len(own), "taken"])
    except Exception as error:
        answers.append([len(own), str(error)])
print(json.dumps([len(bytes_), answers]))
"""


def test_a_state_of_another_unit_is_refused(struck, tmp_path):
    """Another resistance, and FMI 3.0, have states of the same size."""
    others = [tmp_path / "other.fmu", tmp_path / "third.fmu"]
    scene = hv.load(struck)
    hv.export(scene.varied({"load.parameters.R": 2e6}), others[0], circuit="netlist")
    hv.export(scene, others[1], circuit="netlist", fmi=3)
    code = OTHERS.replace("OTHERS", repr([str(path) for path in others]))
    size, answers = fmu.run(fmu.built(str(struck), circuit="netlist"), code)
    assert [other for other, _ in answers] == [size, size]
    assert all("erializeFMU" in answer for _, answer in answers), answers


def test_events_leave_the_path_as_it_is(struck):
    """FMI 3.0: each impact ends a step; the netlist's counts and the path are those without events."""
    names = 'names = "displacement", "voltage", "delivered_energy"'
    found = fmu.run(fmu.built(str(struck), fmi=3, circuit="netlist"), names + fmu.EVENTS)
    assert found[0][0] == found[0][-1] == found[1][-1] > 10
    assert found[0][1:] == pytest.approx(found[1][1:], rel=1e-10)


def test_a_changed_coupling_is_that_of_a_changed_scene(struck):
    """Mass and coupling are parameters; a value of the netlist, and the capacitance, are fixed."""
    changed = {"oscillator.mass": 0.05, "piezo.coupling": 2e-3}
    code = """
names = [v.name for v in described.modelVariables if v.causality == "parameter"]
r = simulate_fmu(fmu, stop_time=2.0, step_size=0.01, output_interval=0.01, start_values=VALUES)[-1]
print(json.dumps([names, [float(r[name]) for name in ("displacement", "voltage", "delivered_energy")]]))
"""
    path = fmu.built(str(struck), circuit="netlist")
    names, found = fmu.run(path, code.replace("VALUES", repr(changed)))
    assert set(changed) < set(names)
    assert not [name for name in names if name.startswith(("load", "piezo.capacitance"))]
    other = path.parent / "changed.fmu"
    scene = hv.load(struck).varied(changed)
    hv.export(scene, other, circuit="netlist", platforms=[fmu.HERE])
    assert found == pytest.approx(fmu.run(other, code.replace("VALUES", "{}"))[1], rel=2e-3)


def test_a_netlist_for_all_platforms(struck, tmp_path):
    """Solver and steps are emitted for each system, without Python."""
    hv.export(struck, tmp_path / "all.fmu", circuit="netlist", platforms="all")
    with zipfile.ZipFile(tmp_path / "all.fmu") as archive:
        for platform in PLATFORMS.values():
            library = archive.read(f"binaries/{platform.folders[0]}/all.{platform.ending}")
            assert b"fmi2DoStep" in library
            assert b"PyErr" not in library
            assert b"NRT_MemInfo" not in library


def test_an_excessive_input_has_a_status(struck):
    """A base acceleration of +-1e30 m/s^2 on the netlist is an answer or an error, in a time that ends."""
    answers = fmu.run(
        fmu.built(str(struck), circuit="netlist"),
        "accelerations = 1e30, -1e30" + fmu.HARSH,
        timeout=60,
    )
    assert all(answer == "done" or "fmi2DoStep" in answer for answer in answers)


def test_a_netlist_that_cannot_be_compiled_is_refused_in_one_line(tmp_path):
    """The line names the element, and the remedy."""
    (tmp_path / "line.cir").write_text(
        ".subckt line p n\nT1 p n a n Z0=50 TD=1n\nRload a n 1e6\n.ends\n"
    )
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text().partition("[load]")[0]
    scene = tmp_path / "line.toml"
    scene.write_text(f'{text}[load]\nnetlist = "./line.cir"\n')
    with pytest.raises(CannotServeError, match=r"element t1 .*: leave the load") as caught:
        hv.export(scene, tmp_path / "line.fmu")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "line.fmu").exists()
