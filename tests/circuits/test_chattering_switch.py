"""A switch without hysteresis that opens what closes it: no step resolves it, and it is refused."""

import dataclasses
import importlib
import sys
import time

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.circuit_path import trace_circuit
from harvester.circuits.substeps import FINEST, MOST_CHANGES
from harvester.engines.compiled import Compiled
from harvester.equations.problem import Problem
from harvester.machine.cores import cores
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.netlists import PLATE, compiled, on_plate
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
netlist_fuzz = importlib.import_module("netlist_fuzz")

CHATTERING = """Rx x n 200k
S1 p x x n relay off
Rload p n 500k
.model relay sw(ron=4 roff=8Meg vt=-0.05{})"""
WHY = "switch s1 of the netlist opens and closes too often for the shortest step"


def strong(folder, hysteresis=""):
    """The plate, which gives some volts, with the switch."""
    return on_plate(folder, CHATTERING.format(hysteresis))


def test_a_switch_that_chatters_is_refused_along_a_trajectory(tmp_path):
    scene = strong(tmp_path)
    noise = np.random.default_rng(0).normal(size=300)
    with pytest.raises(hv.SimulationError, match=WHY):
        compiled(scene).trace(Problem.of(scene).equations, noise, 0.1)


def test_a_batch_ends_as_soon_as_the_failures_are_too_many(tmp_path):
    """The whole run would last ten minutes."""
    scene = strong(tmp_path)
    eqs = Problem.of(scene).equations
    runs = Trajectories(eqs, 128, np.random.SeedSequence(1), 0.1, circuit=compiled(scene))
    with pytest.raises(hv.SimulationError, match=WHY):
        runs.run(2000.0)


@pytest.mark.parametrize("drive", [{}, {"frequency": "3.2 Hz", "acceleration_amplitude": "0.1 g"}])
def test_the_engine_refuses_it_in_one_line(tmp_path, drive):
    scene = strong(tmp_path)
    if drive:
        scene = dataclasses.replace(scene, excitation=hv.Excitation(**drive))
    with pytest.raises(hv.SimulationError, match=f"{WHY}: give its model a hysteresis"):
        Compiled(budget="5s").run(scene)


def test_a_hysteresis_larger_than_the_jump_is_the_remedy(tmp_path):
    """The same switch with a hysteresis beyond the voltages: it changes seldom, and no step fails."""
    scene = strong(tmp_path, " vh=3")
    noise = np.random.default_rng(0).normal(size=300)
    path = compiled(scene).trace(Problem.of(scene).equations, noise, 0.1)
    assert path.failed == 0
    assert path.steps < 1e-3 * FINEST * 300


def test_a_drift_of_a_switch_that_chatters_is_bounded(tmp_path):
    """At most so many changes in each sixteenth of a drift, of `FINEST` shortest steps each."""
    scene = strong(tmp_path)
    circuit = compiled(scene)
    noise = np.random.default_rng(0).normal(size=300)
    path = trace_circuit(
        Problem.of(scene).equations, circuit.for_kernels(0.1), circuit.rest, noise, 0.1
    )
    assert 0 < path.failed < 17 * (MOST_CHANGES + 1) * 300
    assert path.steps < 0.1 * FINEST * 300


OSCILLATOR = """* a switch that discharges a capacitor a million times a second
.subckt board p n
V1 s n 5
R1 s c 10k
C1 c n 100p
S1 c n c n relay off
Rload p n 1Meg
.model relay sw(ron=100 roff=1G vt=2 vh=1)
.ends board
"""


# below the bound of chatter: some ten thousand steps of the circuit in each of the mass
SLOWER = OSCILLATOR.replace("C1 c n 100p", "C1 c n 300p")
# the same from the moment at which a supply has risen, a tenth of the first window later
LATE = SLOWER.replace("R1 s c 10k", "R0 s d 10k\nC0 d n 10u\nS2 s r d n start\nR1 r c 10k").replace(
    ".ends", ".model start sw(ron=1 roff=1G vt=4 vh=0.1)\n.ends"
)


@pytest.mark.parametrize("text", [SLOWER, LATE], ids=["from the start", "later"])
def test_an_oscillator_that_no_budget_suffices_for_is_refused_within_it(tmp_path, text):
    """In CPU time, a core each, of a second call, whose kernels are compiled."""
    path = tmp_path / "board.cir"
    path.write_text(text)
    scene = PLATE.with_load(netlist=str(path))
    for _ in range(2):
        begin = time.process_time()
        with pytest.raises(hv.SimulationError, match=r"would need .* a `budget` of more than"):
            Compiled(budget="5s").run(scene)
    assert (time.process_time() - begin) / cores() < 1.5 * 5.0


def test_a_circuit_that_oscillates_only_at_first_keeps_its_budget(tmp_path):
    """Until a capacitor is charged, after half a step of the mass: that is not its pace."""
    path = tmp_path / "board.cir"
    until = LATE.replace("S2 s r d n start", "S2 s r n d start").replace("10u", "100n")
    path.write_text(until.replace("vt=4", "vt=-4"))
    answer = Compiled(budget="5s", judged=False).run(PLATE.with_load(netlist=str(path)))
    assert answer.mean_power.value > 0.0


def test_the_fuzzer_states_that_an_answer_does_not_end(tmp_path):
    """Reading lasts milliseconds, and 60 ms of the answer one second: the limit is on both."""
    answer, kind = netlist_fuzz.ours(OSCILLATOR, tmp_path, compiled=True)
    assert answer.given and not kind
    answer, kind = netlist_fuzz.ours(OSCILLATOR, tmp_path, compiled=True, patience=0.2)
    assert kind == "DOES NOT END"
    assert not answer.given
