# ruff: noqa: E501, as a line of a deck is a line
"""Sixteen more decks in the structure of published ones: accepted and right by ngspice, or refused with a remedy that works."""

import re

import pytest

from tests.support.decks import deck, powers

DIODE = ".model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Bv=30)\n"
SWITCH = ".model SWI SW(Vt=0.5 Vh=0.1 Ron=20 Roff=500Meg)\n"
BRIDGE = "D1 A P DP\nD2 B P DP\nD3 0 A DP\nD4 0 B DP\n"
LOAD = "Cs P 0 40n\nRL P 0 250k\n"
PIEZO = "Ip A B SIN(0 50u 61)\nCp A B 33n\n"
GROUNDED = "Ip 0 X SIN(0 50u 61)\nCp X 0 33n\n"
END = ".tran 10u 1 0 10u uic\n.end\n"

# a switch closes while the voltage, delayed by R and C, is past its crest
DELAY = "Rdl {a} DL 200k\nCdl DL {b} 1n\n"
SSHI = (
    DELAY.format(a="A", b="B")
    + "Bcm G1 0 V=0.5+0.5*tanh(3*(v(DL,B)-v(A,B)-0.3))\nS1 A SA G1 0 SWI\nL1 SA SB 3.3\nRw SB SC 2k\n"
    "Da SC B DP\n"
)
SERIES = (
    "Rdl A DL 200k\nCdl DL B 1n\nBcm G1 0 V=abs(v(A,B))>abs(v(DL,B)) ? 0 : 1\nS1 A SA G1 0 SWI\nL1 SA A1 1.5\n"
    "D1 A1 P DP\nD2 B P DP\nD3 0 A1 DP\nD4 0 B DP\n"
)
LADDER = "C1 X N1 60n\nD1 0 N1 DP\nD2 N1 N2 DP\nC2 0 N2 60n\nD3 N2 N3 DP\nC3 N1 N3 60n\nD4 N3 N4 DP\nC4 N2 N4 60n\nRload N4 0 2Meg\n"
SECE = (
    BRIDGE.replace(" P DP", " R DP")
    + "Cr R 0 1n\nRh R 0 50Meg\nBg G 0 V=0.5+0.5*tanh(v(R)-4)\nBsw R T I=v(R,T)*(1e-9+1m*v(G))\nRg T 0 100k\nLp T 0 0.4\nLs 0 U 0.1\nK1 Lp Ls 0.9\nRu U 0 1Meg\n"
    "Do U OUT DP\nCo OUT 0 60n\nRload OUT 0 150k\n"
)
CHIP = (
    ".subckt HARV3 ac1 ac2 out gnd\nDa ac1 vin DP\nDb ac2 vin DP\nDc gnd ac1 DP\nDd gnd ac2 DP\nCvin vin gnd 22n\n"
    "Bq gnd out I=v(vin,gnd)>3 ? 0.8*(v(vin,gnd)-3)/100k : 0\nBi vin gnd I=v(vin,gnd)>3 ? (v(vin,gnd)-3)/100k : 20n*v(vin,gnd)\n"
    "Dz gnd vin DZ\n.ends HARV3\n.model DZ D(Is=1f N=1.1 Bv=18 Ibv=1u)\n"
)
BUCK = "D1 X I DP\nD2 0 X DP\nCi I 0 33n\nBh H 0 V=0.25*(1+tanh(2*(v(I)-3)))*(1+tanh(2*(2.2-v(OUT))))\nBsw I M I=v(I,M)*(1e-9+2m*v(H))\nRm M 0 1Meg\nDf 0 M DP\nL1 M OUT 1\nCo OUT 0 80n\nRload OUT 0 120k\n"
SUPER = (
    BRIDGE
    + "Dz 0 P DZ\nRs P S 12\nCs S 0 80n IC=0.4\nRk S 0 9Meg\nRload P 0 300k\n.model DZ D(Is=1n N=1.2 Bv=6.2 Ibv=5u Rs=8)\n"
)
BIPOLAR = "D1 X I DP\nD2 0 X DP\nCi I 0 40n\nRb I Q 470k\nDz 0 Q DZ\nQ1 I Q OUT QN\nRload OUT 0 200k\n.model QN NPN(Is=1e-14 Bf=150)\n.model DZ D(Is=1n N=1.2 Bv=3.3 Ibv=5u Rs=8)\n"
TRANSFORMER = "L1 X 0 300\nL2 S1 0 30\nL3 0 S2 30\nK12 L1 L2 0.99\nK13 L1 L3 0.99\nK23 L2 L3 0.99\nDa S1 P DP\nDb S2 P DP\nCs P 0 60n\nRL P 0 60k\n"
NEST = (
    ".subckt HALF a k\nD1 a k DP\n.ends\n.subckt FULL a b p n\nX1 a p HALF\nX2 b p HALF\nX3 n a HALF\nX4 n b HALF\n.ends\n"
    ".subckt STORE p n params: C=40n ESR=5\nR1 p m {ESR}\nC1 m n {C}\n.ends\n"
)
FLAT = BRIDGE + "Re P M 8\nCe M 0 50n\nRL P 0 250k\n"
PART = ".subckt BEAM p n\nI1 n p SIN(0 50u 61)\nC1 p n 33n\n.ends BEAM\n"
BEAM = "Vm M1 0 SIN(0 3 61)\nLm M1 M2 500\nCm M2 M3 13.6n\nRm M3 X 12k\nCp X 0 33n\n"
DOUBLER = "C1 X Y 30n\nD1 0 Y DP\nD2 Y OUT DP\nCo OUT 0 40n\nRo OUT 0 1Meg\n"

INSIDE = BEAM.replace(" X", " p").replace(" 0 ", " n ")
WRITTEN = DOUBLER.replace("1Meg", "1000k").replace("30n", "0.03\xb5")

# Each deck: its text, the lines that are left of it, the piezo's nets, and the file's encoding.
DECKS = {
    "parallel SSHI, delayed comparator": (f"SSHI\n{PIEZO}{SSHI}{BRIDGE}{LOAD}{DIODE}{SWITCH}{END}", SSHI + BRIDGE + LOAD + DIODE + SWITCH, "A B"),
    "series SSHI": (f"S-SSHI\n{PIEZO}{SERIES}{LOAD}{DIODE}{SWITCH}.meas tran pw avg v(P)*i(RL)\n{END}", SERIES + LOAD + DIODE + SWITCH, "A B"),
    "ladder of four": (f"* ladder\nVp 1 0 SIN(0 9 61)\nCp 1 X 33n\n{LADDER}{DIODE}{END}", LADDER + DIODE, "X 0"),
    "SECE flyback with coupled inductors": (f"SECE\n{PIEZO}{SECE}{DIODE}{SWITCH}.options method=gear\n{END}", SECE + DIODE + SWITCH, "A B"),
    "a chip as behavioural sources": (f"chip\n{PIEZO}Xu A B OUT 0 HARV3\nCo OUT 0 47n\nRload OUT 0 100k\n{CHIP}{DIODE}.ic v(OUT)=0\n{END}",
                                      f"Xu A B OUT 0 HARV3\nCo OUT 0 47n\nRload OUT 0 100k\n{CHIP}{DIODE}", "A B"),
    "hysteretic buck": (f"* buck\n{GROUNDED}{BUCK}{DIODE}{SWITCH}.save v(out)\n{END}", BUCK + DIODE + SWITCH, "X 0"),
    "clamped supercapacitor with its series resistance": (f"* cap\n{PIEZO}{SUPER}{DIODE}.nodeset v(P)=1\n{END}", SUPER + DIODE, "A B"),
    "bipolar series regulator": (f"* q\n{GROUNDED}{BIPOLAR}{DIODE}.op\n{END}", BIPOLAR + DIODE, "X 0"),
    "transformer with two secondaries": (f"* t\n{GROUNDED}{TRANSFORMER}{DIODE}{END}", TRANSFORMER + DIODE, "X 0"),
    "subcircuits in subcircuits": (f"* n\n{PIEZO}{NEST}Xf A B P 0 FULL\nXs P 0 STORE C=50n ESR=8\nRL P 0 250k\n{DIODE}{END}", FLAT + DIODE, "A B"),
    "the piezo as a subcircuit": (f"* s\nXpz A B BEAM\n{PART}{BRIDGE}{LOAD}{DIODE}{END}", BRIDGE + LOAD + DIODE, "A B"),
    "cantilever as mass, spring and damper": (f"* b\n{BEAM}{DOUBLER}{DIODE}{END}", DOUBLER + DIODE, "X 0"),
    "cantilever as a subcircuit, in cp1252": (
        f"* \xb5W\n.subckt CANT p n\n{INSIDE}.ends\nX\xa71 X 0 CANT\n{WRITTEN}{DIODE}{END}",
        DOUBLER + DIODE, "X 0", "cp1252"),
    "LTspice with step and measures, in UTF-16": (
        f"* C:\\a.asc\nV1 N001 0 SINE(0 9 61)\nC1 N001 X 33n\nD1 X OUT DP\nD2 0 X DP\nC2 OUT 0 40n V=50\nR1 OUT 0 {{RL}}\n.param RL=250k\n{DIODE}"
        ".step param RL list 50k 100k 250k\n.tran 0 2 0 20u\n.meas TRAN P AVG V(out)**2/RL\n.backanno\n.end\n",
        f"D1 X OUT DP\nD2 0 X DP\nC2 OUT 0 40n\nR1 OUT 0 250k\n{DIODE}", "X 0", "utf-16"),
    "MOSFET rectifier": (f"* m\n{GROUNDED}M1 X X OUT OUT PM W=200u L=1u\nD2 0 X DP\nCo OUT 0 40n\nRo OUT 0 250k\n.model PM PMOS(Level=1 Vto=-0.5 Kp=40u)\n{DIODE}{END}",
                         f"M1 X X OUT OUT PM W=200u L=1u\nD2 0 X DP\nCo OUT 0 40n\nRo OUT 0 250k\n.model PM PMOS(Level=1 Vto=-0.5 Kp=40u)\n{DIODE}", "X 0"),
    "three piezos of an array in parallel": (f"* a\nI1 0 X SIN(0 20u 61)\nI2 0 X SIN(0 20u 61 0 0 40)\nI3 0 X SIN(0 15u 64)\nCp1 X 0 11n\nCp2 X 0 11n\nCp3 X 0 11n\n{DOUBLER}{DIODE}{END}",
                                             DOUBLER + DIODE, "X 0"),
}  # fmt: skip


@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_a_published_structure_is_accepted_and_right(tmp_path, name):
    text, left, nets, *encoding = DECKS[name]
    path = deck(tmp_path, text, "deck.cir", *encoding)
    adoption, mine, right = powers(path, left)
    assert sorted(adoption.terminals) == sorted(nets.split())
    assert right > 1e-10
    assert mine == pytest.approx(right, rel=5e-3)
    assert not re.search(r"\bSINE?\s*\(", adoption.text)  # no drive is left


SERIAL = f"* r\nV1 A1 0 SIN(0 6 61)\nR1 A1 X 4.7k\nCp X 0 33n\n{DOUBLER}{DIODE}{END}"
TWO = f"* two\nI1 0 X SIN(0 50u 61)\nC9 X 0 33n\nI2 0 Z SIN(0 9u 61)\nC8 Z 0 5n\nRz Z 0 1Meg\n{DOUBLER}{DIODE}{END}"
LOADS = f"* l\n{GROUNDED}{DOUBLER}Rs OUT W 10\nLs W 0 1\n{DIODE}{END}".replace(
    "Ro OUT 0", "R2 OUT W"
)
VENDOR = f"* v\n{GROUNDED}{DOUBLER}.lib C:\\LTspice\\lib\\vendor.lib\n{END}"
CARD = f"* k\n{GROUNDED}{DOUBLER}{DIODE}.fourier v(out)\n{END}"

# Each refused deck: its text, a part of the refusal, and the options or the edit that it names.
REFUSED = {
    "a resistor in series with the source": (SERIAL, "`terminals` A,B", ["--terminals", "X,0"], None),
    "two piezos": (TWO, "`terminals` A,B", ["--terminals", "X,0", "--load", "Ro"], None),
    "two loads": (LOADS, "`load` must name the resistor", ["--load", "R2"], None),
    "a vendor's library": (VENDOR, "dp is needed of it: copy vendor.lib there", [], ("vendor.lib", DIODE)),
    "a card that is not known": (CARD, "did you mean '.four'?", [], (".fourier", ".four")),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_the_remedy_of_a_refusal_works_when_typed(tmp_path, harvester, name):
    text, why, options, edit = REFUSED[name]
    path = deck(tmp_path, text)
    status, _, error = harvester("adopt", path)
    assert status == 2
    assert why.replace("`terminals`", "--terminals").replace("`load`", "--load") in error
    assert error.count("\n") == 1
    if edit and edit[0].endswith(".lib"):
        (tmp_path / edit[0]).write_text(edit[1])
    elif edit:
        path.write_text(text.replace(*edit))
    status, out, error = harvester("adopt", path, *options, "--out", tmp_path / "board.cir")
    assert (status, error) == (0, "")
    assert 'terminals = ["X", "0"]' in out
    assert (tmp_path / "board.cir").exists()


def test_the_branch_of_a_piezo_with_given_nets_is_left_out(tmp_path):
    """The source and its resistor stayed on the board, and supplied it."""
    from harvester.netlists.adoption import adopt

    adoption = adopt(deck(tmp_path, SERIAL), ("X", "0"))
    assert "R1" not in adoption.text
    assert "V1" not in adoption.text
    assert adoption.capacitance == "33n"
