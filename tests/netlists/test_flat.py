"""Flat netlists as KiCad exports them: made into a load, the same circuit as before, or refused with the line."""

import re
import subprocess
import tomllib

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.netlists.load_circuit import load_circuit, netlist_folder
from harvester.netlists.probes import read_probes
from harvester.scene.load import Load
from tests.support.paths import EXAMPLES

BOARD = """.title KiCad schematic
.save all
.probe alli
D1 /PZ_P Net-_D1-K_ DIODE
D2 /PZ_N Net-_D1-K_ DIODE
D3 GND /PZ_P DIODE
D4 0 /PZ_N DIODE
C1 Net-_D1-K_ GND 10u
R1 Net-_D1-K_ GND 100k
.model DIODE D(Is=1n)
.tran 1m 1
.end
"""
PINS = ("/PZ_P", "/PZ_N")


def board(tmp_path, text=BOARD, terminals=PINS, **keys):
    path = tmp_path / "board.cir"
    path.write_text(text)
    return load_circuit(Load(netlist=str(path), terminals=terminals, **keys))


def refusal(tmp_path, text=BOARD, terminals=PINS, **keys):
    with pytest.raises(InputError) as caught:
        board(tmp_path, text, terminals, **keys)
    said = str(caught.value)
    assert said.isprintable()
    assert len(said) < 500
    return said


def lines_of(circuit):
    """The lines that ngspice gets, without what all names begin with."""
    return circuit.text.replace("xload.", "").splitlines()


def test_a_board_has_a_ground_of_its_own(tmp_path):
    circuit = board(tmp_path)
    assert lines_of(circuit) == [
        "d.d1 p net_d1_k model1",
        "d.d2 0 net_d1_k model1",
        "d.d3 board_ground p model1",
        "d.d4 board_ground 0 model1",
        "c.csmooth net_d1_k board_ground 1e-05",
        "r.rload net_d1_k board_ground 100000.0",
        ".model model1 d(is=1e-09)",
    ]
    assert circuit.values == {"C": 1e-5, "R": 1e5}
    assert circuit.storage == pytest.approx(1.0)
    assert circuit.smoothing_nodes == ("xload.net_d1_k", "xload.board_ground")
    assert board(tmp_path, parameters={"R": 1e4}).storage == pytest.approx(0.1)


def test_a_boards_own_parameter_called_r_is_not_the_load(tmp_path):
    text = BOARD.replace("R1 ", ".param R=10k\nR7 /PZ_P /PZ_N {R}\nR1 ")
    values = {
        part.name: part.number
        for part in board(tmp_path, text, resistor="R1", parameters={"R": 5e3}).parts
    }
    assert (values["r7"], values["rload"]) == (1e4, 5e3)


def test_probes_by_the_boards_own_names(tmp_path):
    """Nets with or without KiCad's slash, against the board's ground, and elements that have another name here."""
    circuit = board(tmp_path, BOARD.replace("Net-_D1-K_", "/OUT"))
    one, two, three, four = read_probes(["v(/OUT)", "v(out,GND)", "i(R1)", "store"], circuit)
    assert (one.plus, one.minus) == (two.plus, two.minus) == (four.plus, four.minus)
    assert (one.plus, one.minus) == ("xload.out", "xload.board_ground")
    assert (one.name, two.name) == ("v(/OUT)", "v(out,GND)")
    assert three.factor == "@r.xload.rload[i]"
    with pytest.raises(InputError, match="did you mean '/out'"):
        read_probes(["v(/OUTT)"], circuit)


def test_nets_that_differ_in_signs_only_stay_apart(tmp_path):
    text = BOARD.replace("C1 Net-_D1-K_ GND", "R2 Net-_D1-K_ Net-(D1-K) 1k\nC1 Net-(D1-K) GND")
    lines = lines_of(board(tmp_path, text, resistor="R1"))
    assert "r.r2 net_d1_k net_d1_k_2 1000.0" in lines
    assert "c.csmooth net_d1_k_2 board_ground 1e-05" in lines


def test_a_ground_that_is_an_electrode_stays_ground(tmp_path):
    text = (
        ".title t\nD1 /IN out DIODE\nR1 out GND 1k\nR2 /IN 0 1Meg\nB1 x 0 V=v(out)*2\nR3 x 0 1k\n"
    )
    text += ".model DIODE D(Is=1n)\n.end\n"
    circuit = board(tmp_path, text, ("/IN", "GND"), resistor="R1")
    assert circuit.ground == "0"
    assert "b.b1 x 0 v=(v(out) * 2.0)" in lines_of(circuit)


def test_vendors_subcircuits_get_the_boards_ground(tmp_path):
    """Node 0 within them, a pin called gnd, voltages against ground, and a call within a call."""
    inner = (
        ".subckt OUTER in out gnd\nX1 in out gnd INNER\nR1 in gnd 1k\n.ends\n"
        ".subckt INNER a b c PARAMS: g=1\nB1 b 0 I=v(a)*{g}*1u\nE1 d 0 a c 2\nR1 d c 1k\n.ends\n"
        ".subckt PLAIN a b\nR1 a b 1k\n.ends\n"
    )
    text = BOARD.replace(
        ".model", "XU1 /PZ_P Net-_D1-K_ GND OUTER\nX2 /PZ_P GND PLAIN\n" + inner + ".model", 1
    )
    lines = lines_of(board(tmp_path, text))
    assert "b.xu1.x1.b1 net_d1_k board_ground i=((v(p,board_ground) * 1.0) * 1e-06)" in lines
    assert "e.xu1.x1.e1 xu1.x1.d board_ground p board_ground 2.0" in lines
    assert "r.xu1.r1 p board_ground 1000.0" in lines
    assert "r.x2.r1 p board_ground 1000.0" in lines


def test_supplies_are_ideal_sources(tmp_path):
    text = BOARD.replace("R1 ", "R2 +3V3 Net-_D1-K_ 1Meg\nR1 ")
    lines = lines_of(board(tmp_path, text, resistor="R1", supplies={"+3v3": "3.3 V"}))
    assert "v.vsupply1 3v3 board_ground dc 3.3" in lines


@pytest.mark.parametrize(
    ("old", "new", "keys", "said"),
    [
        ("", "", {"terminals": ("/PZ_P", "/PZ_M")}, "did you mean '/pz_p'"),
        ("", "", {"terminals": ("/PZ_P", "PZ_P")}, "be two different nets"),
        (
            "R1 Net",
            "R2 Net-_D1-K_ 0 1k\nR1 Net",
            {},
            "load.resistor must name the resistor .* its resistors: R2, R1",
        ),
        (BOARD, ".title t\n.end\n", {}, "must have elements outside of subcircuits"),
        (
            "",
            "",
            {"resistor": "R7"},
            "unknown load.resistor of netlist board.cir 'R7': it must be one of R1",
        ),
        ("", "", {"store": "C9"}, "unknown load.store"),
        (
            "R1 Net",
            "RLOAD Net-_D1-K_ 0 1k\nR1 Net",
            {"resistor": "R1"},
            "must be left out, as netlist board.cir has",
        ),
        (
            "",
            "",
            {"supplies": {"VDD": 3.0}},
            "unknown net of load.supplies in netlist board.cir 'VDD'",
        ),
        ("", "", {"supplies": {"GND": 3.0}}, "neither ground nor a terminal"),
        (
            ".save all",
            "V1 /PZ_P /PZ_N SIN(0 5 50)",
            {},
            "line 2 must have no source between the piezo's terminals.*V1",
        ),
        (".save all", "R9", {}, "line 2 must give 2 nodes to R9"),
        (
            ".save all",
            "A1 /PZ_P 0 evil",
            {},
            "line 2 must begin with a card or one of the elements",
        ),
        (
            ".save all",
            ".control\nshell touch x\n.endc",
            {},
            "line 2 must have only cards of a circuit",
        ),
        (
            ".save all",
            ".include /etc/hostname",
            {},
            "line 2 must include a file in the netlist's folder .copy it there",
        ),
        (
            ".save all",
            ".include models.lib",
            {},
            "netlist's folder .copy it there., but is 'models.lib'",
        ),
        (
            ".save all",
            ".lib ../models.lib typ",
            {},
            "line 2 must include a file in the netlist's folder",
        ),
        (
            ".save all",
            ".lib board.cir typ",
            {},
            "a file with sections, but board.cir has none: .include it",
        ),
        (".save all", ".lib typ", {}, "line 2 must include a file in the netlist's folder"),
        (
            ".save all",
            "E1 x 0 TABLE {v(/PZ_P)} (0,0) (1,1)",
            {},
            "line 2 must write its table or transfer function",
        ),
        (
            ".save all",
            ".options rshunt=1Meg",
            {},
            "unknown option in netlist board.cir line 2 'rshunt'",
        ),
        (".save all", ".ic v(nowhere)=1", {}, "unknown net of .ic in netlist board.cir 'nowhere'"),
        (".save all", "XU1 /PZ_P 0 NOWHERE", {}, "line 2 must call a subcircuit of this netlist"),
        (".title KiCad schematic", "*#shell touch x", {}, "must run no command"),
    ],
)
def test_what_cannot_be_is_refused_with_the_line(tmp_path, old, new, keys, said):
    assert re.search(said, refusal(tmp_path, BOARD.replace(old, new, 1), **keys)), refusal(
        tmp_path, BOARD.replace(old, new, 1), **keys
    )


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (
            {"netlist": "bridge", "terminals": PINS},
            "load.terminals must be used with the file of a flat netlist",
        ),
        (
            {"netlist": "./b.cir", "supplies": {"VCC": 3.0}},
            "load.supplies must be used with load.terminals",
        ),
        (
            {"netlist": "./b.cir", "terminals": PINS, "supplies": {"VCC": "3 A"}},
            "load.supplies.VCC must be a voltage",
        ),
        ({"netlist": "./b.cir", "terminals": ("/PZ_P",)}, "load.terminals"),
        ({"netlist": "./b.cir", "terminals": "/PZ_P"}, "load.terminals must be a list"),
    ],
)
def test_keys_that_do_not_fit_are_refused(keys, said):
    with pytest.raises(InputError, match=said):
        Load(**keys)


def test_a_flat_netlist_without_terminals_says_what_is_missing(tmp_path):
    path = tmp_path / "board.cir"
    path.write_text(BOARD)
    with pytest.raises(
        InputError, match=r"or be a board with load\.terminals, the piezo's two nets"
    ):
        load_circuit(Load(netlist=str(path)))
    with pytest.raises(
        InputError, match=r"in a flat netlist, such as KiCad's, load\.terminals in a scene names"
    ):
        load_circuit(Load(netlist=str(EXAMPLES / "board.cir")))  # which includes subcircuits


def test_sections_of_a_library(tmp_path):
    """One of a file, and a section that asks for another; the rest is not there."""
    (tmp_path / "models.lib").write_text(
        "* models\n.lib fast\n.model DIODE D(Is=1p)\n.endl\n.lib slow\n.lib models.lib common\n.endl slow\n"
        ".lib common\n.model DIODE D(Is=5n)\n.endl\n"
    )
    text = BOARD.replace(".model DIODE D(Is=1n)", ".lib 'models.lib' {}")
    assert board(tmp_path, text.format("FAST")).text.splitlines()[-1] == ".model model1 d(is=1e-12)"
    assert "did you mean 'fast'" in refusal(tmp_path, text.format("fastt"))
    assert board(tmp_path, text.format("slow")).text.splitlines()[-1] == ".model model1 d(is=5e-09)"
    (tmp_path / "models.lib").write_text(".lib slow\n.lib models.lib slow\n.endl\n")
    assert "include no section within itself" in refusal(tmp_path, text.format("slow"))


def test_the_example_is_a_scene_that_is_written_and_read_again():
    scene = hv.load(EXAMPLES / "bimorph_board.toml")
    assert Problem(scene).circuit.renamed == {"r4": "rload", "c1": "csmooth"}
    assert tomllib.loads(scene.to_toml())["load"]["supplies"] == {"VCC": 3.0}


@pytest.mark.ngspice
def test_the_board_in_ngspice_is_the_flat_netlist():
    """The same store and load at a fixed amplitude: the raw netlist with its own ground, and the load made of it."""
    power = []
    raw = (EXAMPLES / "board.cir").read_text().replace("Net-(Q1-B)", "base").replace("/", "net_")
    raw = re.sub(r"(?m)^(\.include|\.save|\.probe|\.tran|\.end|\.title).*\n", "", raw)
    parts = (
        EXAMPLES / "board_parts.lib"
    ).read_text() + ".model BAT54 D(Is=0.1u N=1 Rs=0.28 Cjo=12p M=0.3 Tt=5n)\n"
    parts = parts.replace(" gnd", " low")
    library = (netlist_folder() / "parts" / "transistors.lib").read_text()
    models = re.search(r"(?m)^\.model 2N3904 .*\n(?:\+.*\n)*", library)[0]
    flat = f"Vd drive net_PZ_N SIN(0 8 46)\nCp drive net_PZ_P 41n\nVvcc VCC 0 3\n{raw}{parts}{models}\n"
    board = Problem(hv.load(EXAMPLES / "bimorph_board.toml")).circuit.text
    ours = f"Vd drive 0 SIN(0 8 46)\nCp drive p 41n\n{board}\n"
    for text, load in ((flat, "@r4[p]"), (ours, "@r.xload.rload[p]")):
        deck = f"a board\n{text}.options method=gear reltol=1e-4\n.save {load}\n"
        deck += ".tran 0.2m 2 0 0.2m uic\n.control\nrun\n"
        deck += f"meas tran watts AVG {load} from=0 to=2\n.endc\n.end\n"
        done = subprocess.run(
            ["ngspice", "-b", "/dev/stdin"],
            input=deck,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        found = re.search(r"^watts +=\s+(\S+)", done.stdout, re.M)
        assert found, done.stdout[-1500:] + done.stderr[-500:]
        power.append(float(found[1]))
    assert power[1] == pytest.approx(power[0], rel=0.02)
    assert power[0] > 10e-6


def test_what_a_board_begins_with(tmp_path):
    """An .ic card and IC= of a capacitor are the same; the latter has precedence."""
    by_card = board(tmp_path, BOARD.replace(".model", ".ic v(Net-_D1-K_)=2\n.model", 1))
    by_key = board(tmp_path, BOARD.replace("GND 10u", "GND 10u IC=2"))
    assert by_card.text == by_key.text
    both = board(
        tmp_path,
        BOARD.replace("GND 10u", "GND 10u IC=1").replace(
            ".model", ".ic v(Net-_D1-K_)=2\n.model", 1
        ),
    )
    assert "ic=1.0" in both.text
    assert "ic=2.0" not in both.text


def test_temperatures_of_a_board(tmp_path):
    assert board(tmp_path, BOARD.replace(".save all", ".options temp=85 reltol=1e-3")).settings == {
        "temp": 85.0
    }
    assert board(tmp_path, BOARD.replace(".save all", ".temp {80+5}")).settings == {"temp": 85.0}


def test_a_global_node_is_one_in_all_subcircuits(tmp_path):
    text = BOARD.replace(
        ".save all", ".global VCC\nR8 VCC 0 1k\nX1 /PZ_P leak\n.subckt leak a\nR1 a VCC 1Meg\n.ends"
    )
    assert "r.x1.r1 p vcc 1000000.0" in lines_of(board(tmp_path, text, resistor="R1"))
