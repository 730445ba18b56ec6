"""Several modes in lock-step with ngspice: the path of the ensemble, and one netlist of modes and circuit."""

import math
import re
import subprocess

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation.lockstep.energy_ledger import ledger_of
from harvester.cosimulation.runs import CoupledDevice, new_drive, run_in_this_process
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.noise import three_point_grid
from harvester.mechanics.trace import trace
from tests.support.systems import BEAM, SECOND, THIRD

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]
THOROUGH = pytest.mark.thorough("test_one_netlist")
RIGID = hv.Stop(restitution=0.5, gap="0.02 mm")
BALL = hv.Ball(mass="2 g", room="0.1 mm", restitution=0.5, tilt=30.0)
DRIVE = hv.Excitation(acceleration_amplitude="0.5 g", frequency="45 Hz")
UNDER = hv.Magnifier(
    mass="30 g", stiffness="4 N/mm", damping="0.5 N s/m", restitution=0.4, gap="0.02 mm"
)


def _lockstep(scene, h, steps, reltol=1e-4):
    """Path, ledger and the energy that the load dissipated up to each kick (J), in ngspice."""
    problem = Problem(scene)
    noise = three_point_grid(np.random.SeedSequence(3), steps)
    device = CoupledDevice(
        problem.equations, problem.scales, problem.circuit, h, 5, patience=1e9, reltol=reltol
    )
    drive = run_in_this_process(device, new_drive(device, noise, 0.0))
    state = drive.state[0]
    return (
        drive.path(),
        ledger_of(state, problem.scales, drive.smoothing, problem.circuit.linear),
        drive.kicked[:, 4],
    )


@pytest.mark.thorough("test_one_netlist")
@pytest.mark.parametrize(
    "change",
    [
        {"stop": RIGID},
        {"stop": RIGID, "excitation": DRIVE},
        {"stop": hv.Stop(stiffness="2e4 N/m", damping="5 N s/m", gap="0.02 mm")},
        {"mode": (), "magnifier": UNDER},
        {"mode": (), "ball": BALL},
    ],
    ids=["noise", "drive", "compliant", "magnifier", "ball"],
)
def test_path_of_the_ensemble(change):
    """With a resistor ngspice's modes move as those of the exact update, and the energy ledger closes."""
    scene = BEAM.replace(mode=(SECOND, THIRD)).replace(**change)
    h = 0.01
    steps = 3000
    ((found, ledger, _),) = map_in_workers(_lockstep, [(scene, h, steps)])
    expected = trace(
        Problem(scene).equations, three_point_grid(np.random.SeedSequence(3), steps), h, 5
    )
    assert len(expected.impacts) > 2
    # where impacts accumulate, rounding makes the last
    assert abs(len(found.impacts) - len(expected.impacts)) <= 2
    size = np.abs(expected.V).max()
    # before impacts have made much of a last digit
    assert np.abs(found.V[:100] - expected.V[:100]).max() < 1e-3 * size
    assert (found.V**2).mean() == pytest.approx((expected.V**2).mean(), rel=5e-3)
    assert ledger.impacts > 0.0
    assert abs(ledger.residual) < 5e-3


@pytest.mark.thorough("test_one_netlist")
def test_motion_of_several_modes():
    """Command `motion` by ngspice shows the path that engine `ensemble` has on the same noise, impacts included."""
    scene = BEAM.replace(mode=(SECOND, THIRD), stop=RIGID)
    found, expected = (
        hv.motion(scene, engine, "0.2 s", seed=2, from_rest=True)
        for engine in ("spice", "ensemble")
    )
    for name in ("displacement", "voltage"):
        one, other = getattr(found, name), getattr(expected, name)
        assert np.abs(one - other)[:200].max() < 3e-3 * np.abs(other).max(), name
    assert len(found.impacts) == pytest.approx(len(expected.impacts), abs=2)
    assert len(found.impacts) > 2


POWER = "@r.xload.rload[p]"


def _one_netlist(scene, begin, end, step, vectors=(POWER,)):
    """The means of vectors from ``begin`` to ``end`` (s), with each mode as a loop of ngspice's elements.

    1 V is a force of 1 N and 1 A a speed of 1 m/s; all loops share the piezo's capacitance.
    """
    problem = Problem(scene)
    circuit = problem.circuit
    first = scene.oscillator
    piezo = scene.piezo
    drive = scene.excitation
    modes = [(first.mass, first.frequency, first.damping_ratio, piezo.coupling, 1.0)]
    modes += [
        (one.mass, one.frequency, one.damping_ratio, one.coupling, one.base) for one in scene.mode
    ]
    lines = ["bench", circuit.text, f"Cpiezo p 0 {piezo.capacitance!r}"]
    for k, (mass, frequency, ratio, coupling, base) in enumerate(modes):
        w = 2.0 * math.pi * frequency
        push = mass * base * drive.acceleration_amplitude
        lines += [
            f"Vforce{k} a{k} 0 SIN(0 {push!r} {drive.frequency!r} 0 0 90)",
            f"Lmass{k} a{k} b{k} {mass!r}",
            f"Rdamping{k} b{k} c{k} {2.0 * ratio * w * mass!r}",
            f"Cspring{k} c{k} d{k} {1.0 / (mass * w * w)!r}",
            f"Epiezo{k} d{k} e{k} p 0 {coupling!r}",
            f"Vspeed{k} e{k} 0 0",
            f"Fpiezo{k} 0 p Vspeed{k} {coupling!r}",
        ]
    lines += [".options method=trap reltol=1e-6 abstol=1e-14 vntol=1e-9 chgtol=1e-17"]
    lines += [
        f".save {' '.join(vectors)}",
        f".tran {step} {end} {begin} {step} uic",
        ".control",
        "run",
    ]
    lines += [
        f"meas tran found{k} AVG {vector} from={begin} to={end}" for k, vector in enumerate(vectors)
    ]
    lines += [".endc", ".end"]
    text = "\n".join(lines)
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"], input=text, capture_output=True, text=True, timeout=300
    )
    return [float(found) for found in re.findall(r"^found\d+\s*=\s*(\S+)", done.stdout, re.M)]


@pytest.mark.parametrize(
    "name, fine", [("bridge", 400), pytest.param("sece", 1000, marks=THOROUGH)]
)
def test_one_netlist(name, fine):
    """Three modes in lock-step under a sinusoid give the power of one netlist of modes and circuit within 0.1 %.

    A period of the sinusoid is ``fine`` steps.
    """
    amplitude = hv.Excitation(acceleration_amplitude="0.5 g", frequency="50 Hz")
    scene = BEAM.replace(mode=(SECOND, THIRD), excitation=amplitude)
    scene = scene.replace(load=hv.Load(netlist=name, parameters={"R": "1 Mohm", "C": "20 nF"}))
    seconds = 0.4
    w0 = Problem(scene).scales.frequency
    h = w0 / (50.0 * fine)
    steps = round(seconds * 50.0 * fine)
    ((_, _, energy),) = map_in_workers(_lockstep, [(scene, h, steps, 1e-6)])
    ours = (energy[-1] - energy[steps // 2 - 1]) / (0.5 * seconds)
    (expected,) = _one_netlist(scene, 0.5 * seconds, seconds, 2e-6)
    assert ours == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("engine", ["compiled", "spice"])
def test_the_periodic_response_of_two_modes_with_a_bridge(engine):
    """Its power, its probes and the powers of its diodes are those of one netlist of modes and circuit."""
    drive = hv.Excitation(acceleration_amplitude="0.5 g", frequency="50 Hz")
    scene = BEAM.replace(mode=(SECOND,), excitation=drive)
    scene = scene.replace(load=hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"}))
    answer = hv.run(scene, engine, within="0.1%", probe=("store", "p(load)"), ledger=True)
    assert answer.details["response_periods"] == 1.0
    names = ("d1", "d2", "d3", "d4")
    vectors = (POWER, "v(xload.a)", "v(xload.b)", *(f"@d.xload.{name}[p]" for name in names))
    power, high, low, *diodes = _one_netlist(scene, 2.0, 2.2, 8e-6, vectors)
    assert answer.mean_power.value == pytest.approx(power, rel=1e-3)
    assert answer.mean_power.known_error95 < 1e-3 * power
    assert answer.probes["p(load)"].mean.value == pytest.approx(power, rel=1e-3)
    assert answer.probes["store"].mean.value == pytest.approx(high - low, rel=1e-3)
    for name, expected in zip(names, diodes, strict=True):
        assert answer.details[f"ledger_circuit_{name}"] == pytest.approx(expected, rel=0.02)
    # the compiled circuit has the powers of its elements alone
    assert abs(answer.details.get("ledger_residual", 0.0)) < 1e-3


RECTIFIER = hv.Load(netlist="bridge", parameters={"R": "300 kohm", "C": "50 nF"})


@pytest.mark.thorough("test_one_netlist")
@pytest.mark.parametrize(
    "change",
    [
        {"mode": (SECOND, THIRD), "stop": RIGID},
        {"mode": (), "magnifier": UNDER.replace(restitution=None, gap=None)},
        {"oscillator": BEAM.oscillator.replace(damping_v="0.2 kg/m")},
    ],
    ids=["stop", "magnifier", "quadratic"],
)
def test_periodic_responses_by_both_engines(change):
    """Modes with a stop, on a magnifier and with quadratic damping repeat alike in ngspice and in its compiled twin."""
    scene = BEAM.replace(mode=(SECOND,), load=RECTIFIER).replace(excitation=DRIVE, **change)
    found, expected = (hv.run(scene, name, within="0.5%") for name in ("spice", "compiled"))
    assert found.details["response_periods"] == expected.details["response_periods"]
    apart = abs(found.mean_power.value - expected.mean_power.value)
    assert apart < found.mean_power.known_error95 + expected.mean_power.known_error95
    assert found.mean_power.known_error95 < 0.01 * expected.mean_power.value


@pytest.mark.thorough("test_one_netlist")
def test_a_response_of_three_modes_to_a_sinusoid():
    """The mean of runs, asked for in place of the periodic response, is that of one netlist, within its error."""
    drive = hv.Excitation(acceleration_amplitude="0.5 g", frequency="50 Hz")
    scene = BEAM.replace(mode=(SECOND, THIRD), excitation=drive)
    scene = scene.replace(load=hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"}))
    found = hv.run(scene, "spice", trajectories=2, duration="0.2 s").mean_power
    (expected,) = _one_netlist(scene, 2.0, 2.2, 8e-6)
    assert abs(found.value - expected) < found.known_error95 + 3e-4 * expected
    assert found.known_error95 < 2e-3 * expected
