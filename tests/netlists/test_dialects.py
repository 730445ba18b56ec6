"""What LTspice and KiCad write: constructs of theirs, encodings, libraries, folders, and numbers that both read."""

import math

import pytest

import harvester as hv
from harvester.engines.selection import serving
from harvester.equations.problem import Problem
from harvester.errors import InputError
from harvester.netlists.load_circuit import load_circuit
from harvester.netlists.part import by_name
from harvester.scene.load import Load
from tests.support import imposed_drive
from tests.support.constructs import drawn, in_series
from tests.support.ngspice_oracle import Oracle

PIEZO = 33e-9  # F
HALF_WAVE = "D1 p a dx {0}\nR2 p n 1Meg\nRload a n 300k\nCsmooth a n 20n\n.model dx D({1})"
BOARD = """* half-wave rectifier
D1 PA STORE DX
D2 0 PA DX
{store}
{load}
{more}
.model DX D(Is=3u N=1.08 Rs=5 Cjo=30p)
.end
"""


def part_of(folder, body, **keys):
    """A load circuit in a subcircuit of the body."""
    path = folder / "part.cir"
    path.write_text(f"* part\n.subckt part p n\n{body}\n.ends\n")
    return load_circuit(Load(netlist=str(path), **keys), PIEZO)


def board(folder, store="C7 STORE 0 4.7u", load="R5 STORE 0 330k", more="", encoding="utf-8"):
    """A flat board."""
    path = folder / "flat.cir"
    path.write_bytes(BOARD.format(store=store, load=load, more=more).encode(encoding))
    return load_circuit(Load(netlist=str(path), terminals=("PA", "0"), resistor="R5"), PIEZO)


def codes(circuit):
    return [remark.code for remark in circuit.value_warnings]


# A construct of LTspice's, and a text that ngspice itself takes for the same.
ALIKE = {
    "limit": (drawn("limit(v(p),-1,2)"), drawn("min(max(v(p),-1),2)")),
    "limit, bounds exchanged": (drawn("limit(v(p),2,-1)"), drawn("min(max(v(p),-1),2)")),
    "limit in braces": (in_series("{limit(300k,1k,70k)}"), in_series("70k")),
    "rser": ("C1 p a 80n Rser=30k\nRload a n 90k", "C1 p b 80n\nR1 b a 30k\nRload a n 90k"),
    "rser, lser": (
        "C1 p a 80n Rser=3k Lser=90\nRload a n 90k",
        "C1 p b 80n\nR1 b c 3k\nL1 c a 90\nRload a n 90k",
    ),
    "rser, m": ("C1 p a 40n Rser=60k m=2\nRload a n 90k", "C1 p b 80n\nR1 b a 30k\nRload a n 90k"),
    "coils": (
        "L1 p n 250 Rser=9k\nL2 a n 150\nK1 L1 L2 0.7\nRload a n 90k",
        "L1 p b 250\nR1 b n 9k\nL2 a n 150\nK1 L1 L2 0.7\nRload a n 90k",
    ),
    "source": ("V1 p a 1.5 Rser=40k\nRload a n 90k", "V1 p b 1.5\nR1 b a 40k\nRload a n 90k"),
    "ideal diode": (
        HALF_WAVE.format("", "Ron=2k Roff=200Meg Vfwd=0.4"),
        "B1 p a I=v(p,a)/200Meg+(1/2k-1/200Meg)*uramp(v(p,a)-0.4)\nR2 p n 1Meg\nRload a n 300k\nCsmooth a n 20n",
    ),
    "ideal diodes": (
        HALF_WAVE.format("m=3", "Ron=60k Vfwd=0.3"),
        "B1 p a I=(1/20k)*uramp(v(p,a)-0.3)\nR2 p n 1Meg\nRload a n 300k\nCsmooth a n 20n",
    ),
    "ideal diode that breaks down": (
        "D1 p n dx\nRload p n 300k\n.model dx D(Ron=1k Roff=1G Vfwd=9 Vrev=3 Rrev=5k)",
        "B1 p n I=1n*v(p,n)+(1m-1n)*uramp(v(p,n)-9)-(0.2m-1n)*uramp(-v(p,n)-3)\nRload p n 300k",
    ),
    "ratings": (
        "C1 p a 80n V=50 Irms=0.1 Rser=0 mfg=\"TDK\" pn=\"C16\" type=\"X7R\"\nRload a n 90k tol=5 pwr=0.1",
        "C1 p a 80n\nRload a n 90k",
    ),
}  # fmt: skip


@pytest.mark.ngspice
@pytest.mark.parametrize("name", ALIKE)
def test_a_construct_of_ltspice_is_what_ngspice_makes_of_its_equivalent(tmp_path, name):
    """Both engines: the compiled circuit, and the lines that ngspice gets."""
    text, plain = ALIKE[name]
    with Oracle() as ask:
        right = ask(f".subckt part p n\n{plain}\n.ends").power
        written = ask(part_of(tmp_path, text).text, ("p", "0"), "r.xload.rload").power
    compiled = imposed_drive.answered(tmp_path / "part.cir")
    assert right > 1e-7
    assert written == pytest.approx(right, rel=1e-3)
    assert compiled.power == pytest.approx(right, rel=1e-3), compiled.why


@pytest.mark.parametrize(
    "body, why",
    [
        ("D1 p n dx\nRload p n 1k\n.model dx D(Is=1u Ron=1)", "ideal diode"),
        ("D1 p n dx area=2\nRload p n 1k\n.model dx D(Ron=1)", "no key but m"),
        ("D1 p n dx\nRload p n 1k\n.model dx D(Ron=0)", "above 0"),
        ("D1 p n dx\nRload p n 1k\n.model dx D(Ron=1 Epsilon=0.1)", "epsilon"),
        ("C1 p n 1n Rpar=1Meg\nRload p n 1k", "have rpar as an element of its own"),
        ("D1 p n dx\nRload p n 1k\n.model dx D(Is-2u N=1.1)", "have is=2u with a sign ="),
        ("D1 p n dx\nRload p n 1k\n.model dx D(Is=2u Wxyz=1)", "remove it"),
        ("R1 p n rx 1k\nRload p n 1k\n.model rx RES(T_ABS=20 TC1=1m)", "t_abs"),
        ("B1 p n I=limit(v(p),1)\nRload p n 1k", "limit(x, low, high)"),
        ("C1 p a 1n Rser=1\nRser_C1 a n 1\nRload p n 1k", "no other element"),
    ],
)
def test_what_has_no_equivalent_is_refused(tmp_path, body, why):
    with pytest.raises(InputError) as error:
        part_of(tmp_path, body)
    assert why in str(error.value)
    assert "\n" not in str(error.value)


def test_a_temperature_that_changes_nothing_is_left_out(tmp_path):
    circuit = part_of(tmp_path, "R1 p n rx 1k\nRload p n 1k\n.model rx RES(T_ABS=-273.15)")
    assert by_name(circuit.parts)["r1"].number == 1e3


def test_an_initial_voltage_is_that_of_the_capacitor_behind_its_resistance(tmp_path):
    for store in ("C7 STORE 0 4.7u Rser=2 Lser=1n", "C7 0 STORE 4.7u Rser=2"):
        circuit = board(tmp_path, store=store, more=".ic v(STORE)=1.5")
        sign = 1.0 if store.startswith("C7 S") else -1.0
        assert by_name(circuit.parts)["csmooth"].options["ic"] == sign * 1.5


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
def test_encodings(tmp_path, encoding):
    """The signs that LTspice writes: micro, ohm but in cp1252, and between a letter and a name."""
    ohm = "" if encoding == "cp1252" else "Ω"
    circuit = board(
        tmp_path,
        "C7 STORE 0 4.7µ ; Müller",
        f"R5 STORE 0 330k{ohm}",
        "X§U1 STORE 0 LEAK\n.subckt LEAK a b\nR1 a b 50Meg\n.ends",
        encoding,
    )
    parts = by_name(circuit.parts)
    assert parts["csmooth"].number == pytest.approx(4.7e-6)
    assert parts["rload"].number == 330e3
    assert parts["x_u1.r1"].number == 50e6


@pytest.mark.parametrize("card", ['.lib "two words.lib"', ".lib two words.lib", ".LIB sub\\d.lib"])
def test_a_library_without_sections(tmp_path, card):
    (tmp_path / "sub").mkdir()
    for name in ("two words.lib", "sub/d.lib"):
        (tmp_path / name).write_text(".model DY D(Is=7u)\n")
    circuit = board(tmp_path, more=f"{card}\nD9 PA STORE DY")
    assert by_name(circuit.parts)["d9"].model.values == {"is": pytest.approx(7e-6)}


def test_a_library_with_sections_needs_one(tmp_path):
    (tmp_path / "s.lib").write_text(".lib tt\n.model DY D(Is=7u)\n.endl\n")
    with pytest.raises(InputError, match="tt"):
        board(tmp_path, more=".lib s.lib")


UNSERVED = """.model DZ D(Is=2u)
.model BIG NMOS(Level=14 Vth0=.4)
.model TYPO D(wxyz=1)
.model ARRAY filesource(amplscale=[1])
.subckt AMPLIFIER 1 2
A1 1 2 am
E1 1 2 laplace {v(1)} {1/s}
.ic v(1)=2
.subckt INNER a b
R1 a b 1
.ends
.ends
.subckt MANY a b m=2
R1 a b 1
.ends
"""


def test_a_library_is_refused_for_what_is_used_alone(tmp_path):
    (tmp_path / "vendor.lib").write_text(UNSERVED)
    include = '.include "vendor.lib"\n'
    assert board(tmp_path, more=include + "D9 PA STORE DZ").parts
    for used, why in (
        ("D9 PA STORE TYPO", "wxyz"),
        ("M9 PA STORE 0 0 BIG", "level"),
        ("X9 PA STORE AMPLIFIER", "a1"),
        ("X9 PA STORE MANY", "parameter m"),
    ):
        with pytest.raises(InputError, match=why):
            board(tmp_path, more=include + used)


SCENE = """[oscillator]
mass = "9 g"
frequency = "52 Hz"
damping_ratio = 0.01
[piezo]
coupling = "1.2e-3 N/V"
capacitance = "33 nF"
[excitation]
acceleration_amplitude = "0.3 g"
frequency = "52 Hz"
[load]
netlist = "hardware/power/board.cir"
terminals = ["PA", "0"]
resistor = "R5"
"""


@pytest.mark.parametrize(
    "include, inside",
    [
        ("../../models/d.lib", True),
        ("..\\..\\models\\d.lib", True),
        ("{top}/models/d.lib", True),
        ("own/d.lib", True),
        ("../../../outside.lib", False),
        ("../../link.lib", False),
        ("{top}/../outside.lib", False),
        ("../../linked/d.lib", False),
    ],
)
def test_a_netlist_may_include_what_is_below_the_folder_of_the_scene(tmp_path, include, inside):
    """A project in folders; nothing above the scene's folder, and no link out of it."""
    top = tmp_path / "project"
    for folder in ("hardware/power/own", "models"):
        (top / folder).mkdir(parents=True)
        (top / folder / "d.lib").write_text(".model DY D(Is=7u)\n")
    (tmp_path / "elsewhere").mkdir()
    for outside in ("outside.lib", "elsewhere/d.lib"):
        (tmp_path / outside).write_text(".model DY D(Is=7u)\n")
    (top / "link.lib").symlink_to(tmp_path / "outside.lib")
    (top / "linked").symlink_to(tmp_path / "elsewhere")
    more = f'.include "{include.format(top=top)}"\nD9 PA STORE DY'
    text = BOARD.format(store="C7 STORE 0 4.7u", load="R5 STORE 0 330k", more=more)
    (top / "hardware/power/board.cir").write_text(text)
    (top / "scene.toml").write_text(SCENE)
    load = hv.load(top / "scene.toml").load
    if inside:
        assert "d9" in by_name(load_circuit(load, PIEZO).parts)
    else:
        with pytest.raises(InputError, match=r"scene's folder .copy it there"):
            load_circuit(load, PIEZO)


@pytest.mark.parametrize(
    "lines, code, words",
    [
        ({"load": "R5 STORE 0 3k3"}, "digits_behind_suffix", "reads as 3 kohm and LTspice as 3.3 kohm: is 3.3k"),
        ({"store": "C7 STORE 0 4u7"}, "digits_behind_suffix", "is 4.7u meant"),
        ({"more": "R9 PA STORE 4R7"}, "digits_behind_suffix", "LTspice as 4.7 ohm: is 4.7 meant"),
        ({"load": "R5 STORE 0 2M"}, "mega_or_milli", "which is 2 mohm: M is milli in SPICE; is 2Meg meant"),
        ({"store": "C7 STORE 0 .33F"}, "farad_or_femto", "0.33 fF: F is femto in SPICE; is .33 meant"),
        ({"load": "R5 STORE 0 1u"}, "unusual_element", "far outside"),
        ({"more": "C9 PA 0 34n"}, "piezo_capacitance_twice", "C9 (flat.cir line 6), 34 nF, is across the piezo"),
        ({"more": ".param rx=4k7\nR9 PA STORE {rx}"}, "digits_behind_suffix", "is 4.7k meant?"),
        ({"more": ".param rx=1M\nR9 PA STORE {1g+rx}"}, "mega_or_milli", "is 1Meg meant?"),
        ({"more": ".subckt leak a b r=2M2\nR1 a b {1k+r}\n.ends\nX9 PA STORE leak"}, "digits_behind_suffix", "2.2M"),
        ({"more": ".subckt leak a b\nR1 a b 4k7\n.ends\nX9 PA STORE leak"}, "digits_behind_suffix", "R1 ("),
        ({"more": ".subckt leak a b r=1k\nR1 a b {1k+r}\n.ends\nX9 PA STORE leak r=1M"}, "mega_or_milli", "r ("),
        ({"more": "V9 PX 0 3V3\nR9 PX STORE 10k"}, "digits_behind_suffix", "is 3.3 meant?"),
        ({"more": "D9 STORE PA DX"}, "antiparallel_diodes", "nothing is rectified"),
        ({"more": "C8 PX PA 1n\nD9 PX STORE DX"}, "no_return_path", "D9 has no return path for a direct current"),
    ],
)  # fmt: skip
def test_what_was_probably_meant_is_warned_of(tmp_path, lines, code, words):
    circuit = board(tmp_path, **lines)
    assert codes(circuit) == [code]
    assert circuit.value_warnings[0].severity == "warning"
    assert words in str(circuit.value_warnings[0])


@pytest.mark.parametrize(
    "lines",
    [
        {"load": "R5 STORE 0 10k0"},
        {"load": "R5 STORE 0 4.7Meg"},
        {"more": "R9 PA STORE 50m"},
        {"more": "C9 PA 0 2.2p"},
        {"more": "C9 PA 0 470n"},
        {"more": "C9 PA STORE 33n"},
        {"store": "C7 STORE 0 0.33"},
        {"more": "R9 PA STORE 10kohm"},
        {"more": "D9 STORE PX DX\nR8 PX PA 10"},
        {"more": ".param rx=4.7k cx=1m\nR9 PA STORE {rx}\nC9 PA STORE {cx}"},
        {"more": "V9 PX 0 SIN(0 1 60)\nR9 PX STORE 10k"},
        {"more": "C8 PX PA 1n\nD9 PX STORE DX\nD8 0 PX DX"},
        {"more": "C8 PX PA 1n\nD9 PX STORE DX\nL8 PX 0 1m"},
        {"more": ".model DZ D(Is=1n bv=5.1)\nD8 PA X DZ\nD9 0 X DZ"},
        {"more": "T8 STORE 0 A 0 z0=50 td=1n\nD9 A B DX\nR8 B 0 1k"},
    ],
)
def test_usual_values_are_not_warned_of(tmp_path, lines):
    assert codes(board(tmp_path, **lines)) == []


def test_the_meaning_of_spice_is_kept(tmp_path):
    parts = by_name(board(tmp_path, "C7 STORE 0 4u7", "R5 STORE 0 2M").parts)
    assert parts["csmooth"].number == pytest.approx(4e-6)
    assert math.isclose(parts["rload"].number, 2e-3)


@pytest.mark.ngspice
def test_an_answer_has_the_warning(tmp_path):
    path = tmp_path / "flat.cir"
    path.write_text(BOARD.format(store="C7 STORE 0 4u7", load="R5 STORE 0 330k", more=""))
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("hardware/power/board.cir", "flat.cir"))
    answer = hv.run(scene, engine="compiled", budget=20.0)
    assert "digits_behind_suffix" in [remark.code for remark in answer.diagnostics]


@pytest.mark.parametrize("store", ["C7 STORE 0 4.7u", "C7 STORE 0 4.7u Rser=90 Lser=1u"])
def test_a_store_with_a_resistance_of_its_own_needs_no_separation_of_times(tmp_path, store):
    """Engine `slow`, whose error is larger, is for circuits behind the rectifier that switch."""
    bridge = "D1 PA STORE DX\nD2 PB STORE DX\nD3 0 PA DX\nD4 0 PB DX\n"
    diodes = ".model DX D(Is=3u N=1.08 Rs=5 Cjo=30p)\n.end\n"
    (tmp_path / "flat.cir").write_text(f"* x\n{bridge}{store}\nR5 STORE 0 330k\n{diodes}")
    text = SCENE.replace("hardware/power/board.cir", "./flat.cir").replace('"0"]', '"PB"]')
    (tmp_path / "scene.toml").write_text(text)
    assert "slow" not in serving(Problem.of(tmp_path / "scene.toml"))


@pytest.mark.parametrize("element", ["R9 PA STORE rm 30k", "L9 PA STORE rm 200"])
@pytest.mark.parametrize("degrees", ["0", "50"])
def test_a_model_of_another_nominal_temperature_decides_the_value(tmp_path, element, degrees):
    """Also that of 0 degrees: by ngspice it needs 26 % from the power of a resistor and 8 % from
    that of an inductor."""
    card = f".model rm {element[0]}(tc1=0.02 tnom={degrees})"
    circuit = board(tmp_path, more=f"{element}\n{card}")
    part = next(part for part in circuit.parts if part.name == element[:2].lower())
    assert part.effective_value is None
    same = board(tmp_path, more=f"{element}\n{card.replace(f'={degrees})', '=27)')}")
    part = next(part for part in same.parts if part.name == element[:2].lower())
    assert part.effective_value == part.number


@pytest.mark.ngspice
def test_a_function_capacitor_s_own_node_begins_the_next_run(tmp_path):
    """ngspice read its name, c.xload.c5_int1, for a constant, and the process ended."""
    powers = []
    for value in ("C={1u+0*v(p)}", "1u"):
        path = tmp_path / "part.cir"
        path.write_text(f"* part\n.subckt part p n\nC5 p n {value}\nRload p n 9k\n.ends\n")
        scene = hv.Scene(
            oscillator=hv.Oscillator(mass="8 g", frequency="60 Hz", damping_ratio=0.05),
            piezo=hv.Piezo(coupling="1.5e-3 N/V", capacitance="47 nF"),
            excitation=hv.Excitation(acceleration_amplitude="0.2 g", frequency="60 Hz"),
        ).with_load(netlist=str(path))
        powers.append(hv.run(scene, engine="spice").mean_power)
    assert powers[0].error95 < 1e-3 * powers[0].value
    assert powers[0].value == pytest.approx(powers[1].value, rel=1e-4)


def test_a_long_chain_of_parameters_is_refused_in_one_line(tmp_path):
    """It was an internal error, of 93 and more calls one within another."""
    chain = "\n".join(f".param a{k}={{a{k + 1}+1}}" for k in range(300))
    with pytest.raises(InputError, match="must need fewer parameters that need each other in turn"):
        part_of(tmp_path, f"{chain}\n.param a300=1\nR1 p a {{a0*1k}}\nRload a n 1Meg")
