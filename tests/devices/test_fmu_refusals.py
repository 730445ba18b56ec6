"""Refusals of an FMU and its export: each with a status of the standard or one line, and nothing crashes or hangs."""

import math
from typing import NamedTuple

import pytest

import harvester as hv
from harvester.errors import CannotServeError
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

WORDS = """
said = []
def answer(what):
    said.clear()
    try:
        what()
        return "taken"
    except Exception as error:
        return " ".join([str(error), *said])
a, m, out = number["base_acceleration"], number["oscillator.mass"], number["voltage"]
nan, inf = float("nan"), float("inf")
"""
LOGGED = """
from ctypes import byref
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.logging import addLoggerProxy
def log(*words):
    said.append(words[4].decode() if isinstance(words[4], bytes) else str(words[4]))
callbacks = fmi2CallbackFunctions()
callbacks.logger = fmi2CallbackLoggerTYPE(log)
addLoggerProxy(byref(callbacks))
def logged():
    one = opened()
    one.instantiate(callbacks=callbacks)
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    return one
"""
OF_2 = f"""{LOGGED}
early = opened()
early.instantiate(callbacks=callbacks)
one = opened()
one.instantiate(callbacks=callbacks)
refused = [
    answer(lambda: early.doStep(0.0, 0.1)),
    answer(lambda: one.setupExperiment(startTime=nan)),
]
one.setupExperiment(startTime=0.0)
one.enterInitializationMode()
refused += [answer(lambda: one.setReal([m], [nan])), answer(lambda: one.setReal([m], [0.0]))]
one.exitInitializationMode()
one.doStep(0.0, 0.1)
refused += [
    answer(lambda: one.doStep(0.1, 0.0)),
    answer(lambda: one.doStep(0.1, -0.1)),
    answer(lambda: one.doStep(0.1, nan)),
    answer(lambda: one.doStep(0.1, inf)),
    answer(lambda: one.doStep(0.1, 1e15)),
    answer(lambda: one.doStep(nan, 0.1)),
    answer(lambda: one.doStep(0.3, 0.1)),
    answer(lambda: one.setReal([a], [nan])),
    answer(lambda: one.setReal([a], [-inf])),
    answer(lambda: one.setReal([m], [0.05])),
    answer(lambda: one.setReal([out], [1.0])),
    answer(lambda: one.getReal([100_000])),
    answer(lambda: one.getBoolean([out])),
    answer(lambda: one.setInteger([a], [1])),
    answer(lambda: one.deSerializeFMUstate(b"too short")),
]
one.doStep(0.1, 0.1)
print(json.dumps([refused, shown(one, "displacement", "voltage", "stored_energy")]))
"""
OF_3 = """
one = opened(3)
one.instantiate(eventModeUsed=True, earlyReturnAllowed=True, logMessage=None)
refused = [
    answer(lambda: one.doStep(0.0, 0.1)),
    answer(lambda: one.enterInitializationMode(startTime=nan)),
]
one.enterInitializationMode(startTime=0.0)
refused.append(answer(lambda: one.setFloat64([m], [nan])))
one.exitInitializationMode()
refused.append(answer(lambda: one.enterInitializationMode(startTime=7.0)))
refused.append(answer(lambda: one.doStep(0.0, 0.1)))
one.enterStepMode()
event, _, early, last = one.doStep(0.0, 0.1)
refused += [
    answer(lambda: one.doStep(last, 0.0)),
    answer(lambda: one.doStep(last, nan)),
    answer(lambda: one.doStep(last, 1e15)),
    answer(lambda: one.doStep(last + 1.0, 0.1)),
    answer(lambda: one.setFloat64([a], [nan])),
    answer(lambda: one.setFloat64([m], [0.05])),
    answer(lambda: one.setFloat64([out], [1.0])),
    answer(lambda: one.getFloat64([100_000])),
    answer(lambda: one.getFloat32([out])),
    answer(lambda: one.updateDiscreteStates()),
]
one.doStep(last, 0.001)
print(json.dumps([refused, shown(one, "displacement", "voltage", "stored_energy", version=3)]))
"""


@pytest.mark.parametrize(("fmi", "code"), [(2, OF_2), (3, OF_3)], ids=["2", "3"])
def test_a_bad_call_has_a_status_and_the_instance_goes_on(fmi, code):
    """Steps of 0, below 0, nan and without end, nan inputs, calls out of turn, and references that are not there."""
    refused, after = fmu.run(fmu.built(fmi=fmi), WORDS + code, timeout=60)
    assert len(refused) > 12
    assert "taken" not in refused, refused
    assert all(abs(value) < 100.0 for value in after)
    if fmi == 2:
        assert any("communication step must be above 0 s" in answer for answer in refused)
        assert any("base_acceleration must be between" in answer for answer in refused)


def test_parameters_that_the_inner_step_cannot_resolve_are_refused():
    """A stiffness of 10,000 times the scene's had displacements of 1e80 m without an error."""
    answers = fmu.run(
        fmu.built(),
        """
answers = []
for stiffness in (160.0, 1.6e5):
    try:
        begun(opened(), oscillator__stiffness=stiffness)
        answers.append("done")
    except Exception as error:
        answers.append(str(error))
print(json.dumps(answers))
""",
    )
    assert answers[0] == "done"
    assert "fmi2ExitInitializationMode" in answers[1]


def test_the_greatest_input_ends_with_a_status():
    """An acceleration of 1e30 m/s^2 is an answer or an error, in a time that ends."""
    answers = fmu.run(fmu.built(), "accelerations = (1e30,)" + fmu.HARSH, timeout=60)
    assert all(answer == "done" or "fmi2DoStep" in answer for answer in answers)


def test_a_motion_without_bound_is_not_the_fault_of_the_netlist(tmp_path):
    """At a cubic stiffness 1e6 m/s^2 give an infinite motion, at which no circuit has a solution."""
    text = (EXAMPLES / "plate_bistable.toml").read_text().partition("[load]")[0]
    scene = tmp_path / "bistable.toml"
    scene.write_text(f'{text}[load]\nnetlist = "bridge"\nparameters = {{ R = "1.5 Mohm" }}\n')
    said = fmu.run(
        fmu.built(str(scene), circuit="netlist"),
        f"""{WORDS}{LOGGED}
one = logged()
one.setReal([a], [1e6])
print(json.dumps(answer(lambda: one.doStep(0.0, 0.05))))
""",
    )
    assert "the motion must stay finite, but has grown without bound by 0.05 s" in said


def test_after_a_netlist_without_a_solution_the_whole_state_is_of_one_time(tmp_path):
    """A source draws 1e-6 v^2 behind 1 Mohm: below -0.25 V no v exists; mass and circuit have moved together."""
    (tmp_path / "square.cir").write_text(
        ".subckt square p n\nRs p a 1e6\nB1 a n I=1e-6*V(a,n)*V(a,n)\nRload p n 1e6\n.ends\n"
    )
    text = (EXAMPLES / "plate_harmonic.toml").read_text().partition("[load]")[0]
    scene = tmp_path / "square.toml"
    scene.write_text(f'{text}[load]\nnetlist = "./square.cir"\n')
    first, again, taken, stored, lost, out = fmu.run(
        fmu.built(str(scene), circuit="netlist"),
        f"""{WORDS}{LOGGED}
one = logged()
first, again = (answer(lambda: one.doStep(0.0, 0.5)) for _ in range(2))
energies = shown(one, "input_energy", "stored_energy", "damping_energy", "load_energy")
print(json.dumps([first, again, *energies]))
""",
    )
    assert "the netlist must have a solution" in first
    assert first.endswith("the last at b1")
    assert again == first
    assert taken > 1e-6
    assert stored + lost + out == pytest.approx(taken, rel=1e-3)


def test_a_record_whose_address_would_be_in_the_part_is_refused(tmp_path):
    """Above 1 MB numba reads the record in the exporting process, and an importer crashed."""
    (tmp_path / "long.csv").write_text(
        "time (s),acceleration (m/s^2)\n"
        + "".join(f"{0.02 * k:.2f},{(-1) ** (k // 7)}\n" for k in range(10_750))
    )
    text = (EXAMPLES / "plate_recorded.toml").read_text().replace("shake.csv", "long.csv")
    (tmp_path / "long.toml").write_text(text)
    with pytest.raises(CannotServeError, match="a record of at most 125000 steps") as caught:
        hv.export(tmp_path / "long.toml", tmp_path / "long.fmu")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "long.fmu").exists()


class State(NamedTuple):
    x: float


class Late(NamedTuple):
    """ """

    late: float = 0.0

    def drift(self, s, h):
        return s

    def kick(self, s, h, reaction, noise):
        return State(math.hypot(math.erf(s.x), 1.0))

    def source(self, s):
        return s.x

    def event(self, s, h):
        return math.inf if self.late <= 0.0 else 2.0 * h

    def jump(self, s):
        return s


def test_an_event_outside_the_drift_is_not_a_motion_without_bound(tmp_path):
    """The message names the model's functions; before, erf and hypot are those of Python."""
    path = hv.export(
        Late(),
        tmp_path / "late.fmu",
        port=hv.Piezo(coupling=1.0, capacitance=1e-6),
        start=State(0.5),
        step="1 ms",
        load=hv.Load(resistance=1.0),
    )
    x, said = fmu.run(
        path,
        f"""{WORDS.partition("a, m, out")[0]}{LOGGED}
one = logged()
one.doStep(0.0, h)
found = shown(one, "state.x")
one.setReal([number["model.late"]], [1.0])
print(json.dumps([*found, answer(lambda: one.doStep(h, h))]))
""",
    )
    once = math.hypot(math.erf(0.5), 1.0)
    assert x == pytest.approx(math.hypot(math.erf(once), 1.0), rel=1e-12)  # two kicks in a step
    assert "the model's functions must give finite numbers, and event a time within" in said


def test_nothing_is_left_of_an_export_that_fails(tmp_path):
    """A file in place of the folder: one line, and no part of an FMU."""
    (tmp_path / "folder").write_text("")
    with pytest.raises(hv.InputError, match="`out` must") as caught:
        hv.export(EXAMPLES / "plate.toml", tmp_path / "folder" / "plate.fmu")
    assert "\n" not in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
