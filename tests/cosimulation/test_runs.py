"""Runs that fail, hang or die: a named error of that run, after which the next one works."""

import ctypes
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from harvester.cosimulation import runs as worker
from harvester.cosimulation.worker_pool import map_in_workers, ngspice_here
from harvester.equations.coefficients import Equations
from harvester.errors import CircuitError, OutOfTimeError
from harvester.machine import processes
from harvester.netlists.load_circuit import LoadCircuit, load_circuit
from harvester.scene.load import Load
from tests.support.lockstep import WEAK

pytestmark = pytest.mark.ngspice

EQS = Equations(beta=0.05, mu=1.0, c1=-0.05, n1=0.01)
NOISE = np.random.default_rng(5).standard_normal(400)
GOOD = load_circuit(Load(resistance=1e6))


def circuit(*lines):
    """A circuit that ngspice gets as these lines, whatever a netlist could hold."""
    return LoadCircuit(
        "mine", 2 * GOOD.parts, "\n".join(["r.xload.rload p 0 1Meg", "c.xload.c0 p 0 1p", *lines])
    )


REFUSED = circuit("d.xload.d1 p 0 nosuch")
FATAL = LoadCircuit("broken", 2 * GOOD.parts, "r.xload.rload p 0 {nothing}")
# steps of a tenth of a picosecond
HANG = circuit("Bfast x 0 V=sin(1e12*time)", "Rfast x y 1", "Cfast y 0 1p")


def device(load, **more):
    return worker.CoupledDevice(EQS, WEAK, load, 0.1, 4, **more)


def run(load, noise=NOISE, **more):
    return worker.path_in_worker(device(load, **more), noise)


def goes_on():
    """Good circuits, linear and not, run in every worker and give the same answer everywhere."""
    one = device(GOOD)
    bridge = device(load_circuit(Load(netlist="bridge")))
    paths = list(
        map_in_workers(worker.path_in_this_process, [(one, NOISE)] * 4 + [(bridge, NOISE)] * 4)
    )
    for k, path in enumerate(paths):
        assert path.V.any()
        assert (path.samples == paths[k // 4 * 4].samples).all()


def killed_on_the_way(device, noise):
    """`record`, whose process the system ends (as it does for want of memory) while ngspice runs."""
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGKILL)).start()
    return worker.path_in_this_process(device, np.tile(noise, 100_000))


@pytest.mark.parametrize(
    "end",
    [
        os.abort,
        pytest.param(
            os._exit, marks=pytest.mark.thorough("test_a_crash_is_an_error_of_that_run_only")
        ),
    ],
)
def test_a_crash_is_an_error_of_that_run_only(end):
    """The worker process dies, the program does not, and the next run has a new one."""
    with pytest.raises(CircuitError, match="abruptly"):
        list(map_in_workers(end, [() if end is os.abort else (3,)]))
    goes_on()


@pytest.mark.thorough("test_a_crash_is_an_error_of_that_run_only")
def test_a_worker_killed_during_a_run_is_an_error_of_that_run_only():
    with pytest.raises(CircuitError, match="abruptly"):
        list(map_in_workers(killed_on_the_way, [(device(GOOD), NOISE)]))
    goes_on()


def with_settings_of_a_stranger(folder, device, noise):
    """A path in a process whose environment names a folder with commands for ngspice."""
    (folder / "scripts").mkdir()
    (folder / "scripts" / "spinit").write_text(f"option temp=150\nshell touch {folder / 'ran'}\n")
    os.environ |= {"SPICE_LIB_DIR": str(folder), "SPICE_SCRIPTS": str(folder / "scripts")}
    return worker.path_in_this_process(device, noise)


def test_a_folder_that_the_environment_names_is_not_read(tmp_path):
    """ngspice ran the commands there, those of a shell as well, and a temperature of 150 degrees was silent."""
    one = device(load_circuit(Load(netlist="bridge")))
    process = processes.create()
    try:
        path = process.submit(with_settings_of_a_stranger, tmp_path, one, NOISE).result(120)
    finally:
        processes.kill(process)
    assert (path.samples == run(one.load).samples).all()
    assert not (tmp_path / "ran").exists()


def at_another_temperature(folder, device, noise):
    """A path where ngspice begins with another temperature, from a file that only C knows of."""
    (folder / "scripts").mkdir()
    (folder / "scripts" / "spinit").write_text("option temp=150\noption tnom=60\n")
    ctypes.CDLL(None).setenv(b"SPICE_LIB_DIR", os.fsencode(folder), 1)
    return worker.path_in_this_process(device, noise)


@pytest.mark.thorough("test_a_folder_that_the_environment_names_is_not_read")
def test_the_temperature_stands_in_the_circuit(tmp_path):
    one = device(load_circuit(Load(netlist="bridge")))
    process = processes.create()
    try:
        path = process.submit(at_another_temperature, tmp_path, one, NOISE).result(120)
    finally:
        processes.kill(process)
    assert (path.samples == run(one.load).samples).all()


def in_this_very_process(folder):
    """If jobs of `ngspice_here` run, before and after one that fails, from a folder and a home with commands."""
    os.chdir(folder)
    os.environ["HOME"] = str(folder)
    pids = []
    with ngspice_here() as here:
        path = next(map_in_workers(worker.path_in_this_process, [(device(GOOD), NOISE)]))
        pids += map_in_workers(os.getpid, [()])
        sound = here.trusted
        with pytest.raises(CircuitError, match="refused"):
            next(map_in_workers(worker.path_in_this_process, [(device(REFUSED), NOISE)]))
        pids += map_in_workers(os.getpid, [()])
    pids += map_in_workers(os.getpid, [()])
    places = Path.cwd(), Path(os.environ["HOME"])
    return path.samples, [pid == os.getpid() for pid in pids], (sound, here.trusted), places


def test_a_worker_runs_ngspice_itself_until_it_fails(tmp_path):
    """With the same path to the last digit; the content of its current folder, or its home, is not run."""
    (tmp_path / ".spiceinit").write_text("shell touch ran\n")
    process = processes.create()
    try:
        readings, same, sound, places = process.submit(in_this_very_process, tmp_path).result(120)
    finally:
        processes.kill(process)
    assert (readings == run(GOOD).samples).all()
    assert (same, sound, places) == ([True, False, False], (True, False), (tmp_path, tmp_path))
    assert not (tmp_path / "ran").exists()


@pytest.mark.thorough("test_a_crash_is_an_error_of_that_run_only")
def test_a_worker_killed_while_idle_is_no_error():
    pids = list(map_in_workers(os.getpid, [()] * worker.worker_count()))
    for pid in set(pids):
        os.kill(pid, signal.SIGKILL)
    threading.Event().wait(0.5)
    goes_on()


def test_jobs_beside_a_failing_one_are_not_lost():
    """What was asked for before the failing job is there; of two iterations, the other one is not touched."""
    good = device(GOOD)
    beside = map_in_workers(worker.path_in_this_process, [(good, NOISE)] * 6)
    first = next(beside)
    jobs = map_in_workers(
        worker.path_in_this_process, [(good, NOISE), (device(REFUSED), NOISE), (good, NOISE)]
    )
    assert (next(jobs).samples == first.samples).all()
    with pytest.raises(CircuitError):
        next(jobs)
    assert [(path.samples == first.samples).all() for path in beside] == [True] * 5


@pytest.mark.thorough("test_after_a_fatal_error_a_process_runs_nothing_else")
@pytest.mark.parametrize(
    "bad, says",
    [
        (REFUSED, r"refused the circuit: .*'nosuch'.*d\.xload\.d1"),
        (FATAL, "refused the circuit: .*"),
    ],
    ids=["model", "fatal"],
)
def test_a_refused_circuit_then_a_good_one(bad, says):
    """ngspice does not recover from a circuit that it cannot read: its process is replaced."""
    for _ in range(2):
        with pytest.raises(CircuitError, match=says) as caught:
            run(bad)
    goes_on()
    assert str(caught.value).isprintable()


def test_after_a_fatal_error_a_process_runs_nothing_else():
    """In one process: the error of the second run states that ngspice has ended and why, not that
    its circuit is wrong."""

    def twice(first, second):
        try:
            worker.path_in_this_process(*first)
        except CircuitError:
            return worker.path_in_this_process(*second)
        return None

    good, bad = (device(load) for load in (GOOD, FATAL))
    with pytest.raises(
        CircuitError, match=r"failed earlier .* another circuit: ngspice refused the circuit: ."
    ):
        list(map_in_workers(twice, [((bad, NOISE), (good, NOISE))]))
    goes_on()


def test_a_hang_is_a_named_error():
    """A circuit far faster than the vibration needs steps so short that it would need years."""
    with pytest.raises(
        CircuitError,
        match=r"stopped at .* came no further than that in 1 s, with steps of \S+e-(09|1)",
    ):
        run(HANG, patience=1.0)
    goes_on()


@pytest.mark.thorough("test_a_hang_is_a_named_error")
def test_a_crawl_is_a_hang():
    """A circuit so fast that a kick needs some seconds: it would end next week."""
    fast = 2.0 * np.pi * 3e4 * WEAK.frequency / 0.1  # so many periods to a kick
    with pytest.raises(CircuitError, match="came no further than that in 2 s"):
        run(
            circuit(
                f"Bfast x 0 V=sin({fast:.3g}*time)", "Rfast x y 1", f"Cfast y 0 {1.0 / fast:.3g}"
            ),
            patience=2.0,
        )
    goes_on()


@pytest.mark.thorough("test_a_budget_that_is_too_small")
def test_a_deadline_ends_a_run():
    """A circuit that gets on, but slowly: the error has the means so far, and the process is replaced."""
    slow = circuit(*(f"B{k} a{k} 0 V=sin({k}*time)*v(p)\nR{k} a{k} 0 1k" for k in range(100)))
    begin = time.monotonic()
    seeds = [np.random.SeedSequence(k) for k in range(3)]
    says = r"stopped at \S+ s of \S+ s: the `budget` left it [1-4]\S* s; to its end it would need about .{1,15}: give"
    with pytest.raises(OutOfTimeError, match=says) as caught:
        list(worker.measure_in_workers(device(slow), seeds, 1_000_000, 0.0, deadline=begin + 4.0))
    assert time.monotonic() - begin < 6.0
    assert caught.value.so_far is not None and min(caught.value.so_far) > 0.0
    goes_on()


FAILING = [
    (
        circuit("v.xload.v1 p 0 1", "v.xload.v2 p 0 2"),
        r"at 5e-14 s of .* no single solution at .*'v\d'.*; give every node",
    ),
    (
        circuit("b.xload.b1 p 0 I=1/(v(p)-0.01)"),
        r"at \S+e-12 s of .* did not converge at the (piezo's terminal|current of the piezo) .*; lower `dt`, or,",
    ),
    (
        circuit(
            "b.xload.b1 xload.a 0 I=1/(v(xload.a)-0.01)",
            "r.xload.r1 p xload.a 1",
            "c.xload.c1 xload.a 0 1n",
        ),
        r"did not converge at node 'a' even with .*; lower `dt`, or,",
    ),
    (
        circuit("b.xload.b1 p 0 I=-1m*v(p)*abs(v(p))"),
        r"at 0\.00\d+ s of 2\S+ s: it did not converge at the (current of|piezo's terminal)",
    ),
]


@pytest.mark.thorough("test_a_crash_is_an_error_of_that_run_only")
@pytest.mark.parametrize("load, says", FAILING, ids=["sources", "pole", "inner-pole", "runaway"])
def test_failure_to_converge_names_node_and_time_and_a_way_out(load, says):
    with pytest.raises(CircuitError, match=says) as caught:
        run(load)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 500


def resident(device, runs):
    """Resident memory (bytes) of a process at a third of its short runs and at their end."""
    found = []
    for k in range(runs):
        worker.path_in_this_process(device, NOISE[:8])
        if k in (runs // 3, runs - 1):
            found.append(
                int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
            )
    return found


@pytest.mark.thorough("nothing: memory is looked at over many runs")
@pytest.mark.parametrize(
    "load", [Load(resistance=1e6), Load(netlist="bridge")], ids=["resistor", "bridge"]
)
def test_memory_does_not_grow_with_the_runs(load):
    one = device(load_circuit(load))
    before, after = next(map_in_workers(resident, [(one, 1000)]))
    assert after - before < 2e6
