"""Calls in any order with any arguments: each has a status, bad ones not OK, and nothing crashes or hangs."""

import runpy

import pytest

import harvester as hv
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

# The functions of a library by their C types: FMPy itself ends the process if it frees an instance twice
BARE = """
import ctypes as C, math, random
from pathlib import Path
three = described.fmiVersion.startswith("3")
(path,) = Path(extract(fmu)).rglob("*.so")
library = C.CDLL(str(path))
nan, inf = math.nan, math.inf
OK, DISCARD, ERROR = 0, 2, 3
pointer, size = C.c_void_p, C.c_size_t
def call(name, *values, kind=C.c_int):
    function = getattr(library, ("fmi3" if three else "fmi2") + name)
    function.restype = kind
    return function(*values)
def instance():
    words = C.c_char_p(b"one"), C.c_char_p(described.guid.encode())
    if three:
        flags = C.c_bool(False), C.c_bool(False), C.c_bool(True), C.c_bool(True)
        rest = None, size(0), None, None, None
        return pointer(call("InstantiateCoSimulation", *words, None, *flags, *rest, kind=pointer))
    rest = words[1], None, None, 0, 0
    return pointer(call("Instantiate", words[0], 1, *rest, kind=pointer))
def free(one):
    call("FreeInstance", one, kind=None)
def begin(one, start=0.0):
    t = C.c_double(start)
    if three:
        flag = C.c_bool(False)
        first = call("EnterInitializationMode", one, flag, C.c_double(0.0), t, flag, C.c_double(0.0))
        return [first, call("ExitInitializationMode", one), call("EnterStepMode", one)]
    first = call("SetupExperiment", one, 0, C.c_double(0.0), t, 0, C.c_double(0.0))
    return [first, call("EnterInitializationMode", one), call("ExitInitializationMode", one)]
def step(one, t, h):
    \"\"\"The status, and the time at the end.\"\"\"
    if not three:
        status = call("DoStep", one, C.c_double(t), C.c_double(h), 1)
        return status, t if status else t + h
    flags = [C.c_bool() for _ in range(3)]
    last = C.c_double(t)
    places = [C.byref(flag) for flag in flags]
    status = call("DoStep", one, C.c_double(t), C.c_double(h), C.c_bool(True), *places, C.byref(last))
    if status == OK and flags[0]:
        update(one)
    return status, last.value
def update(one):
    flags = [C.byref(C.c_bool()) for _ in range(5)]
    call("EnterEventMode", one)
    call("UpdateDiscreteStates", one, *flags, C.byref(C.c_double()))
    call("EnterStepMode", one)
def put(one, places, values):
    n = len(places)
    ends = (size(n),) if three else ()
    name = "SetFloat64" if three else "SetReal"
    return call(name, one, (C.c_uint * n)(*places), size(n), (C.c_double * n)(*values), *ends)
def got(one, places):
    n = len(places)
    values = (C.c_double * n)()
    ends = (size(n),) if three else ()
    status = call("GetFloat64" if three else "GetReal", one, (C.c_uint * n)(*places), size(n), values, *ends)
    return status, list(values)
State = "FMUState" if three else "FMUstate"
def saved(one):
    state = pointer()
    return call("Get" + State, one, C.byref(state)), state
"""
WRONG = """
answers = {}
one = instance()
answers["end at first"] = call("Terminate", one)
answers["started"] = begin(one)
for name, t, h in (("t inf", inf, 0.1), ("t -inf", -inf, 0.1), ("t nan", nan, 0.1), ("tiny", 1e9, 1e-9)):
    answers[name] = step(one, t, h)[0]
t = 0.0
while t < 0.1 - 1e-12:
    status, t = step(one, t, 0.1 - t)
answers["step"] = status
kind, ends = ("Float64", (size(1),)) if three else ("Real", ())
answers["no references"] = call("Get" + kind, one, None, size(1), (C.c_double * 1)(), *ends)
answers["no values"] = call("Set" + kind, one, (C.c_uint * 1)(1), size(1), None, *ends)
answers["no place for a state"] = call("Get" + State, one, None)
answers["no state"] = call("Set" + State, one, None)
answers["no bytes"] = call(("Des" if three else "DeS") + "erialize" + State, one, None, size(8), C.byref(pointer()))
if three:
    answers["no flags"] = call("DoStep", one, C.c_double(t), C.c_double(0.1), C.c_bool(True), None, None, None, None)
answers["finite"] = got(one, [number["displacement"]])[0]
answers["end"] = call("Terminate", one)
answers["end again"] = call("Terminate", one)
answers["step after it"] = step(one, t, 0.1)[0]
answers["input after it"] = put(one, [number["base_acceleration"]], [0.0])
answers["reset"] = call("Reset", one)
answers["anew"] = begin(one, 1e300)
answers["time that no step changes"] = step(one, 1e300, 0.1)[0]
free(one)
free(one)
answers["step when freed"] = step(one, 0.0, 0.1)[0]
answers["reset when freed"] = call("Reset", one)
answers["state when freed"] = saved(one)[0]
answers["NULL"] = step(None, 0.0, 0.1)[0]
free(None)
others = [instance() for _ in range(3)]
answers["apart"] = len({other.value for other in others})
answers["others"] = [begin(other) for other in others]
print(json.dumps(answers))
"""
WRONG_OF_2 = """
one = instance()
begin(one)
def slope(x):
    place, order = (C.c_uint * 1)(number["base_acceleration"]), (C.c_int * 1)(1)
    return call("SetRealInputDerivatives", one, place, size(1), order, (C.c_double * 1)(x))
found = [slope(1.0), slope(1e200), slope(nan)]
status, state = saved(one)
found.append(call("Set" + State, one, state))
print(json.dumps(found))
"""
# Sequences of calls, some of them legal, by a seed
RANDOM = """
places = [v.valueReference for v in described.modelVariables if v.type in ("Real", "Float64")]
bounds = {v.valueReference: v for v in described.modelVariables}
EXTREME = nan, inf, -inf, 1e300, -1e300, 0.0, -1.0, 5e-324, 1e30
def value(random, place):
    known = bounds.get(place)
    if random.random() < 0.3 or known is None:
        return random.choice(EXTREME)
    if random.random() < 0.3:
        return float(random.choice([known.min or -1.0, known.max or 1.0]))
    return float(known.start or 0.0) * random.choice([0.5, 1.0, 1.0, 1.0, 2.0])
CALLS = ["step"] * 5 + ["put"] * 3 + ["got"] * 2 + ["save", "restore", "end", "reset", "begin", "update", "changed"]
def sequence(seed):
    random = random_of(seed)
    one, t, states, faults = instance(), 0.0, [], []
    failed = False
    if random.random() < 0.9:
        begin(one)
    for _ in range(random.randrange(5, 40)):
        what = random.choice(CALLS)
        if what == "end" and random.random() < 0.7:
            continue
        bad, status = False, OK
        if what == "step":
            h = random.choice([h0, 10.0 * h0, 0.37 * h0, 0.3] * 3 + [0.0, -h0, 1e15, 5e-324, *EXTREME[:4]])
            at = t if random.random() < 0.9 else random.choice([t + 1.0, -1.0, *EXTREME[:5]])
            bad = not (math.isfinite(at) and 0.0 < h < 1e9)
            status, end = step(one, at, h)
            t = t if status else end
            failed = failed or status == ERROR
        elif what == "put":
            some = [random.choice([*places, 100_000]) for _ in range(random.randrange(3))]
            values = [value(random, place) for place in some]
            bad = not all(map(math.isfinite, values)) or 100_000 in some
            status = put(one, some, values)
        elif what == "got":
            status, values = got(one, places)
            if status == OK and not failed and not all(map(math.isfinite, values)):
                faults.append([seed, "not finite", values])
        elif what == "save":
            status, state = saved(one)
            states += [state] if status == OK else []
        elif what == "restore" and states:
            status = call("Set" + State, one, random.choice(states))
            failed = failed and status != OK
            t = got(one, [number["time"]])[1][0] if status == OK else t
        elif what == "changed" and states:
            length = size()
            call("Serialized" + ("FMUState" if three else "FMUstate") + "Size", one, states[0], C.byref(length))
            some = C.create_string_buffer(length.value)
            call("Serialize" + State, one, states[0], some, length)
            few = bytearray(some.raw)
            few[random.randrange(len(few))] ^= 1 << random.randrange(8)
            few = bytes(few)[: random.choice([len(few), len(few), random.randrange(len(few))])]
            state = pointer()
            status = call(("Des" if three else "DeS") + "erialize" + State, one, few, size(len(few)), C.byref(state))
            states += [state] if status == OK else []
        elif what == "end":
            status = call("Terminate", one)
        elif what == "reset":
            call("Reset", one)
            failed, t = False, 0.0
            begin(one)
        elif what == "begin":
            begin(one, random.choice([0.0, nan, 5.0]))
        elif three:
            update(one)
        if not 0 <= status <= 4 or (bad and status == OK):
            faults.append([seed, what, status])
    for state in states:
        call("Free" + State, one, C.byref(state))
    free(one)
    free(one)
    return faults
random_of, h0 = random.Random, h
print(json.dumps([fault for seed in range(SEEDS) for fault in sequence(seed)]))
"""
# Instances of several threads, each made, stepped and freed many times
THREADS = """
import concurrent.futures
def course(_):
    one = instance()
    began, t = begin(one), 0.0
    for _ in range(20):
        status, t = step(one, t, 0.01)
    ended = got(one, [number["displacement"], number["voltage"]])
    free(one)
    return began, ended, one.value
alone = course(0)
with concurrent.futures.ThreadPoolExecutor(8) as pool:
    courses = list(pool.map(course, range(400)))
same = all(each[:2] == alone[:2] for each in courses)
print(json.dumps([alone[1], same, len({place for *_, place in courses})]))
"""


def test_instances_of_several_threads_do_not_meet():
    """Each has its own memory, of which there are no more places than threads."""
    (status, values), same, places = fmu.run(fmu.built(), BARE + THREADS)
    assert status == 0
    assert all(abs(value) > 0.0 for value in values)
    assert same
    assert 1 <= places <= 9


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_wrong_call_has_a_status(fmi):
    """At an infinite time the library stepped without end, without an instance or arrays it crashed."""
    answers = fmu.run(fmu.built(fmi=fmi), BARE + WRONG, timeout=60)
    started = [answers.pop(name) for name in ("started", "anew")]
    assert [*started, *answers.pop("others")] == [[0, 0, 0]] * 5
    assert answers.pop("apart") == 3
    fine = ("step", "finite", "end", "reset")
    assert [answers.pop(name) for name in fine] == [0, 0, 0, 0]
    assert set(answers.values()) == {3}, answers


def test_a_slope_out_of_range_is_refused():
    """One of 1e200 m/s^3 was accepted, and its state then refused."""
    assert fmu.run(fmu.built(), BARE + WRONG_OF_2) == [0, 2, 2, 0]


def test_a_slope_of_a_model_is_refused(tmp_path):
    """A model has no base: with the largest reference the place of the slope's range was undefined."""
    example = runpy.run_path(str(EXAMPLES / "beam_with_stop.py"))
    path = tmp_path / "beam.fmu"
    names = {"port": example["PIEZO"], "start": example["START"], "load": example["LOAD"]}
    hv.export(example["Beam"](), path, step="50 us", **names)
    code = """
one = instance()
place, order = (C.c_uint * 1)(0xFFFFFFFF), (C.c_int * 1)(1)
print(json.dumps(call("SetRealInputDerivatives", one, place, size(1), order, (C.c_double * 1)(0.0))))
"""
    assert fmu.run(path, BARE + code) == 3


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("scene", ["plate_harmonic_stop.toml", "plate_parallel_sshi.toml"])
def test_random_calls(scene, fmi):
    """200 sequences each: bad arguments are not OK, and outputs finite before the first error."""
    code = BARE + RANDOM.replace("SEEDS", "200")
    assert fmu.run(fmu.built(scene, fmi=fmi), code, timeout=120) == []
