"""Values of a deck that a scene writes otherwise: the piezo's capacitance, and steps."""

import pytest

from harvester.errors import InputError
from harvester.netlists.adoption import adopt
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load

DECK = """* a deck
.param CP=41n
I1 0 p SIN(0 40u 46)
C0 p 0 {c}
D1 p out d
Rload out 0 {{RL}}
.param RL=100k
.model d D
{step}
.end
"""


def adopted(folder, c="41n", step=""):
    path = folder / "values.cir"
    path.write_text(DECK.format(c=c, step=step))
    return adopt(path)


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("41n", "41n"),
        ("41nF", "41n"),
        ("41N", "41n"),
        ("0.041M", "41u"),
        ("41F", "41f"),
        ("4n7", "4n"),
        ("{CP}", "41n"),
        ("c=41.259n", "41.259n"),
        ("5e-9 m=2", "10n"),
        ("33n scale=2", "66n"),
        ("{2*CP}", "82n"),
    ],
)
def test_the_capacitance_is_a_number_of_the_scene(tmp_path, written, value):
    """`M` is milli in SPICE and mega in a scene; the text of the deck was printed as it is."""
    assert adopted(tmp_path, written).capacitance == value


PART = ".param CP=33n\n{call}\n.subckt PZ a b {head}\nI1 b a SIN(0 1m 61)\n{body}\n.ends"


@pytest.mark.parametrize(
    ("call", "head", "body", "value"),
    [
        ("XP p 0 PZ", "", "C1 a b {CP}", "33n"),
        ("XP p 0 PZ", "CP=10n", "C1 a b {CP}", "10n"),
        ("XP p 0 PZ CP=20n", "CP=10n", "C1 a b {CP}", "20n"),
        ("XP p 0 PZ PARAMS: CP=20n", "PARAMS: CP=10n", "C1 a b {CP}", "20n"),
        ("XP p 0 PZ CP={CP}", "CP=10n", "C1 a b {CP}", "33n"),
        ("XP p 0 PZ", "CP=10n", ".param CP=44n\nC1 a b {CP}", "44n"),
        ("XP p 0 PZ CP=20n", "", ".param CP=44n\nC1 a b {CP} m=3", "60n"),
        ("XP p 0 PZ m=2", "", "C1 a b 33n", "66n"),
    ],
)
def test_names_in_a_subcircuit_have_its_own_values(tmp_path, call, head, body, value):
    """They had those of the deck's parameters."""
    path = tmp_path / "part.cir"
    part = PART.format(call=call, head=head, body=body)
    path.write_text(f"t\n{part}\nD1 p out d\nRL out 0 1k\n.model d D\n.end\n")
    assert adopt(path).capacitance == value


@pytest.mark.parametrize("written", ["{CQ}", "{CP*f(2)}", "{CA}"])
def test_a_capacitance_that_is_not_known_is_no_value_of_the_scene(tmp_path, written):
    adoption = adopted(tmp_path, written, ".func f(x) {2*x}\n.param CA={CB} CB={CA}")
    told = {one.code: one for one in adoption.diagnostics}
    assert adoption.capacitance == ""
    assert "deck_capacitance" not in told
    assert str(told["deck_capacitance_open"]).endswith("[piezo] capacitance")


@pytest.mark.parametrize(
    ("written", "code"), [("4n7", "digits_behind_suffix"), ("41F", "farad_or_femto")]
)
def test_an_unintended_capacitance_of_the_piezo_is_a_warning(tmp_path, written, code):
    assert code in {one.code for one in adopted(tmp_path, written).diagnostics}


@pytest.mark.parametrize(
    ("cards", "value"),
    [
        (".param a=2\n.param CQ=a * 33n", ""),
        (".param CQ=33 n", ""),
        (".param CQ=33n, a=2", "33n"),
        (".param a=2 CQ=min(a, 3)*1n", "2n"),
        (".param a=2 CQ={a*16.5n}", "33n"),
    ],
)
def test_a_parameter_s_text_ends_at_the_next_name(tmp_path, cards, value):
    """A text that was cut at a blank or a comma gave 2 F and 33 F."""
    path = tmp_path / "texts.cir"
    path.write_text(DECK.format(c="{CQ}", step=cards))
    assert adopt(path).capacitance == value


@pytest.mark.parametrize(
    ("head", "call", "value"),
    [("CP=10n", "", "10n"), ("CP=10n", "CP=7n", "10n"), ("CP={CP}", "", "5n")],
)
def test_names_of_a_subcircuit_are_not_those_of_the_deck(tmp_path, head, call, value):
    """The deck's CQ is twice the deck's CP, whatever the piezo's subcircuit calls CP."""
    named = "{CP}" if head == "CP={CP}" else "{CQ}"
    path = tmp_path / "scopes.cir"
    path.write_text(
        f"* s\n.param CP=5n CQ={{2*CP}}\nXP P 0 PZ {call}\n.subckt PZ a b {head}\n"
        f"I1 b a SIN(0 40u 46)\nC1 a b {named}\n.ends\nD1 P out d\nRload out 0 100k\n.model d D\n.end\n"
    )
    assert adopt(path).capacitance == value


def test_a_capacitance_is_above_zero(tmp_path):
    with pytest.raises(InputError, match="capacitance above 0 F"):
        adopted(tmp_path, "-41n")


def test_a_step_whose_value_ltspice_reads_otherwise_is_a_warning(tmp_path):
    remarks = adopted(tmp_path, step=".step param RL list 1k 4k7").diagnostics
    (odd,) = (one for one in remarks if one.code == "digits_behind_suffix")
    assert (odd.numbers["value"], odd.numbers["other"]) == (4000.0, 4700.0)


def test_a_step_of_many_values_says_so(tmp_path):
    remarks = adopted(tmp_path, step=".step param RL 1k 1Meg 10k").diagnostics
    assert "deck_step_too_long" in {one.code for one in remarks}


@pytest.mark.parametrize(
    "step",
    [
        ".step NPN 2N2222(VAF) 50 100 25",
        ".step lin D 1N4148(Is) list 1n 2n",
        ".step temp -40 85 1",
        ".step param CP 1n 1u 1n",
    ],
)
def test_a_step_of_no_single_element_says_so(tmp_path, step):
    """A model's name was a number, and too many values were the reason."""
    told = {one.code for one in adopted(tmp_path, step=step).diagnostics}
    assert "deck_step_left_out" in told
    assert not told & {"digits_behind_suffix", "deck_step_too_long"}


@pytest.mark.parametrize("card", [".param", ".param ; values", ".params\n+"])
def test_a_card_without_parameters_is_one_line(tmp_path, card):
    """It was an internal error."""
    path = tmp_path / "board.cir"
    path.write_text(f"t\nD1 P o DX\nRL o 0 1k\n.model DX D\n{card}\n.end\n")
    with pytest.raises(InputError, match=r"line 5 must set parameters, as in \.param a=1"):
        load_circuit(Load(netlist=str(path), terminals=("P", "0"), resistor="RL"))


@pytest.mark.parametrize("card", [".ac dec 1 1 2", ".step param X 1 2 3", ".control\nrun\n.endc"])
@pytest.mark.parametrize("bench", ["", "V1 p 0 1\n"])
def test_a_card_of_a_netlist_without_a_bench_has_a_remedy_that_works(tmp_path, card, bench):
    """The remedy was `harvester adopt`, which makes no board of subcircuits alone."""
    path = tmp_path / "part.cir"
    part = ".subckt mine a b\nD1 a o DX\nRload o b 1k\n.model DX D\n.ends\n"
    path.write_text(f"t\n{part}{bench}{card}\n.end\n")
    with pytest.raises(InputError) as error:
        load_circuit(Load(netlist=str(path)))
    assert ("harvester adopt" in str(error.value)) == bool(bench)
    more = ", and all lines from .control to .endc" if ".control" in card else ""
    assert str(error.value).endswith(f": leave out the line{more}") == (not bench)


def test_a_subcircuit_without_a_name_is_one_line(tmp_path):
    """It was an internal error."""
    path = tmp_path / "deck.cir"
    path.write_text("t\n.subckt\n.ends\nI1 0 P SIN(0 1m 61)\nRL P 0 1k\n.end\n")
    with pytest.raises(InputError, match=r"deck deck\.cir line 2 must name its subcircuit"):
        adopt(path)


def test_a_deck_without_elements(tmp_path):
    path = tmp_path / "none.cir"
    path.write_text("* nothing\n.tran 1m 1\n.end\n")
    with pytest.raises(InputError, match="has no element outside of subcircuits"):
        adopt(path)
