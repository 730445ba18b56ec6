"""Models of `cosimulate` as FMUs: the trajectories of `cosimulate`, with its circuits and ports."""

import math
import runpy

import numpy as np
import pytest

import harvester as hv
from tests.support import fmu
from tests.support.paths import EXAMPLES
from tests.support.swing import PIEZO, Place, Swing

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

COURSE = """
rows = []
for n in (1, 7, 100):
    r = simulate_fmu(fmu, stop_time=STEPS * h, step_size=n * h, output_interval=n * h)
    rows.append([[float(r[name][k]) for name in NAMES] for k in range(len(r)) if round(r["time"][k] / h) % 700 == 0])
print(json.dumps([h, validate_fmu(fmu), rows]))
"""


def exported(folder, model, **options):
    """The FMU of a model."""
    return hv.export(model, folder / "model.fmu", platforms=[fmu.HERE], **options)


def course(path, steps, *names):
    """The step, and outputs each 700 steps, for communication steps of 1, 7 and 100: the same to the last digits."""
    code = COURSE.replace("STEPS", str(steps)).replace("NAMES", repr(names))
    h, problems, rows = fmu.run(path, code)
    assert problems == []
    first, *others = map(np.array, rows)
    for other in others:
        assert np.abs(other - first).max() <= 1e-11 * np.abs(first).max()
    return h, first


@pytest.mark.ngspice
def test_a_beam_has_the_path_of_cosimulate(tmp_path):
    """Two modes, five impacts that divide steps, and a resistor: to 1e-7 of each largest value."""
    example = runpy.run_path(str(EXAMPLES / "beam_with_stop.py"))
    path = exported(
        tmp_path,
        example["Beam"](),
        port=example["PIEZO"],
        start=example["START"],
        step="50 us",
        load=example["LOAD"],
    )
    names = [f"state.{name}" for name in example["START"]._fields]
    h, rows = course(path, 2100, *names, "events", "port_work", "load_energy", "stored_energy")
    reference = example["run"](duration=2100 * 50e-6)
    assert h == pytest.approx(50e-6, rel=1e-15)
    for k, name in enumerate(example["START"]._fields):
        expected = reference.state[name][::700]
        size = np.abs(reference.state[name]).max()
        assert np.abs(rows[:, k] - expected).max() < 1e-7 * size
    assert rows[-1, 4] == reference.number_of_events > 4
    work, load, stored = rows[-1, 5:]
    assert load + stored == pytest.approx(work, rel=0.01)


@pytest.mark.ngspice
def test_a_coil_has_the_path_of_cosimulate(tmp_path):
    """A magnet, and a coil with resistance and inductance: to 2e-4 at 0.25 ms, whose own error is 1e-3."""
    example = runpy.run_path(str(EXAMPLES / "electromagnetic_bridge.py"))
    given = {"port": example["COIL"], "start": example["Magnet"](0.0, 0.0, 0.0)}
    load = hv.Load(resistance="1 kohm")
    path = exported(tmp_path, example["Harvester"](), step="0.25 ms", load=load, **given)
    h, rows = course(path, 4200, "state.x", "voltage", "port_work", "load_energy")
    reference = hv.cosimulate(
        example["Harvester"](), load, given["port"], given["start"], 4200 * h, h, tolerance=1e-6
    )
    assert np.abs(rows[:, 0] - reference.state["x"][::700]).max() < 2e-4 * 2.2e-3
    assert (
        np.abs(rows[:, 1] - reference.voltage[::700]).max() < 2e-4 * np.abs(reference.voltage).max()
    )
    # the rest is lost in the coil's resistance, a tenth of the load's
    assert rows[-1, 2] == pytest.approx(1.1 * rows[-1, 3], rel=1e-3)


@pytest.mark.ngspice
def test_a_bridge_has_the_path_of_cosimulate(tmp_path):
    """A netlist inside, by the solver of engine `compiled`: its store is that of ngspice to 0.1 %."""
    start = Place(5e-3, 0.0)
    path = exported(tmp_path, Swing(), port=PIEZO, start=start, step="1 ms", load="bridge")
    h, rows = course(
        path, 2100, "state.x", "store_voltage", "port_work", "load_energy", "stored_energy"
    )
    reference = hv.cosimulate(
        Swing(), "bridge", PIEZO, start, 2100 * h, h, tolerance=1e-6, probe="store"
    )
    assert np.abs(rows[:, 0] - reference.state["x"][::700]).max() < 1e-4 * 5e-3
    expected = reference.probes["store"][::700]
    assert np.abs(rows[:, 1] - expected).max() < 1e-3 * expected.max()
    assert expected.max() > 1.0
    assert rows[-1, 3] + rows[-1, 4] == pytest.approx(rows[-1, 2], rel=1e-3)


def test_an_electrical_port_an_input_and_states(tmp_path):
    """A resistance outside is that inside; an acceleration as an input moves the mass; states continue alike."""
    start = Place(5e-3, 0.0)
    given = {"port": PIEZO, "start": start, "step": "2 ms"}
    (tmp_path / "inside").mkdir()
    inside = exported(tmp_path / "inside", Swing(), load=hv.Load(resistance="1 Mohm"), **given)
    outside = exported(tmp_path, Swing(), inputs=["a"], **given)
    _, expected = course(inside, 1400, "state.x", "voltage", "load_energy")
    code = """
one = begun(opened(), load_resistance=1e6)
rows = [shown(one, "state.x", "voltage", "load_energy")]
for k in range(2):
    one.doStep(1.4 * k, 1.4)
    rows.append(shown(one, "state.x", "voltage", "load_energy"))
state = one.getFMUstate()
one.setReal([number["model.a"]], [0.5])
one.setReal([number["current"]], [1e-9])
moved = path(one, ("state.x", "voltage"), 2.8, 50)
one.setFMUstate(one.deSerializeFMUstate(one.serializeFMUstate(state)))
one.doStep(2.8, 0.615)
calm = shown(one, "state.x", "voltage")
one.setFMUstate(state)
one.setReal([number["model.a"]], [0.5])
one.setReal([number["current"]], [1e-9])
again = path(one, ("state.x", "voltage"), 2.8, 50)
causes = {v.name: v.causality for v in described.modelVariables}
print(json.dumps([rows, moved == again, calm, moved[-1], [causes[n] for n in ("model.a", "model.k", "current")]]))
"""
    rows, same, calm, moved, causes = fmu.run(outside, code)
    assert np.array(rows) == pytest.approx(expected, rel=1e-9)
    assert same
    assert abs(moved[0] - calm[0]) > 1e-5
    assert causes == ["input", "parameter", "input"]


def test_noise_has_its_variance(tmp_path):
    """|z| < 4 of the mean kinetic energy: m E[v^2] = S/(2 c), over 60 trajectories of 200 s."""
    path = exported(
        tmp_path,
        Swing(c=0.02, density=1e-6),
        port=PIEZO,
        start=Place(0.0, 0.0),
        step="5 ms",
        load=hv.Load(resistance=1.0),
    )
    code = """
found = []
for seed in range(60):
    one = opened()
    one.instantiate()
    one.setupExperiment(startTime=0.0)
    one.setInteger([number["seed"]], [seed])
    one.enterInitializationMode()
    one.exitInitializationMode()
    t, squares = 0.0, []
    for k in range(1000):
        one.doStep(t, 0.2)
        t += 0.2
        if k >= 200:
            squares.append(shown(one, "state.v")[0] ** 2)
    found.append(float(np.mean(squares)))
    one.terminate()
print(json.dumps(found))
"""
    found = np.array(fmu.run(path, code))
    expected = 1e-6 / (2.0 * 0.02 * 0.04)
    z = (found.mean() - expected) / (found.std(ddof=1) / math.sqrt(len(found)))
    assert found.std(ddof=1) / math.sqrt(len(found)) < 0.05 * expected
    assert abs(z) < 4.0, (found.mean(), expected, z)


STIFFNESS = 16.0


def pull(x):
    return STIFFNESS * x


class OnGlobals(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(s.x, s.v - h * pull(s.x) / self.m)


def test_a_changed_global_is_compiled_again(tmp_path, monkeypatch):
    """Four times the stiffness, in a function that `kick` calls, is four times the speed of a first step."""
    speeds = []
    for number in (16.0, 64.0):
        monkeypatch.setitem(globals(), "STIFFNESS", number)
        path = exported(
            tmp_path, OnGlobals(), port=PIEZO, start=Place(1e-3, 0.0), step="1 ms", load=None
        )
        code = 'one = begun(opened())\none.doStep(0.0, h)\nprint(json.dumps(shown(one, "state.v")))'
        speeds += fmu.run(path, code)
    assert speeds == pytest.approx([-4e-4, -16e-4], rel=2e-3)


def test_the_load_of_a_netlist_has_its_own_first_voltage(tmp_path):
    """A bridge with 1 Mohm at 3 V behind a piezo of 2 V, at 0 s and in the first step: 3 uA and 9 uW."""
    path = exported(
        tmp_path, Swing(), port=PIEZO, start=Place(0.0, 0.0), step="1 ms", load="bridge"
    )
    first, soon = fmu.run(
        path,
        """
one = begun(opened(), initial__voltage=2.0, initial__store_voltage=3.0)
names = "load_current", "power", "voltage", "store_voltage"
first = shown(one, *names)
one.doStep(0.0, 1e-5)
print(json.dumps([first, shown(one, *names)]))
""",
    )
    assert first == pytest.approx([3e-6, 9e-6, 2.0, 3.0], rel=1e-9)
    assert soon == pytest.approx(first, rel=1e-3)


def test_an_event_ends_no_communication_step_of_a_model(tmp_path):
    """FMI 3.0 in event mode: the description names it, and the events within a step of 0.1 s are counted."""
    example = runpy.run_path(str(EXAMPLES / "beam_with_stop.py"))
    given = {"port": example["PIEZO"], "start": example["START"], "load": example["LOAD"]}
    path = exported(tmp_path, example["Beam"](), step="50 us", fmi=3, **given)
    code = """
slave = opened(3)
slave.instantiate(eventModeUsed=True, earlyReturnAllowed=True)
begun(slave, 3)
slave.enterStepMode()
event, _, early, last = slave.doStep(0.0, 0.1)
(count,) = slave.getInt32([number["events"]])
words = next(v.description for v in described.modelVariables if v.name == "events")
print(json.dumps([described.coSimulation.mightReturnEarlyFromDoStep, words, event, early, last, count]))
"""
    might, words, event, early, last, count = fmu.run(path, code)
    assert not might
    assert "an event ends no communication step" in words
    assert [event, early, last] == [False, False, 0.1]
    assert count > 2
