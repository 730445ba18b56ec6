"""Load circuits: what is accepted, what is refused, each with one line."""

import pytest

from harvester.circuit.netlist import folder, load_circuit
from harvester.errors import InputError
from harvester.scene import Load

GOOD = """* mine
.subckt mine p n
+ R=1Meg C=1u
D1 p a diode
.model diode D(Is=1n)
Rload a n {R}
Csmooth a n {C} ; a comment
.ends
"""


def given(tmp_path, text, **parameters):
    path = tmp_path / "mine.cir"
    path.write_text(text)
    return load_circuit(Load(netlist=str(path), parameters=parameters))


def test_a_resistance_is_the_resistor_netlist():
    circuit = load_circuit(Load(resistance=2e6))
    assert (circuit.name, circuit.parameters, circuit.linear) == ("resistor", {"R": 2e6}, True)


@pytest.mark.parametrize("name", sorted(p.stem for p in folder().glob("*.cir")))
def test_every_shipped_netlist_is_read(name):
    circuit = load_circuit(Load(netlist=name))
    assert circuit.text.lower().startswith(f".subckt {name} p n")
    assert circuit.text.lower().splitlines()[-1].startswith(".ends")


def test_only_the_subcircuit_of_a_file_is_used(tmp_path):
    circuit = given(tmp_path, GOOD + "Vbench x 0 1\n.tran 1 1\n.control\nshell true\n.endc\n", R=2e6)
    assert circuit.text.splitlines()[0] == ".subckt mine p n R=1Meg C=1u"
    assert "bench" not in circuit.text
    assert "shell" not in circuit.text
    assert circuit.parameters == {"R": 2e6}
    assert not circuit.linear


@pytest.mark.parametrize(
    "line, word",
    [
        (".control", ".control"),
        (".include /etc/passwd", ".include"),
        (".lib secret.lib", ".lib"),
        (".INCLUDE x", ".include"),
        (".exec ls", ".exec"),
        ('A1 [p] [n] reader\n.model reader filesource (file="/etc/passwd")', "a1"),
        ('.model reader filesource (file="/etc/passwd")', "file"),
        ("B1 p n V=`ls`", "`"),
        ("*\n.\ninclude x", "."),
        ("R1 p n 1 shell ls", "shell"),
        ("%include x", "%include"),
        ("Q1 p n x y\n.tran 1 1", ".tran"),
    ],
)
def test_commands_and_files_are_refused(tmp_path, line, word):
    with pytest.raises(InputError) as caught:
        given(tmp_path, GOOD.replace("Rload", f"{line}\nRload"))
    assert word in str(caught.value).lower()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "old, new, why",
    [
        ("Rload", "Rother", "Rload"),
        ("mine p n", "mine p n ground", "two terminals"),
        ("mine p n", "mine p", "two terminals"),
        (".ends", "*", "one subcircuit"),
        (".subckt", "*", "one subcircuit"),
    ],
)
def test_a_circuit_that_is_no_load_is_refused(tmp_path, old, new, why):
    with pytest.raises(InputError, match=why):
        given(tmp_path, GOOD.replace(old, new))


def test_unknown_names_have_their_nearest_match(tmp_path):
    with pytest.raises(InputError, match="did you mean 'bridge'"):
        load_circuit(Load(netlist="brigde"))
    with pytest.raises(InputError, match="did you mean 'C'"):
        given(tmp_path, GOOD, CC=1.0)
    with pytest.raises(InputError, match="No such file"):
        load_circuit(Load(netlist=str(tmp_path / "none.cir")))
