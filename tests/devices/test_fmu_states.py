"""States of FMUs whose numbers were changed while they were saved: each is refused, and the instance continues."""

import runpy

import pytest

import harvester as hv
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

# Each number of eight bytes of a state in turn becomes each of these; then whole states of noise.
CHANGED = """
one = begun(opened())
one.doStep(0.0, 0.2)
state = one.getFMUstate()
whole = one.serializeFMUstate(state)
outputs = [v.name for v in described.modelVariables if v.causality == "output" and v.type == "Real"]
before = shown(one, *outputs)
head = -(-len(described.guid) // 8) * 8 + 8
bad = [float("nan"), float("inf"), -float("inf"), -1e300]
taken, changed = [], 0
def restored(number):
    try:
        other = one.deSerializeFMUstate(number)
        one.setFMUstate(other)
        one.freeFMUstate(other)
        return True
    except Exception:
        return False
for place in range(head, len(whole) - 8, 8):
    for value in bad:
        if restored(whole[:place] + np.float64(value).tobytes() + whole[place + 8:]):
            after = shown(one, *outputs)
            one.doStep(0.2, 0.2)
            end = shown(one, *outputs)
            if after != before or not np.isfinite(end).all():
                taken.append([place, value])
            changed += 1
            one.setFMUstate(state)
assert shown(one, *outputs) == before
random = np.random.default_rng(1)
noise = sum(restored(whole[:head] + random.bytes(len(whole) - head)) for _ in range(200))
ints = [restored(whole[:-8] + np.array([phase, 0], dtype="<i4").tobytes()) for phase in (-1, 5, 2**31 - 1)]
one.setFMUstate(state)
one.doStep(0.2, 0.2)
print(json.dumps([len(whole), head, taken, changed, noise, ints]))
"""
NAMED = """
one = begun(opened())
one.doStep(0.0, 0.2)
state = one.serializeFMUstate(one.getFMUstate())
def first(value):
    at = state.find(np.float64(value).tobytes())
    assert at > 0
    return at
time = len(state) - 8 - 24
assert np.frombuffer(state, "<f8", 1, time)[0] == 0.2, np.frombuffer(state, "<f8", 4, time - 8)
answers = []
mass = first(MASS)
for at, value in ((time, -0.2), (time, 1e9), (time, float("nan")), (time + 8, 7.0), (mass, -MASS), (mass, 2 * MASS)):
    try:
        one.deSerializeFMUstate(state[:at] + np.float64(value).tobytes() + state[at + 8:])
        answers.append("taken")
    except Exception as error:
        answers.append(str(error))
print(json.dumps(answers))
"""
BRIDGE = 'netlist = "bridge"\nparameters = { R = "1.5 Mohm", C = "1 uF" }\n'


@pytest.fixture(scope="module")
def bridge(tmp_path_factory):
    """The plate with a rigid stop and the package's bridge."""
    scene = tmp_path_factory.mktemp("scene") / "states.toml"
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text().partition("[load]")[0]
    scene.write_text(f"{text}[load]\n{BRIDGE}")
    return str(scene)


@pytest.mark.parametrize("kind", ["located", "grid", "ideal", "netlist"])
def test_a_state_with_a_changed_number_is_refused(kind, bridge):
    """Not a number, infinite or out of range: refused in each place, or an output, which is computed anew."""
    scene = {"located": "plate_harmonic_stop.toml", "grid": "plate_with_stop.toml"}.get(
        kind, bridge
    )
    found = fmu.run(fmu.built(scene, circuit="netlist" if kind == "netlist" else "inside"), CHANGED)
    size, head, taken, changed, noise, phases = found
    assert taken == []
    assert changed < 0.3 * (size - head) / 8 * 4
    assert noise == 0
    assert phases == [False, False, False]


def test_a_changed_state_of_a_model_is_refused(tmp_path):
    """A model of `cosimulate`: its arrays of a step are computed anew."""
    example = runpy.run_path(str(EXAMPLES / "beam_with_stop.py"))
    path = hv.export(
        example["Beam"](),
        tmp_path / "beam.fmu",
        port=example["PIEZO"],
        start=example["START"],
        step="50 us",
        load=example["LOAD"],
    )
    _, _, taken, _, noise, phases = fmu.run(path, CHANGED)
    assert taken == []
    assert noise == 0
    assert phases == [False, False, False]


def test_times_and_parameters_of_a_state():
    """A time before the start or not that of the motion; a mass below 0, or not that of the numbers."""
    code = NAMED.replace("MASS", "0.04")
    answers = fmu.run(fmu.built(), code)
    assert "taken" not in answers, answers
