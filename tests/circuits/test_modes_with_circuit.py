"""Modes with circuits: compiled resistors against the exact update, and ideal circuits against compiled ones."""

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.circuits.idealised import ideal_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
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
    """At 0.7 V rms ideal diodes and switches give far too much power, with one mode too, and the answer says so."""
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
