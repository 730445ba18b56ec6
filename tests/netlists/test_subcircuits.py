"""Every element of a netlist with a plain value is a parameter by its name, of boards from KiCad as well."""

from pathlib import Path

import pytest

import harvester as hv
from harvester.netlists.load_circuit import load_circuit
from tests.support.netlists import BRIDGE, written
from tests.support.paths import ROOT

BODY = BRIDGE.format("BAT54") + "R7 a c 10k\nCsmooth c b 1u\nL1 c d 5\nRload d b 1.5Meg"


def values(load):
    """The values of the elements of a load, by their names."""
    return {part.name: part.number for part in load_circuit(load).parts if part.kind in "rcl"}


def test_an_element_is_a_parameter_by_its_name(tmp_path):
    netlist = written(tmp_path, BODY)
    before = values(hv.Load(netlist=netlist))
    after = values(hv.Load(netlist=netlist, parameters={"r7": "47k", "Csmooth": "2u", "L1": 3.0}))
    assert before == {"r7": 1e4, "csmooth": pytest.approx(1e-6), "l1": 5.0, "rload": 1.5e6}
    assert after == {"r7": 4.7e4, "csmooth": pytest.approx(2e-6), "l1": 3.0, "rload": 1.5e6}
    assert load_circuit(
        hv.Load(netlist=netlist, parameters={"Csmooth": "2u"})
    ).smoothing == pytest.approx(2e-6)


def test_a_misspelt_element_gets_its_nearest_match(tmp_path):
    netlist = written(tmp_path, BODY.replace("1.5Meg", "{R}"))
    with_parameter = netlist.replace("board", "other")
    text = (tmp_path / "board.cir").read_text()
    (tmp_path / "other.cir").write_text(text.replace("board p n", "board p n R=1Meg"))
    with pytest.raises(hv.InputError, match="did you mean 'R7'"):
        load_circuit(hv.Load(netlist=with_parameter, parameters={"R77": 1.0}))


def test_elements_of_a_flat_netlist_are_keys():
    given = {
        "netlist": str(ROOT / "examples" / "board.cir"),
        "terminals": ("/PZ_P", "/PZ_N"),
        "resistor": "R4",
    }
    given |= {"store": "C1", "supplies": {"VCC": 3.3}}
    scene = hv.load(ROOT / "examples" / "plate_bridge.toml").with_load(hv.Load(**given))
    found = values(
        scene.varied(
            {"load.parameters.R2": 2e6, "load.parameters.R4": 5e3, "load.parameters.C2": 3e-6}
        ).load
    )
    assert (found["r2"], found["rload"], found["c2"], found["r1"]) == (
        2e6,
        5e3,
        pytest.approx(3e-6),
        1e5,
    )


@pytest.mark.parametrize("number", ["0", "-1"])
@pytest.mark.parametrize("line", ["R9 c b 1", "L9 c b 1", "C9 c b 1", "D9 c b dio", "I9 c b 1u"])
def test_elements_side_by_side_are_more_than_none(tmp_path, line, number):
    """A resistor with m=0 ended in a division by zero; with m=-1 it gave power without a word."""
    netlist = written(tmp_path, BODY + f"\n.model dio d\n{line} m={number}")
    says = rf"^netlist board\.cir line [0-9]+, m, must be above 0, .* but is {number}: delete"
    with pytest.raises(hv.InputError, match=says):
        load_circuit(hv.Load(netlist=netlist))


def test_files_that_include_each_other_for_ever_deeper(tmp_path):
    """Three thousand of them ended in a RecursionError."""
    for k in range(3000):
        (tmp_path / f"n{k}.inc").write_text(f".include n{k + 1}.inc\n")
    (tmp_path / "n3000.inc").write_text("* the last\n")
    netlist = written(tmp_path, BODY + "\n.include n0.inc")
    with pytest.raises(hv.InputError, match=r"must be at most 100 files deep, but is deeper"):
        load_circuit(hv.Load(netlist=netlist))


def test_a_subcircuit_is_called_more_than_no_times(tmp_path):
    """Also for a call, whose m is that of each element in it."""
    netlist = Path(written(tmp_path, BODY + "\nX9 c b two m=-2"))
    netlist.write_text(netlist.read_text() + ".subckt two a b\nR1 a b 1k\n.ends\n")
    with pytest.raises(hv.InputError, match=r", m, must be above 0, .* but is -2: delete"):
        load_circuit(hv.Load(netlist=str(netlist)))
