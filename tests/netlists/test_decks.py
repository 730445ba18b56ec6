# ruff: noqa: E501, as a line of a deck is a line
"""Decks as people publish them, written anew: `harvester adopt` makes boards of them, which are the same to ngspice.

The board and a netlist written by hand without the excitation get the same current, and give the same power in ngspice.
"""

import json
import shlex

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.netlists.adoption import adopt
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.ngspice_oracle import Oracle

DIODE = ".model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Bv=30)\n"
BRIDGE = "D1 A P DP\nD2 B P DP\nD3 0 A DP\nD4 0 B DP\n"
LOAD = "Cs P 0 40n\nRL P 0 250k\n"
HALF = "Da X OUT DP\nDb 0 X DP\nCo OUT 0 40n\nRo OUT 0 250k\n"

# Each deck: its text, and the lines that are left of it: by these ngspice states what is right.
DECKS = {
    "current source": (
        f"bridge\nIp A B SIN(0 50u 61)\nCp A B 33n\n{BRIDGE}{LOAD}{DIODE}.tran 1u 2\n.end\n",
        BRIDGE + LOAD + DIODE, "A", "B"),
    "three currents, resistor of losses": (
        f"t\nI1 B A SIN(0 50u 61)\nI2 B A SIN(0 9u 180)\nCp A B 33n\nRp A B 9Meg\n{BRIDGE}{LOAD}{DIODE}.end\n",
        "Rp A B 9Meg\n" + BRIDGE + LOAD + DIODE, "A", "B"),
    "voltage behind a capacitor": (
        f"* half\nVp 1 0 SINE(0 8 61)\nCp 1 X 33n\n{HALF}{DIODE}.tran 0 2 0 10u uic\n.backanno\n.end\n",
        HALF + DIODE, "X", "0"),
    "voltage behind a capacitor, floating": (
        f"* x\nCpz A mid 33n\nV1 mid B SIN 0 7 61\n{BRIDGE}{LOAD}{DIODE}.tran 1m 1\n.end\n",
        BRIDGE + LOAD + DIODE, "A", "B"),
    "sine at the nodes": (
        f"* x\nVin X 0 SIN(0 6 61) AC 1\n{HALF}{DIODE}.tran 1m 1\n.ac dec 10 1 1k\n.end\n", HALF + DIODE, "X", "0"),
    "a function of the time": (
        f"* x\nB1 0 X I=50u*sin(6.2832*61*time)\nCp X 0 33n\n{HALF}{DIODE}.end\n", HALF + DIODE, "X", "0"),
    "commands": (
        f"* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\n{HALF}{DIODE}.control\nset temp=50\nrun\nplot v(out)\n.endc\n.end\n",
        HALF + DIODE, "X", "0"),
    "temperature and nodeset": (
        f"* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\n{HALF}{DIODE}.options temp=60 reltol=1e-5 gmin=1e-11\n"
        ".nodeset v(OUT)=1\n.save all\n.end\n", HALF + DIODE + ".options temp=60\n", "X", "0"),
    "start": (
        f"* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\n{HALF}{DIODE}.ic v(OUT)=1.2\n.end\n",
        HALF.replace("40n", "40n ic=1.2") + DIODE, "X", "0"),
    "a switch with its own pulse": (
        f"* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\n{HALF}S1 X Y G 0 SW1\nRy Y 0 80k\nVg G 0 PULSE(0 5 1m 1u 1u 2m 8m)\n"
        f".model SW1 SW(Vt=2.5 Ron=10 Roff=100Meg)\n{DIODE}.end\n",
        HALF + "S1 X Y G 0 SW1\nRy Y 0 80k\nVg G 0 PULSE(0 5 1m 1u 1u 2m 8m)\n"
        ".model SW1 SW(Vt=2.5 Ron=10 Roff=100Meg)\n" + DIODE, "X", "0"),
    "ammeter and parallel inductor": (
        f"* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\nVam X X1 0\nLx X1 0 150 Rser=2k\n{HALF}{DIODE}.end\n",
        f"Vam X X1 0\nLx X1 x2 150\nRx x2 0 2k\n{HALF}{DIODE}", "X", "0"),
    "ammeter of a current source": (
        f"* x\nI1 B x SIN(0 50u 61)\nVam x A 0\nC1 A B 33n\nBm m 0 V=i(Vam)\n{BRIDGE}{LOAD}{DIODE}.end\n",
        BRIDGE + LOAD + DIODE, "A", "B"),
    "ammeters of two capacitors": (
        f"* x\nI1 0 X SIN(0 50u 61)\nC1 X g 20n\nVam g 0 0\nVan X y 0\nC2 0 y 13n\n{HALF}{DIODE}.end\n",
        HALF + DIODE, "X", "0"),
    "subcircuit": (
        f"* x\nXp A B PIEZO\n.subckt LEAK a b\nRk a b 7Meg\n.ends\nXl P 0 LEAK\nIp A B SIN(0 50u 61)\nCp A B 33n\n"
        f".subckt PIEZO a b\nRz a b 20Meg\n.ends\n{BRIDGE}{LOAD}{DIODE}.end\n",
        f"Rz A B 20Meg\nRk P 0 7Meg\n{BRIDGE}{LOAD}{DIODE}", "A", "B"),
    "doubler of LTspice": (
        "* C:\\x.asc\nI§1 0 N001 SINE(0 50µ 61)\nC§p N001 0 33n\nC2 N001 N002 30n Rser=100\nD1 0 N002 DP\nD2 N002 VO DP\n"
        f"C1 VO 0 40n V=25 Irms=0\nR1 VO 0 1Meg tol=1\n{DIODE}.tran 0 3 0 50u\n.backanno\n.end\n",
        f"C2 N001 n3 30n\nR2 n3 N002 100\nD1 0 N002 DP\nD2 N002 VO DP\nC1 VO 0 40n\nR1 VO 0 1Meg\n{DIODE}", "N001", "0"),
    "nets of KiCad": (
        f".title KiCad schematic\n.save all\n.probe alli\nI1 GND /PZ SIN( 0 50u 61 )\nC1 /PZ GND 33n\n"
        f"D1 /PZ Net-_D1-K_ DP\nD2 GND /PZ DP\nC2 Net-_D1-K_ GND 40n\nR1 Net-_D1-K_ GND 250k\n{DIODE}.tran 1u 1\n.end\n",
        "D1 PZ O DP\nD2 0 PZ DP\nC2 O 0 40n\nR1 O 0 250k\n" + DIODE, "PZ", "0"),
}  # fmt: skip


def deck(folder, text, name="deck.cir", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_a_deck_becomes_the_board_that_is_left_of_it(tmp_path, name):
    text, left, first, second = DECKS[name]
    adoption = adopt(deck(tmp_path, text))
    load = Load(
        netlist=str(tmp_path / "board.cir"),
        terminals=adoption.terminals,
        resistor=adoption.resistor,
        store=adoption.store,
    )
    circuit = load_circuit(load, text=adoption.text)
    nets = [net.strip("/").replace("GND", "0") for net in adoption.terminals]
    assert sorted(nets) == sorted([first, second])
    with Oracle() as ask:
        right = ask(left, nets, adoption.resistor).power
        options = [f".options {key}={value!r}" for key, value in circuit.settings.items()]
        mine = ask("\n".join([circuit.text, *options]), ("p", "0"), "r.xload.rload").power
    assert right > 1e-7
    assert mine == pytest.approx(right, rel=2e-3)


def test_what_was_done_with_each_line_is_told(tmp_path):
    text = DECKS["temperature and nodeset"][0].replace(
        ".end\n", ".control\nalter rl=2\n.endc\n.end\n"
    )
    adoption = adopt(deck(tmp_path, text))
    told = {remark.code: remark for remark in adoption.diagnostics}
    assert told["deck_drive"].numbers["line"] == "deck.cir line 2"
    assert told["deck_capacitance"].numbers["value"] == adoption.capacitance == "33n"
    assert told["deck_kept"].numbers["card"] == ".options temp=60"
    assert told["deck_option"].severity == "warning"
    assert "gmin=1e-11" in str(told["deck_option"])
    assert "alter rl=2" in str(told["deck_command_changes"])
    assert {"deck_cards", "deck_commands", "deck_load", "deck_store"} <= told.keys()
    assert (adoption.resistor, adoption.store) == ("Ro", "Co")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le"])
def test_the_board_is_utf_8(tmp_path, encoding):
    adoption = adopt(deck(tmp_path, DECKS["doubler of LTspice"][0], "x.net", encoding))
    assert adoption.terminals == ("N001", "0")
    assert "50u" not in adoption.text
    assert adoption.text.isascii()


LIBRARY = "* x\nIp 0 X SIN(0 50u 61)\nCp X 0 33n\n" + HALF


@pytest.mark.parametrize(
    "card", [".lib C:\\Users\\me\\lib\\own.lib", '.include "../own.lib"', ".lib parts/own.lib"]
)
def test_a_library_in_the_decks_folder_is_found_by_its_name(tmp_path, card):
    (tmp_path / "own.lib").write_text(DIODE)
    adoption = adopt(deck(tmp_path, f"{LIBRARY}{card}\n.end\n"))
    assert ".include own.lib" in adoption.text


def test_a_library_that_is_missing(tmp_path):
    """Refused with the models that are needed; the remedy works; models of the package are stated to be such."""
    card = ".lib C:\\lib\\standard.dio\n.end\n"
    with pytest.raises(
        InputError, match=r"standard.dio is not there, and dp is needed of it: copy"
    ):
        adopt(deck(tmp_path, LIBRARY + card))
    (tmp_path / "standard.dio").write_text(DIODE)
    assert ".include standard.dio" in adopt(deck(tmp_path, LIBRARY + card)).text
    (tmp_path / "standard.dio").unlink()
    adoption = adopt(deck(tmp_path, (LIBRARY + card).replace(" DP", " BAT54")))
    told = [str(remark) for remark in adoption.diagnostics if remark.code == "deck_own_model"]
    assert told == ["models of the package, which may differ from the deck's library: bat54"]


@pytest.mark.parametrize(
    "step, key, values",
    [
        (".step param RL list 90k 180k 360k", "R", "90000,180000,360000"),
        (".step param RL 100k 300k 50k", "R", "100000,150000,200000,250000,300000"),
        (".step dec param RL 10k 1Meg 10", "R", "10000:1e+06:21"),
        (".step param RK list 1Meg 2Meg", "Rk", "1e+06,2e+06"),
    ],
)
def test_a_step_is_offered_as_a_sweep(tmp_path, step, key, values):
    text = (
        LIBRARY.replace("250k", "{RL}")
        + f"Rk OUT 0 {{RK}}\n.param RL=180k RK=5Meg\n{DIODE}{step}\n.end\n"
    )
    adoption = adopt(deck(tmp_path, text), load="Ro")
    told = next(remark for remark in adoption.diagnostics if remark.code == "deck_step")
    assert told.numbers["key"] == f"load.parameters.{key}"
    assert told.numbers["values"] == values
    load = Load(
        netlist=str(tmp_path / "b.cir"),
        terminals=adoption.terminals,
        resistor="Ro",
        parameters={key: 7e4},
    )
    parts = {part.name: part.number for part in load_circuit(load, text=adoption.text).parts}
    assert parts["rload" if key == "R" else "rk"] == 7e4


def test_a_step_that_no_sweep_does(tmp_path):
    text = f"{LIBRARY}{DIODE}.step temp list 0 50\n.end\n"
    codes = [remark.code for remark in adopt(deck(tmp_path, text)).diagnostics]
    assert "deck_step_left_out" in codes


TWO = f"* x\nVa A 0 SIN(0 1 50)\nVb B 0 SIN(0 1 50)\n{BRIDGE}{LOAD}{DIODE}.end\n"


def test_what_is_not_sure_is_asked_for(tmp_path):
    path = deck(tmp_path, TWO)
    with pytest.raises(
        InputError, match=r"several may be it \(Va at A,0; Vb at B,0\).*`terminals` A,B"
    ):
        adopt(path)
    assert "Va" in adopt(path, ("B", "0")).text
    with pytest.raises(InputError, match=r"has none.*the nets are A, P, B, 0"):
        adopt(deck(tmp_path, f"* x\n{BRIDGE}{LOAD}{DIODE}.end\n"))
    with pytest.raises(InputError, match=r"unknown net of `terminals` in deck deck.cir 'Q'"):
        adopt(path, ("A", "Q"))
    loads = LIBRARY.replace("Ro", "R1").replace("R1 OUT 0 250k", "R1 OUT Y 250k\nR2 Y 0 1k")
    with pytest.raises(InputError, match=r"`load` must name the resistor.*R1, R2"):
        adopt(deck(tmp_path, f"{loads}{DIODE}.end\n"))
    assert adopt(deck(tmp_path, f"{loads}{DIODE}.end\n"), load="r2").resistor == "R2"


@pytest.mark.parametrize(
    "name, line, why",
    [
        ("deck.cir", ".fourier v(out)", "unknown card in deck deck.cir line"),
        ("deck.cir", "A1 X 0 am", "A1"),
        ("deck.asc", "", "View > SPICE Netlist"),
        ("deck.kicad_sch", "", "kicad-cli sch export netlist --format spice -o deck.cir deck.kicad_sch"),
        ("deck.cir", ".control\nrun", "end its commands"),
        ("deck.cir", ".step", "step a parameter"),
    ],
)  # fmt: skip
def test_what_cannot_be_adopted_is_refused(tmp_path, name, line, why):
    with pytest.raises(InputError) as error:
        adopt(deck(tmp_path, f"{LIBRARY}{DIODE}{line}\n.end\n", name))
    assert why in str(error.value)
    assert "\n" not in str(error.value)


SCENE = """[oscillator]
mass = "9 g"
frequency = "61 Hz"
damping_ratio = 0.01
[piezo]
coupling = "1.2e-3 N/V"
capacitance = "33 nF"
[excitation]
acceleration_amplitude = "0.3 g"
frequency = "61 Hz"
[load]
netlist = "./deck.cir"
terminals = ["A", "B"]
resistor = "RL"
"""


def test_the_remedy_of_run_works_when_typed(tmp_path, harvester, monkeypatch):
    """A scene with a deck is refused with a command; typed, it writes the board of a table that loads."""
    monkeypatch.chdir(tmp_path)
    deck(tmp_path, DECKS["current source"][0])
    (tmp_path / "scene.toml").write_text(SCENE)
    status, _, error = harvester("run", "scene.toml")
    assert status == 2
    remedy = error.partition("; ")[2].partition(" leaves out")[0].split()
    assert remedy[:2] == ["harvester", "adopt"]
    status, out, error = harvester(*remedy[1:])
    assert (status, error) == (0, "")
    assert "left out: Ip A B SIN(0 50u 61) (deck.cir line 2)" in out
    table = out.partition("[load]\n")[2]
    scene = SCENE.partition("[load]\n")[0] + "[load]\n" + table
    (tmp_path / "scene.toml").write_text(scene)
    assert hv.load("scene.toml").load.resistor == "RL"
    assert load_circuit(hv.load("scene.toml").load, 33e-9).value_warnings == ()
    status, _, error = harvester(*remedy[1:])
    assert (status, "must be new" in error) == (2, True)
    status, out, _ = harvester(*remedy[1:], "--force", "--json")
    assert json.loads(out)["load"]["terminals"] == ["A", "B"]
    assert status == 0


DEVICE = [
    *("--mass", "9 g", "--frequency", "61 Hz", "--q", "50", "--coupling", "1.2e-3 N/V"),
    *("--capacitance", "33 nF", "--acceleration-psd", "1e-4 g^2/Hz"),
]


@pytest.mark.parametrize("name", ["current source", "with a subcircuit"])
def test_a_new_scene_of_a_deck(tmp_path, harvester, monkeypatch, name):
    """`run` and `new` answer a deck with `adopt`; each command that is printed works as it is typed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spice").mkdir()
    text = DECKS["current source"][0]
    inner = "\n.subckt thing a b\nRx a b 1\n.ends\n.tran"
    (tmp_path / "spice" / "deck.cir").write_text(
        text if name == "current source" else text.replace("\n.tran", inner, 1)
    )
    (tmp_path / "spice" / "board.cir").write_text("* another\n")
    status, _, error = harvester("run", "spice/deck.cir")
    assert status == 2 and "harvester adopt spice/deck.cir makes a board" in error
    status, _, error = harvester("new", "mine.toml", *DEVICE, "--netlist", "spice/deck.cir")
    assert (status, error.count("\n"), [*tmp_path.glob("*.toml")]) == (2, 1, [])
    remedy = shlex.split(error.partition("; ")[2].partition(" leaves out")[0])
    assert remedy == ["harvester", "adopt", "spice/deck.cir", "--out", "spice/adopted.cir"]
    status, out, error = harvester(*remedy[1:])
    assert (status, error) == (0, "")
    new = shlex.split(out.partition("new scene of it: ")[2].partition("\n")[0])
    status, out, error = harvester(*new[1:], *DEVICE)
    assert (status, error) == (0, "") and "--vary load.parameters.RL=" in out
    scene = hv.load(new[2])
    assert ({*scene.load.terminals}, scene.load.resistor) == ({"A", "B"}, "RL")
    assert load_circuit(scene.load, 33e-9).value_warnings == ()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--terminals", "A,B"], "--netlist must be given with --terminals, but is left out"),
        (["--netlist", "bridge", "--store", "C1"], "load.store must be used with load.terminals"),
        (["--netlist", "./x.cir", "--terminals", "A"], "--terminals must be two nets"),
    ],
)
def test_boards_that_no_new_scene_has(tmp_path, harvester, words, says):
    """One line names the option."""
    status, _, error = harvester("new", tmp_path / "mine.toml", *DEVICE, *words)
    assert (status, error.count("\n")) == (2, 1) and says in error
    assert not [*tmp_path.iterdir()]


LOOSE = (
    "* a deck\nI1 0 p SIN(0 40u 46)\nC0 p 0 {c}\nD1 p out d\n{more}\n.model d D\n.tran 1m 1\n.end\n"
)


def loosely(folder, more, c="40n"):
    path = folder / "loose.net"
    path.write_text(LOOSE.format(c=c, more=more))
    return adopt(path)


def test_a_subcircuit_s_parameter_is_not_the_deck_s(tmp_path):
    """The load got the 7 ohm of a parameter of that name inside."""
    inside = ".subckt foo a b\n.param RL=7\nR9 a b {RL}\n.ends\nX1 out 0 foo\n"
    more = f".param RL=100k\n{inside}Rload out 0 {{RL}}\n.step param RL list 1k 2k"
    assert "Rload out 0 {RL}" in loosely(tmp_path, more).text


def test_a_parameter_that_depends_on_the_stepped_one_is_another_user(tmp_path):
    more = ".param RL=100k\n.param RX={2*RL}\nRload out 0 {RL}\nR2 out 0 {RX}\n.step param RL list 1k 2k"
    remarks = {one.code for one in loosely(tmp_path, more).diagnostics}
    assert "deck_step_left_out" in remarks
    assert "deck_step" not in remarks


@pytest.mark.parametrize(
    ("step", "values"),
    [
        ("oct param RL 1k 8k 1", "1000,2000,4000,8000"),
        ("dec param RL 1k 100k 2", "1000:100000:5"),
        ("param RL list 1k 1234567", "1000,1234567"),
    ],
)
def test_a_step_has_the_deck_s_values(tmp_path, step, values):
    """Octaves over less than a decade became four even steps; a long number lost its last digit."""
    more = f".param RL=100k\nRload out 0 {{RL}}\n.step {step}"
    told = {one.code: one for one in loosely(tmp_path, more).diagnostics}
    assert told["deck_step"].numbers["values"] == values


def test_capacitors_of_a_piezo_count_together(tmp_path):
    assert loosely(tmp_path, "Rload out 0 100k", c="C=40n").capacitance == "40n"
    several = loosely(tmp_path, "Rload out 0 100k\nC8 p 0 10n m=3")
    assert several.capacitance == "70n"


def test_a_source_in_series_with_one_part_asks_for_the_terminals(tmp_path):
    """The rest of the piezo's own model would have stayed on the board."""
    path = tmp_path / "series.net"
    path.write_text(
        "* s\nV1 a 0 SIN(0 5 46)\nR1 a p 10\nC1 p 0 40n\nRload p 0 100k\n.tran 1m 1\n.end\n"
    )
    with pytest.raises(InputError, match="R1 is in series with V1"):
        adopt(path)
    path.write_text(
        "* s\nVCLK g 0 PULSE(0 1 0 1n 1n 1m 2m)\nRg g 0 1k\nRload p 0 100k\n.tran 1m 1\n.end\n"
    )
    with pytest.raises(InputError, match="has none"):
        adopt(path)
    path.write_text("* s\nI1 0 p SIN(0 1 1)\nC1 p 0 1n\n.ends\nRload p 0 1k\n.end\n")
    with pytest.raises(InputError, match="end a subcircuit that began"):
        adopt(path)


@pytest.mark.parametrize(
    ("card", "helps"), [(".shell ls", False), (".noise v(P) Vx dec 1 1 2", True)]
)
def test_a_board_is_sent_to_adopt_only_for_cards_that_it_leaves_out(tmp_path, card, helps):
    """The remedy refused the card that it was given for."""
    path = deck(tmp_path, f"t\n{BRIDGE}{LOAD}{DIODE}{card}\n.end\n", "board.cir")
    load = Load(netlist=str(path), terminals=("A", "B"), resistor="RL")
    with pytest.raises(InputError, match=f"but is '{card.split()[0]}'") as refused:
        load_circuit(load)
    assert ("harvester adopt" in str(refused.value)) == helps
    if helps:
        assert card not in adopt(path, ("A", "B"), "RL").text


def test_a_board_of_resistors_and_capacitors_needs_an_end(tmp_path):
    """The message named five cards, none of which was needed."""
    path = deck(tmp_path, "t\nR1 a b 1k\nC1 b 0 1u\nR2 b 0 100k\n", "board.cir")
    load = Load(netlist=str(path), terminals=("a", "0"), resistor="R2")
    with pytest.raises(InputError, match=r"or \.end, but has none"):
        load_circuit(load)
    deck(tmp_path, f"{path.read_text()}.end\n", "board.cir")
    assert load_circuit(load).names.keys() == {"a", "b", "0"}


def test_a_load_of_no_resistance_is_named_as_in_the_schematic(tmp_path):
    path = deck(tmp_path, f"t\n{BRIDGE}Cs P 0 40n\nRbig P 0 -1k\n{DIODE}.end\n", "board.cir")
    with pytest.raises(InputError, match=r"line 7 must be above 0, for Rbig, but is -1000\.0"):
        load_circuit(Load(netlist=str(path), terminals=("A", "B"), resistor="Rbig"))
