"""Reports on netlists: bad ones in one line that names the element, and which elements are supported."""

import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

import harvester as hv
from harvester.circuits.solvability import unserved_parts
from harvester.equations.problem import Problem
from harvester.netlists.part import by_name
from tests.support.netlists import BRIDGE, STORE, compiled, on_plate

GOOD = BRIDGE.format("BAT54") + STORE

BAD = {
    "no path": (
        GOOD + "Rx y z 1k\nRy z y 2k",
        "element rx must have a path to the piezo, but its node 'y' has none",
    ),
    "sources in a loop": (
        GOOD + "V1 a m 1\nE1 m b a b 2\nB1 a b V=3",
        "element b1 must not close a loop of voltage sources",
    ),
    "across the piezo": (
        GOOD + "V1 p m 1\nV2 m n 2",
        "element v2 must not set the piezo's voltage",
    ),
    "current source": (
        GOOD + "I1 q 0 1u",
        "element i1 must have a path to the piezo, but its node 'q' has none",
    ),
    "no load": (
        GOOD.replace("1.5Meg", "{1-1}"),
        "board.cir line 8 must be above 0, for Rload, but is 0.0",
    ),
    "too large": (
        GOOD + "\n".join(f"R{k} x{k} x{k + 1} 1k" for k in range(200)) + "\nRend x0 p 1k",
        "is the first beyond 150 nodes",
    ),
    "unknown function": (
        GOOD + "B1 a b I=bessel(v(a))",
        "unknown function of netlist board.cir line 9 'bessel'",
    ),
    "time": (GOOD + "B1 a b I=1u*sin(time)", "element b1 depends on the time"),
    "changing source": (
        GOOD + "V1 c b SIN(0 1 50)\nR1 c a 1Meg",
        "element v1 is a source that changes with time",
    ),
    "transmission line": (GOOD + "T1 p n a b Z0=50 Td=1n", "element t1 is an element of a kind"),
    "no model": (
        GOOD + "D9 p a nothing",
        "board.cir line 9 must name a model of the netlist, but 'nothing' is not one",
    ),
    "level": (
        GOOD + "M1 p a b b x\n.model x NMOS(Level=3 Vto=1)",
        "element m1 has a model of another level than 1, or of another tnom than 27",
    ),
    "vertical": (GOOD + "M1 p a b BSS138", "element m1 has a model of the type vdmos"),
    "named twice": (
        GOOD + "D1 p a BAT54",
        "must have a name that no other element has, but is 'd1'",
    ),
    "two models": (
        GOOD + ".model z D(Is=1n)\n.model Z D(Is=1p)",
        "must have a name that no other model has, but is 'z'",
    ),
    "no coil": (GOOD + "L1 p a 1m\nK1 L1 L2 0.9", "element k1 must couple two inductors"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_netlist_gets_one_line_that_names_the_element(tmp_path, name):
    body, complaint = BAD[name]
    with pytest.raises(hv.InputError) as error:
        compiled(on_plate(tmp_path, body))
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", list(BAD)[:5])
@pytest.mark.parametrize("engine", [hv.Spice, hv.Compiled, hv.Ideal, hv.Slow])
def test_a_netlist_without_a_solution_is_refused_by_every_engine_in_the_same_line(
    tmp_path, name, engine
):
    """Before ngspice starts, which would name a node, or hold the piezo at the source's voltage."""
    body, complaint = BAD[name]
    with pytest.raises(hv.InputError, match=rf"^netlist {complaint}"):
        engine().run(on_plate(tmp_path, body))


@pytest.mark.parametrize(
    "name",
    [
        "bridge",
        "doubler",
        "parallel_sshi",
        "series_sshi",
        "sece",
        "sshc",
        "self_powered_sshi",
        "ltc3588",
        "bq25570",
        "node",
    ],
)
def test_the_netlists_of_the_package_are_served(name):
    circuit = Problem.of(hv.load("examples/plate_bridge.toml").with_load(netlist=name)).circuit
    parts = by_name(circuit.parts)
    assert [why for _, why in unserved_parts(parts) if why] == []


def test_values_change_no_source_so_that_they_compile_nothing(tmp_path):
    def source(model, value):
        more = f"B1 a b I={value}*uramp(v(a,b) - {value})\nL1 p q {value}\nR1 q n 1k\n.model own D({model})"
        made = compiled(on_plate(tmp_path, GOOD.replace("BAT54", "own") + more))
        return made.solver.text

    assert (
        source("Is=1n N=1.5 Bv=5", 0.3)
        == source("Is=30u Rs=0 Cjo=1p Tt=3n", 2)
        == source("Is=2u N=1", 0.1)
    )


def test_doctor_says_which_elements_of_a_netlist_are_served(tmp_path, harvester):
    path = tmp_path / "board.cir"
    path.write_text(f"* a board\n.subckt board p n\n{GOOD}T1 p n a b Z0=50 Td=1n\n.ends board\n")
    status, out, _ = harvester("doctor", path)
    assert status == 0
    assert "works    d1" in out
    assert "NOT      t1  is an element of a kind that compiled circuits do not have" in out
    assert "engine 'compiled' supports 6 of 7 elements" in out


def test_threads_that_ask_at_once_for_a_step_get_one_record(tmp_path):
    """It has addresses of its arrays: one of two records would be freed while a kernel still reads it."""
    circuit = compiled(on_plate(tmp_path, GOOD))
    count = 8
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for k in range(5):
            barrier = Barrier(count)

            def ask(_: int, h: float = 0.01 * (k + 1), barrier: Barrier = barrier) -> int:
                barrier.wait()
                return int(circuit.for_kernels(h).record[0]["Y_at"])

            with ThreadPoolExecutor(count) as pool:
                assert len(set(pool.map(ask, range(count)))) == 1
    finally:
        sys.setswitchinterval(interval)
