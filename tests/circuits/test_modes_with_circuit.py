"""Modes with circuits: compiled resistors against the exact update, and ideal circuits against compiled ones."""

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.circuits.idealised import ideal_circuit
from harvester.circuits.probed_path import powers_of_elements
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.trace import trace
from tests.support.systems import BEAM, SECOND, THIRD

STOP = hv.Stop(restitution=0.5, gap="0.05 mm")


@pytest.mark.thorough("test_one_netlist")
@pytest.mark.slow
@pytest.mark.parametrize("change", [{}, {"stop": STOP}], ids=["free", "stop"])
def test_resistor(change):
    """Trajectories on the same noise have the same V^2, x^2 and impacts as with the exact update of a resistor."""
    scene = BEAM.replace(mode=(SECOND, THIRD), **change)
    netlist = Problem(
        scene.replace(load=hv.Load(netlist="resistor", parameters={"R": scene.load.resistance}))
    )
    seed = np.random.SeedSequence(5)
    h = 0.01
    exact = Trajectories(Problem(scene).equations, 64, seed, h, controlled=True)
    circuit = compiled_circuit(netlist.circuit, netlist.scales)
    own = Trajectories(netlist.equations, 64, seed, h, circuit=circuit, controlled=True)
    mine, theirs = own.run(20.0), exact.run(20.0)
    for name in ("V2", "x2", "impacts", "impact_loss"):
        assert getattr(mine, name) == pytest.approx(getattr(theirs, name), rel=0.01, abs=1e-12), (
            name
        )
    # of an integral, and of samples
    assert mine.load.mean() == pytest.approx(circuit.mu * mine.V2.mean(), rel=0.03)
    assert own.snapshot() == pytest.approx(
        exact.snapshot(), rel=0.02, abs=0.02 * np.abs(exact.snapshot()).max()
    )
    assert (mine.impacts.max() > 0.0) == bool(change)
    martingales = mine.controls[:, ::2]
    # of mean zero
    assert (np.abs(martingales.mean(axis=0)) <= 4.5 * martingales.std(axis=0) / 8.0).all()


MAGNIFIER = {"magnifier": hv.Magnifier(mass="20 g", stiffness="4 N/mm"), "mode": ()}


@pytest.mark.thorough("test_one_netlist")
@pytest.mark.slow
@pytest.mark.parametrize("name, change", [("bridge", {"stop": STOP}), ("doubler", MAGNIFIER)])
def test_ideal_circuit(name, change):
    """An ideal circuit gives the compiled one's power on the same noise, but for what ideal elements leave out."""
    scene = BEAM.replace(load=hv.Load(netlist=name)).replace(**change)
    problem = Problem(scene)
    seed = np.random.SeedSequence(5)
    h = 0.01
    ideal = ideal_circuit(problem.circuit, problem.scales)
    loads = []
    for circuit in (ideal, compiled_circuit(problem.circuit, problem.scales)):
        many = Trajectories(problem.equations, 64, seed, h, circuit=circuit, controlled=True)
        many.run(40.0)
        loads.append(many.run(20.0).load)
    assert loads[0].mean() > 0.0
    assert loads[0].mean() == pytest.approx(loads[1].mean(), rel=0.03)


@pytest.mark.slow
@pytest.mark.thorough("test_one_netlist")
def test_a_low_voltage_of_sece_is_told():
    """At 0.7 V rms ideal diodes and switches give far too much power, with one mode too, and the answer states so."""
    scene = BEAM.replace(mode=(), stop=STOP).with_load(
        netlist="sece", parameters={"R": "1 Mohm", "C": "20 nF"}
    )
    found = hv.run(scene, "ideal", trajectories=64, duration=0.2)
    assert any("V rms, comparable to the diode" in str(one) for one in found.warnings)
    loud = scene.replace(
        excitation=hv.Excitation(acceleration_psd="0.1 g^2/Hz"), stop=STOP.replace(gap="1 mm")
    )
    assert not any(
        "V rms, comparable" in str(one)
        for one in hv.run(loud, "ideal", trajectories=64, duration=0.2).warnings
    )


def test_a_path_with_a_resistor_as_a_netlist():
    """The path of three modes with a stop is that of the exact update, and Rload dissipates V^2/R."""
    scene = BEAM.replace(mode=(SECOND, THIRD), stop=STOP)
    netlist = Problem(
        scene.replace(load=hv.Load(netlist="resistor", parameters={"R": scene.load.resistance}))
    )
    h = 0.005
    noise = np.random.default_rng(4).standard_normal(8000)
    exact = trace(Problem(scene).equations, noise, h, 4)
    circuit = compiled_circuit(netlist.circuit, netlist.scales)
    path = circuit.trace(netlist.equations, noise, h, 4, keep=True)
    assert len(path.impacts) == len(exact.impacts) > 1
    for name in ("samples", "coordinates"):
        mine, theirs = getattr(path, name), getattr(exact, name)
        assert np.abs(mine - theirs).max() < 0.01 * np.abs(theirs).max(), name
    assert path.lost == pytest.approx(exact.lost, rel=0.01)
    seconds = len(noise) * h / netlist.scales.frequency
    given = powers_of_elements(circuit, path.states)["rload"]
    assert given == pytest.approx((path.V * circuit.scales.volts) ** 2 / circuit.resistance)
    taken = path.square[-1] / circuit.resistance / seconds
    volts = exact.samples[:, [1, 4]] * netlist.scales.volts
    assert taken == pytest.approx((volts**2).mean() / circuit.resistance, rel=0.02)


@pytest.mark.ngspice
def test_probes_of_two_modes():
    """The probe of the load is the answer's power, and v(p) squared its mean square voltage, within their errors."""
    scene = BEAM.replace(mode=(SECOND,), load=hv.Load(netlist="bridge"))
    options = {"trajectories": 64, "duration": "0.2s", "dt": "0.1 ms"}
    answer = hv.Compiled(probe=("p(load)", "v(p)"), ledger=True, **options).run(scene)
    load, piezo = (answer.probes[name] for name in ("p(load)", "v(p)"))
    power = answer.mean_power
    assert abs(load.mean.value - power.value) < 4.0 * power.stderr + 0.03 * power.value
    assert piezo.rms.value**2 == pytest.approx(answer.mean_square_voltage.value, rel=0.2)
    diodes = [value for key, value in answer.details.items() if key.startswith("ledger_circuit_d")]
    assert 0.0 < sum(value for value in diodes if np.isfinite(value)) < power.value


@pytest.mark.thorough("test_one_netlist")
@pytest.mark.slow
def test_two_modes_with_an_ideal_bridge_swing_as_with_the_compiled_one():
    """The path that engine `ideal` continues, and the periodic response of `compiled`: RMS and peaks."""
    drive = hv.Excitation(acceleration_amplitude="0.5 g", frequency="50 Hz")
    load = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
    scene = BEAM.replace(mode=(SECOND,), excitation=drive, load=load)
    ideal, compiled = (
        engine.run(scene).details for engine in (hv.Ideal(), hv.Compiled(judged=False))
    )
    for name in ("displacement_rms", "displacement_amplitude", "voltage_amplitude"):
        assert ideal[name] == pytest.approx(compiled[name], rel=3e-4)
