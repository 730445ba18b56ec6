"""What a probe names in a netlist is found in the whole circuit, inside called subcircuits as well."""

import pytest

from harvester.errors import InputError
from harvester.netlists.load_circuit import load_circuit
from harvester.netlists.probes import element_powers, read_probes
from harvester.scene.load import Load

OWN = """* two chips
.subckt chip in out k=1
D1 in m fast
B1 m out I=v(m,out)*{k}
.ends
.subckt mine pz n R=1k
X1 pz a chip k={1m*(R+1)}
X2 pz a chip
Q1 a pz 0 npnmodel
Rload (a , n) {R}
K1 L1 L2 0.9
L1 a 0 1m
L2 a 0 1m
.model npnmodel npn
.ends
.model fast D(Is=1n)
"""


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.cir").write_text(OWN)
    return load_circuit(Load(netlist=str(tmp_path / "own.cir")))


def test_elements_of_called_subcircuits(own):
    found = {
        part.name: tuple(node.removeprefix("xload.") for node in part.nodes) for part in own.parts
    }
    assert found == {
        "x1.d1": ("p", "x1.m"),
        "x1.b1": ("x1.m", "a"),
        "x2.d1": ("p", "x2.m"),
        "x2.b1": ("x2.m", "a"),
        "q1": ("a", "p", "0"),
        "rload": ("a", "0"),
        "k1": (),
        "l1": ("a", "0"),
        "l2": ("a", "0"),
    }
    assert set(element_powers(own)) == {"x1", "x2", "q1", "l1", "l2"}


def test_vectors_of_probes(own):
    """The second terminal is ground; a power is a voltage times a current, or of a transistor ngspice's own."""
    probes = read_probes(
        ["v(pz)", "V(x1.m, a)", "i(x2.d1)", "p(load)", "p(q1)", "v(pz)", "v(a,n)"], own
    )
    assert [one.vectors for one in probes] == [
        ("p",),
        ("xload.x1.m", "xload.a"),
        ("@d.xload.x2.d1[id]",),
        ("xload.a", "@r.xload.rload[i]"),
        ("@q.xload.q1[p]",),
        ("xload.a",),
    ]
    assert [one.unit for one in probes] == ["V", "V", "A", "W", "W", "V"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("store", "Csmooth"),
        ("v(x1.n)", "did you mean 'x1.m'"),
        ("i(x1.d2)", "did you mean 'x1.d1'"),
        ("i(a,b)", "must be store, v"),
        ("v(`id`)", "must be store, v"),
        ("", "must be store, v"),
        ("/VLOAD", "such as v(/VLOAD"),
    ],
)
def test_refusals(own, text, said):
    with pytest.raises(InputError, match=said.replace("(", r"\(")):
        read_probes([text], own)
