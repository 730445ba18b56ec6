"""A netlist cut behind its rectifier: what is on which side, and netlists that cannot be cut."""

import pytest

from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from harvester.storage.rectifier_cut import cut_behind_rectifier, held_rectifier, is_plain_store


def circuit(name):
    return load_circuit(Load(netlist=name), 5e-8)


@pytest.mark.parametrize(
    ("name", "rails"), [("bridge", ("a", "b")), ("ltc3588", ("store", "com")), ("bq25570", ("in", "com"))]
)
def test_a_bridge_of_diodes_is_cut_off(name, rails):
    cut = cut_behind_rectifier(circuit(name))
    assert cut.rails == rails
    assert [one.kind for one in cut.rectifier] == ["d"] * 4
    nodes = {node for one in cut.slow() for node in one.nodes}
    assert {"p", "0"} <= nodes
    assert not nodes & {*rails}  # they have the electrodes' names now, also where expressions name them
    assert all(one.node(rail) in ("p", "0") for one in cut.slow() if not one.path for rail in rails)
    assert {one.name for one in cut.held(1.0)} == {one.name for one in cut.rectifier} | {"csmooth", "rload"}


@pytest.mark.parametrize("name", ["doubler", "parallel_sshi", "series_sshi", "sece", "self_powered_sshi", "resistor"])
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
    values = {one.name: one.rest for one in held_rectifier(circuit("bridge"), 2.0)}
    assert values["csmooth"] == "2.0" and float(values["rload"]) == 1e15
