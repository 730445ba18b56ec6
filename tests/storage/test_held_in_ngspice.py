"""The rectifier of a custom netlist beside ngspice's, with the storage capacitor held at two
voltages."""

import dataclasses
import time

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.cosimulation import worker_pool
from harvester.equations.problem import Problem
from harvester.errors import MissingProgramError
from harvester.netlists.load_circuit import netlist_folder
from harvester.storage import held_in_ngspice
from harvester.storage.held_in_ngspice import HELD, current_difference, error_of_circuit, held_load
from harvester.storage.measured_current import JUDGE, JUDGE_OF_RECTIFIERS, measured
from tests.support.bursts import on_record
from tests.support.own_board import noisy_node, without_node
from tests.support.paths import EXAMPLES
from tests.support.systems import SECOND

DRIVE = hv.Excitation(frequency=46.0, acceleration_amplitude="0.25 g")
STOP = hv.Stop(gap=2e-4, restitution=0.7)


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "excitation, stop, mode",
    [
        (DRIVE, None, ()),
        (None, None, ()),
        (None, STOP, ()),
        (DRIVE, None, (SECOND,)),
        (None, None, (SECOND,)),
    ],
)
def test_the_boards_diodes_give_what_they_do_in_ngspice(excitation, stop, mode):
    """At half and 0.9 of 3 V, to less than the assumption about the package's own netlists, and not
    to the last digit."""
    scene = noisy_node(unlike=True, excitation=excitation, stop=stop).replace(mode=mode)
    problem = Problem.of(scene)
    assert 1e-6 < current_difference(problem, 3.0) < JUDGE


@pytest.mark.ngspice
@pytest.mark.parametrize(
    "name, volts", [("bimorph_ltc3588", 4.0), ("bimorph_bq25570", 3.0), ("bimorph_node", 3.0)]
)
def test_packaged_rectifiers_give_what_they_do_in_ngspice(name, volts):
    """The difference is at most half of the assumption about them."""
    problem = Problem.of(hv.load(EXAMPLES / f"{name}.toml"))
    assert 1e-6 < current_difference(problem, volts) < 0.5 * JUDGE_OF_RECTIFIERS


@pytest.mark.ngspice
@pytest.mark.parametrize("excitation", [DRIVE, None])
def test_a_compiled_circuit_of_other_diodes_is_told(excitation, monkeypatch):
    """Those of the packaged bridge beside ngspice with the board's: the difference is that of their mean currents."""
    scene = noisy_node(excitation=excitation)
    board = Problem.of(scene)
    other = noisy_node(excitation=excitation, load=hv.Netlist("bridge", Is="1 pA", N=1.0))
    other = Problem.of(other)
    assert board.circuit is not None and other.circuit is not None

    def compiled(load, scales):
        return compiled_circuit(held_load(other.circuit, HELD * scales.capacitance), scales)

    monkeypatch.setattr(held_in_ngspice, "compiled_circuit", compiled)
    found = current_difference(board, 3.0)
    ours, its = (
        float(measured(one, top=2.7, count=2, runs=1024).best.current[-1]) for one in (board, other)
    )
    expected = abs(ours / its - 1.0)
    assert expected > 0.02
    assert 0.5 * expected < found < 2.0 * expected + 0.02


@pytest.mark.ngspice
def test_of_a_chip_the_rectifier_alone_is_run():
    """The package's LTC3588 as a file of one's own states the same as by its name, with a total error."""
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml")
    load = hv.Load(
        netlist=str(netlist_folder() / "ltc3588.cir"), parameters=dict(scene.load.parameters)
    )
    own = dataclasses.replace(scene, load=load)
    names = [part.name for part in held_load(Problem.of(own).circuit, 1e-3).parts]
    assert names == ["xchip.d1", "xchip.d2", "xchip.d3", "xchip.d4", "csmooth", "rload"]
    mine, its = (hv.run(one, "slow").mean_power for one in (own, scene))
    assert mine.value == pytest.approx(its.value, rel=1e-6)
    assert its.error95 <= mine.error95 < 1.2 * its.error95


@pytest.mark.ngspice
def test_a_board_charges_as_a_bridge_of_its_diodes_with_a_whole_error():
    alike = hv.Netlist("bridge", Is=1e-6, N=1.05, R="10 Mohm", C="100 uF")
    scenes = [without_node(noisy_node(excitation=DRIVE, **load)) for load in ({}, {"load": alike})]
    own, bridge = (hv.charge(scene, to="3 V", engine="slow").time for scene in scenes)
    assert own.error95 is not None and abs(own.value - bridge.value) < own.error95 + bridge.error95


def test_ngspice_ends_at_the_deadline(monkeypatch):
    """After it no run begins; before, each of them has the remainder."""
    latest = []

    def kept(function, jobs):
        latest.extend(job[3] - time.monotonic() for job in jobs)
        return [(1.0, 1.0) for _ in jobs]

    monkeypatch.setattr(worker_pool, "map_in_workers", kept)
    problem = Problem.of(noisy_node(unlike=True, excitation=DRIVE))
    unknown = JUDGE, "the difference from ngspice"
    assert error_of_circuit(problem, 3.0, deadline=time.perf_counter() - 1.0) == unknown
    assert latest == []
    assert error_of_circuit(problem, 3.0, deadline=time.perf_counter() + 5.0) == (
        JUDGE_OF_RECTIFIERS,
        "",
    )
    assert latest and max(latest) <= 5.0


@pytest.mark.slow
def test_without_ngspice_that_part_is_not_known(monkeypatch):
    def missing(*_):
        raise MissingProgramError("no ngspice here")

    monkeypatch.setattr(worker_pool, "map_in_workers", missing)
    scene = noisy_node(excitation=DRIVE)
    assert error_of_circuit(Problem.of(scene), 3.0) == (JUDGE, "the difference from ngspice")
    found = hv.node(scene, days=0.01)
    assert found.harvested.error95 is None and "the difference from ngspice" in str(found.harvested)
    charge = hv.charge(without_node(scene), to="3 V", engine="slow")
    assert charge.time.error95 is None and charge.time.known_error95 > 0.0
    packaged = noisy_node(excitation=DRIVE, load=hv.Netlist("bridge"))
    assert error_of_circuit(Problem.of(packaged), 3.0) == (JUDGE_OF_RECTIFIERS, "")


@pytest.mark.thorough("test_of_a_chip_the_rectifier_alone_is_run")
@pytest.mark.ngspice
def test_on_a_record_a_piece_of_it_is_run(tmp_path):
    """A recorded tone: the node states a total error, and its harvest is that of the bridge of such diodes."""
    t = np.arange(0.0, 4.0, 0.002)
    shaken = on_record(tmp_path, t, 2.0 * np.sin(2.0 * np.pi * 46.0 * t)).excitation
    own = hv.node(noisy_node(excitation=shaken), days=0.01).harvested
    bridge = hv.node(
        noisy_node(excitation=shaken, load=hv.Netlist("bridge", Is=1e-6, N=1.05)), days=0.01
    ).harvested
    assert own.error95 is not None and own.error95 < 0.1 * own.value
    assert abs(own.value - bridge.value) < own.error95 + bridge.error95
