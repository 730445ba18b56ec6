"""A netlist cut behind its rectifier: what is on which side, and netlists that cannot be cut."""

import pytest

import harvester as hv
from harvester.circuits.idealised import ideal_circuit
from harvester.equations.problem import Problem
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from harvester.storage.rectifier_cut import (
    cut_behind_rectifier,
    held_rectifier,
    is_plain_store,
    plain_bridge,
)
from tests.support.netlists import BRIDGE, PLATE, STORE, on_plate

LAW = ".model own D(Is=2.52n N=1.752)\n"
BOARD = BRIDGE.format("own") + STORE + LAW
OTHERS = {
    "a zener diode": BOARD + "D5 b a own",
    "another capacitor": BOARD + "C2 p n 1n",
    "unlike diodes": BOARD.replace("D4 b n own", "D4 b n BAT54"),
    "no store": BOARD.replace("Csmooth a b 1u\n", ""),
    "a load of its own": BOARD.replace("Rload a b", "R1 a c 1k\nRload c b"),
    "a doubler": "D1 p a own\nD2 b p own\nCsmooth a b 1u\nC2 a n 1u\nC3 n b 1u\nRload a b 1Meg\n"
    + LAW,
}


def circuit(name):
    return load_circuit(Load(netlist=name), 5e-8)


@pytest.mark.parametrize(
    ("name", "rails"),
    [("bridge", ("a", "b")), ("ltc3588", ("store", "com")), ("bq25570", ("in", "com"))],
)
def test_a_bridge_of_diodes_is_cut_off(name, rails):
    cut = cut_behind_rectifier(circuit(name))
    rails = tuple(f"xload.{rail}" for rail in rails)
    assert cut.rails == rails
    assert [one.kind for one in cut.rectifier] == ["d"] * 4
    nodes = {node for one in cut.slow() for node in one.nodes}
    assert {"p", "0"} <= nodes
    # they have the electrodes' names now, also if expressions name them
    assert not nodes & {*rails}
    assert not {node for one in cut.slow() for node in one.nodes_read} & {*rails}
    assert {one.name for one in cut.held(1.0)} == {one.name for one in cut.rectifier} | {
        "csmooth",
        "rload",
    }


@pytest.mark.parametrize(
    "name", ["doubler", "parallel_sshi", "series_sshi", "sece", "self_powered_sshi", "resistor"]
)
def test_other_circuits_are_not_cut(name):
    assert cut_behind_rectifier(circuit(name)) is None


def test_which_circuits_are_a_store_and_its_load():
    found = [
        name
        for name in ("bridge", "doubler", "sece", "ltc3588", "bq25570", "resistor")
        if is_plain_store(circuit(name))
    ]
    assert found == ["bridge", "doubler", "sece"]


def test_a_held_store_replaces_the_netlists_own():
    values = {one.name: one.number for one in held_rectifier(circuit("bridge"), 2.0)}
    assert (values["csmooth"], values["rload"]) == (2.0, 1e15)


def bridge_of(scene):
    problem = Problem(scene)
    return plain_bridge(problem.circuit, problem.scales)


def test_a_users_bridge_has_the_circuit_of_the_packages(tmp_path):
    """The same currents of the same diodes, and the same store and load."""
    values = {"R": 1.5e6, "C": 1e-6, "Is": 2.52e-9, "N": 1.752}
    problem = Problem(PLATE.with_load(hv.Netlist("bridge", **values)))
    ours = bridge_of(on_plate(tmp_path, BOARD))
    its = ideal_circuit(problem.circuit, problem.scales)
    assert its.bridge and ours.bridge
    for name in ("mu", "kappa", "n", "leak", "loss"):
        assert getattr(ours, name) == pytest.approx(getattr(its, name), rel=1e-12), name


@pytest.mark.parametrize("what", OTHERS)
def test_a_board_with_more_or_less_is_no_plain_bridge(tmp_path, what):
    assert bridge_of(on_plate(tmp_path, OTHERS[what])) is None
