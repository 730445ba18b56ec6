"""Parts by their names: one point of each one's data sheet by ngspice, and which model a netlist gets."""

import re
import subprocess

import pytest

from harvester.errors import InputError
from harvester.netlists.expression import plain_number
from harvester.netlists.load_circuit import load_circuit, netlist_folder
from harvester.netlists.netlist import part_names
from harvester.scene.load import Load

PARTS = netlist_folder() / "parts"
NPN, PNP = (
    "I1 e 0 10m\nVb b 0 0\nVc c 0 {}\nQ1 c b e {}",
    "I1 0 e 10m\nVb b 0 0\nVc c 0 {}\nQ1 c b e {}",
)
GAIN = "i(vc)/i(vb)"
# By the part's name: the circuit that its data sheet tests it in, what is measured, its least and
# its largest.
POINTS = {
    "1n4148": ("I1 0 a 10m\nD1 a 0 1N4148", "v(a)", 0.62, 1.0),
    "1n4007": ("I1 0 a 1\nD1 a 0 1N4007", "v(a)", 0.85, 1.1),
    "1n5817": ("I1 0 a 1\nD1 a 0 1N5817", "v(a)", 0.3, 0.45),
    "bat54": ("I1 0 a 1m\nD1 a 0 BAT54", "v(a)", 0.2, 0.32),
    "sms7630": ("I1 0 a 0.1m\nD1 a 0 SMS7630", "v(a)", 0.06, 0.12),
    "2n3904": (NPN.format(0.3, "2N3904"), GAIN, 100, 300),
    "2n3906": (PNP.format(-0.3, "2N3906"), GAIN, 100, 300),
    "2n5551": (NPN.format(4.3, "2N5551"), GAIN, 80, 250),
    "2n5401": (PNP.format(-4.3, "2N5401"), GAIN, 60, 240),
    "bss138": ("I1 0 d 0.22\nVg g 0 10\nM1 d g 0 BSS138", "v(d)/0.22", 0.6, 0.8),
    "ltc3588_1": (
        "Vs vin 0 4\nR1 out 0 1Meg\nX1 p q vin out 0 ltc3588_1",
        "-i(vs)",
        440e-9,
        470e-9,
    ),
    "sensor_node": ("Vs a 0 1.5\nX1 a 0 sensor_node", "-i(vs)", 95e-9, 105e-9),
    "bq25570_chip": (
        "Vs st 0 2\nR1 out 0 1Meg\nR2 in 0 1Meg\nX1 in st out 0 bq25570_chip",
        "-i(vs)",
        470e-9,
        500e-9,
    ),
}


def test_every_part_has_a_point():
    assert part_names(PARTS) == sorted(POINTS)


@pytest.mark.ngspice
@pytest.mark.parametrize("name", POINTS)
def test_a_point_of_the_data_sheet(name):
    """Forward voltage at a current, current gain at 10 mA, resistance when on, own current of a chip."""
    circuit, measured, low, high = POINTS[name]
    parts = [path.read_text() for path in sorted(PARTS.glob("*.lib"))]
    shown = f"let y = {measured}", "print y[length(y)-1]"
    deck = "\n".join(
        ["a point", circuit, *parts, ".control", "tran 10m 1 uic", *shown, ".endc", ".end\n"]
    )
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input=deck,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    found = re.findall(r"^\S+ = (\S+)$", done.stdout, re.M)
    assert len(found) == 1, done.stdout + done.stderr
    assert low < float(found[0]) < high


def netlist(tmp_path, more=""):
    path = tmp_path / "mine.cir"
    path.write_text(f"* mine\n.subckt mine p n\nD1 p a BAT54\nRload a n 1k\n.ends\n{more}")
    return load_circuit(Load(netlist=str(path))).text


def test_a_part_is_named(tmp_path):
    """Its model comes along, and no other."""
    (card,) = (
        line
        for line in (PARTS / "diodes.lib").read_text().splitlines()
        if line.startswith(".model BAT54")
    )
    models = [line for line in netlist(tmp_path).splitlines() if line.startswith(".model")]
    assert len(models) == 1
    assert {key: float(text) for key, text in re.findall(r"(\w+)=(\S+?)[ )]", models[0])} == {
        key.lower(): plain_number(text) for key, text in re.findall(r"(\w+)=(\S+?)[ )]", card)
    }


def test_a_model_of_its_own_goes_first(tmp_path):
    own = ".model bat54 D(Is=1n)"
    assert netlist(tmp_path, own + "\n").splitlines()[-1] == ".model model1 d(is=1e-09)"


def test_a_chip_brings_what_it_is_made_of(tmp_path):
    path = tmp_path / "mine.cir"
    path.write_text(
        "* mine\n.subckt mine p n\nX1 p n in out c ltc3588_1\nC1 in c 1u\nRload out c 10k\n.ends\n"
    )
    assert "x1.bshunt" in [part.name for part in load_circuit(Load(netlist=str(path))).parts]


def test_an_unknown_subcircuit_is_refused(tmp_path):
    path = tmp_path / "mine.cir"
    path.write_text(
        "* mine\n.subckt mine p n\nX1 p n in out c ltc3588_9\nC1 in c 1u\nRload out c 10k\n.ends\n"
    )
    with pytest.raises(InputError, match=r"call a subcircuit of this netlist.*ltc3588_9"):
        load_circuit(Load(netlist=str(path)))
