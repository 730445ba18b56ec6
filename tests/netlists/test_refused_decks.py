# ruff: noqa: E501, as a line of a deck is a line
"""Decks that are refused: each remedy works when it is typed, and docs/decks.md has the table of them."""

import re

import pytest

from harvester.errors import InputError
from harvester.netlists.adoption import adopt
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.decks import deck
from tests.support.paths import ROOT

DIODE = ".model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Bv=30)\n"
PIEZO = "Ip 0 X SIN(0 50u 61)\nCp X 0 33n\n"
BOARD = "C1 X Y 30n\nD1 0 Y DP\nD2 Y OUT DP\nCo OUT 0 40n\nRo OUT 0 1Meg\n"
END = ".tran 10u 1\n.end\n"


def with_more(more="", piezo=PIEZO, model=DIODE):
    """A deck with more lines, and with another piezo or model."""
    return f"* deck\n{piezo}{BOARD}{model}{more}{END}"


def with_net(lines):
    """A deck with lines that make a net Z."""
    return with_more(f"{lines}Rz Z 0 1Meg\n")


FACTOR = "B1 Z 0 V={}\n".format
FIELDS = "Vs S 0 SIN(0 1 61)\n"
OPAMP = ".subckt opamp a b c\nB1 c 0 V=tanh(v(a,b))\n.ends\n"

# As docs/decks.md names them: the deck, its options, a part of the refusal, and the edit that it names.
REFUSED = {
    r"`&`, `\|` in an expression": (with_net(FACTOR("v(OUT)>1 & v(X)>0 ? 1 : 0")), "write &&", (" & ", " && ")),
    "`buf`, `inv`": (with_net(FACTOR("buf(v(OUT))")), "write x > 0.5 ? 1 : 0", ("buf(v(OUT))", "v(OUT) > 0.5 ? 1 : 0")),
    "`delay`, `absdelay`": (with_net(FACTOR("delay(v(OUT),1m)")), "a resistor and a capacitor delay", (FACTOR("delay(v(OUT),1m)"), "Rd OUT Z 1k\nCd Z 0 1u\n")),
    "`idt`, `sdt`, `idtmod`": (with_net(FACTOR("idt(v(OUT))")), "let a current source charge a capacitor", (FACTOR("idt(v(OUT))"), "B1 0 Z I=1u*v(OUT)\nC9 Z 0 1u\n")),
    "`ddt`": (with_net(FACTOR("ddt(v(OUT))")), "let a capacitor make it", (FACTOR("ddt(v(OUT))"), "C9 OUT Z 1n\n")),
    "`table`": (with_net(FACTOR("table(v(OUT),0,0,1,2)")), "write pwl", ("table", "pwl")),
    "`mc`, `flat`, `gauss`, `rand`, `white`": (with_more().replace("40n", "{mc(40n,0.1)}"), "harvester tolerance --vary", ("{mc(40n,0.1)}", "40n")),
    "`E`, `G` with `Laplace=`, `Freq=` or a table": (with_net("E1 Z 0 OUT 0 Laplace=1/(1+s)\n"), "as a B source", ("E1 Z 0 OUT 0 Laplace=1/(1+s)", "B1 Z 0 V=v(OUT)")),
    "an `A` device": (with_net("A1 OUT 0 0 0 0 0 Z 0 SCHMITT Vt=1 Vh=0.1\n"), "B sources and switches in place", ("A1 OUT 0 0 0 0 0 Z 0 SCHMITT Vt=1 Vh=0.1", "B1 Z 0 V=v(OUT)>1")),
    "`ako:`": (with_more(model=".model DQ D(Is=2u)\n.model DP ako:DQ D(N=1.2)\n"), "must have the keys of dq itself", ("ako:DQ D(N=1.2)", "D(Is=2u N=1.2)")),
    "a key of a model that ngspice lacks": (with_more(model=".model DP D(Iss=2u N=1.06)\n"), "did you mean 'is'?", ("Iss", "Is")),
    "`Epsilon=`, `Ilimit=` of an ideal diode": (with_more(model=".model DP D(Ron=10 Roff=1G Vfwd=0.3 Epsilon=0.1)\n"), "must be one of roff, ron, rrev, vfwd, vrev", (" Epsilon=0.1", "")),
    "`Rpar=`, `Cpar=`, `RLshunt=`": (with_more().replace("30n", "30n Rpar=10Meg"), "have rpar as an element of its own", ("30n Rpar=10Meg", "30n\nRp X Y 10Meg")),
    "`tc=a,b`": (with_net("R9 OUT Z 1Meg tc=1e-3,2e-6\n"), "tc=a,b as tc1=a tc2=b", ("tc=1e-3,2e-6", "tc1=1e-3 tc2=2e-6")),
    "a waveform of the board in a file": (with_net('V9 Z 0 PWL file="x.txt"\n'), "give the waveform its numbers", ('PWL file="x.txt"', "PWL(0 0 1 1)")),
    "`.if`": (with_more(".if (1)\nR9 OUT 0 1Meg\n.endif\n"), "keep the lines of the branch", (".if (1)\nR9 OUT 0 1Meg\n.endif\n", "")),
    "`.alter`, `.data`": (with_more(".alter\n"), "make a deck of each variant", (".alter\n", "")),
    "`.machine`": (with_more(".machine\n"), "as B sources and switches", (".machine\n", "")),
    "`.csparam`": (with_more(".csparam x=1\n"), "write .param", (".csparam", ".param")),
    "lines behind `.end`": (with_more().replace(".end\n", ".end\nR9 OUT 0 1\n"), "delete it, or move .end", ("R9 OUT 0 1\n", "")),
    "a library that is not there": (with_more(model=".lib C:\\LTspice\\lib\\cmp\\standard.dio\n"), "write its .model card", (".tran", DIODE + ".tran")),
    "a subcircuit of a library that is not there": (with_net("XU1 OUT 0 Z opamp\n.lib opamp.sub\n"), "or its .subckt into the deck", (".lib opamp.sub\n", OPAMP)),
    "a source that only controls `E`, `G` or `B`": (with_more(piezo=f"{FIELDS}E1 1 0 S 0 10\nCp 1 X 33n\n"), "write E1 as a source with the waveform of Vs", (f"{FIELDS}E1 1 0 S 0 10", "V1 1 0 SIN(0 10 61)")),
    "`E`, `H` or `B` in series with the source": (with_more(piezo="Vf M 0 SIN(0 1 61)\nE1 M X OUT 0 1\n"), "write the piezo's own model as one source", ("Vf M 0 SIN(0 1 61)\nE1 M X OUT 0 1", "Vf M 0 SIN(0 1 61)\nC9 M X 33n")),
}  # fmt: skip


def circuit(path):
    """The circuit of a deck's board, which is read as a scene reads it."""
    made = adopt(path)
    load = Load(
        netlist=str(path.with_name("board.cir")),
        terminals=made.terminals,
        resistor=made.resistor,
        store=made.store,
    )
    return load_circuit(load, text=made.text)


@pytest.mark.parametrize("name", REFUSED)
def test_the_remedy_of_each_refusal_works(tmp_path, name):
    text, why, (old, new) = REFUSED[name]
    assert text.count(old) == 1
    with pytest.raises(InputError) as error:
        circuit(deck(tmp_path, text))
    assert why in str(error.value)
    assert "\n" not in str(error.value)
    assert circuit(deck(tmp_path, text.replace(old, new))).text


def test_the_page_lists_the_refusals():
    page = (ROOT / "docs/decks.md").read_text().partition("## Decks that are refused")[2]
    assert set(re.findall(r"^\| (.*?) \| .* \|$", page, re.M)) - {"the deck has"} == {*REFUSED}


@pytest.mark.parametrize("encoding", ["utf-16-be", "utf-16-le", "cp1252"])
def test_a_deck_of_windows_without_a_mark_is_read(tmp_path, encoding):
    text = with_more().replace("Co OUT 0 40n", "C\xa71 OUT 0 0.04\xb5")
    assert adopt(deck(tmp_path, text, "deck.cir", encoding)).store == "C_1"


def test_lines_that_end_as_on_old_machines_are_read(tmp_path):
    assert adopt(deck(tmp_path, with_more().replace("\n", "\r"))).resistor == "Ro"


@pytest.mark.parametrize(
    "drive",
    ['PWL file="acc.txt"', "wavefile=a.wav chan=0", "PWL repeat forever (file=a) endrepeat"],
)
def test_a_drive_from_a_file_is_left_out(tmp_path, drive):
    made = adopt(deck(tmp_path, with_more(piezo=f"V1 1 0 {drive}\nCp 1 X 33n\n")))
    assert (made.terminals, made.capacitance) == (("X", "0"), "33n")
    assert drive not in made.text


def test_a_netlist_s_own_function_has_its_name(tmp_path):
    """Names of LTspice's functions are those of the netlist, if it defines them."""
    text = with_net(".func buf(x) {2*x}\n" + FACTOR("buf(v(OUT))"))
    assert circuit(deck(tmp_path, text)).text
