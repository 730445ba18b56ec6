"""Load circuits: what is accepted, what is refused, each with one line."""

import os

import pytest

from harvester.errors import InputError
from harvester.netlists.expression import plain_number
from harvester.netlists.load_circuit import load_circuit, netlist_folder
from harvester.netlists.read_lines import MOST_BYTES
from harvester.scene.load import Load

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
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_circuit(Load(netlist=str(path), parameters=parameters))


def refusal(tmp_path, text, **parameters):
    with pytest.raises(InputError) as caught:
        given(tmp_path, text, **parameters)
    said = str(caught.value)
    assert said.isprintable()  # one line
    assert len(said) < 400
    return said.lower()


def test_a_resistance_is_the_resistor_netlist():
    circuit = load_circuit(Load(resistance=2e6))
    assert (circuit.name, circuit.parameters, circuit.linear) == ("resistor", {"R": 2e6}, True)


@pytest.mark.parametrize("name", sorted(p.stem for p in netlist_folder().glob("*.cir")))
def test_every_shipped_netlist_is_read(name):
    circuit = load_circuit(Load(netlist=name))
    assert (circuit.name, circuit.topology) == (name, name)
    assert "{" not in circuit.text
    assert circuit.resistance == (1e6 if name == "resistor" else None)


def test_only_the_subcircuit_of_a_file_is_used(tmp_path):
    circuit = given(
        tmp_path,
        GOOD + "Vbench x 0 1\n.options interp\n.tran 1 1\n.print tran @r1[p]\n.end\n",
        R=2e6,
    )
    assert circuit.text.splitlines() == [
        "d.xload.d1 p xload.a model1",
        "r.xload.rload xload.a 0 2000000.0",
        "c.xload.csmooth xload.a 0 1e-06",
        ".model model1 d(is=1e-09)",
    ]
    assert circuit.parameters == {"R": 2e6}
    assert not circuit.linear


def test_a_netlist_named_resistor_is_not_the_resistor(tmp_path):
    assert not given(tmp_path, GOOD.replace("mine", "resistor"), R=2e6).linear


@pytest.mark.parametrize(
    ("lines", "ohms"),
    [
        ("+ ohms=5k\nRload n p {ohms}", 2e6),
        ("Rload p 0 47k ; nothing else", 47e3),
        ("+ ohms=5k\nRload p n {2*ohms}", 4e6),
        ("Rload p n 1k\nR2 p n 1k", None),
        ("Rload p n 1k tc1=0.01", 1e3),
        ("Rload p n 1k tc1=0.01 dtemp=10", None),
        ("Rload p n 6k m=2", 3e3),
        ("Rload p n 1k\nD1 p n diode\n.model diode D(Is=1n)", None),
    ],
)
def test_a_resistor_alone_is_known_by_what_it_is(tmp_path, lines, ohms):
    text = f"* mine\n.subckt mine p n\n{lines}\n.ends\n"
    assert given(tmp_path, text, **({"ohms": 2e6} if "ohms" in lines else {})).resistance == ohms


def test_what_the_subcircuit_uses_comes_along(tmp_path):
    """Models, parameters and subcircuits next to it, also from an included file, but nothing else."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "diodes.lib").write_text(
        ".model fast D(Is={leak})\n.model slow D(Is=1p)\n.param leak=1n other=1\n.param third=3\n.INC ../more.lib\n"
    )
    (tmp_path / "more.lib").write_text(
        ".subckt inner a b\nR1 a b 1k\n* c\n+ tc1=0\n.ends\n.subckt unused a b\n.ends\n"
    )
    text = 'a title\n.include "parts/diodes.lib"\n.subckt mine p n\nD1 p a fast\nX1 a b inner\nRload b n 1k\n.ends\n'
    assert given(tmp_path, text).text.splitlines() == [
        "d.xload.d1 p xload.a model1",
        "r.xload.x1.r1 xload.a xload.b 1000.0 tc1=0.0",
        "r.xload.rload xload.b 0 1000.0",
        ".model model1 d(is=1e-09)",
    ]


def test_what_nobody_uses_is_not_read(tmp_path):
    """A library may have what this program does not know, as long as the load does not name it."""
    more = ".model x filesource\n.subckt far a b\nA1 a b x\n.ends\n.func f(x) {f(x)+f(x)}\n.param q={nothing}\n"
    more = more.replace("A1 a b x", "R1 a b 1k 2k 3k")
    assert given(tmp_path, GOOD + more).text == given(tmp_path, GOOD).text


def test_a_parameter_of_its_own_hides_one_outside(tmp_path):
    """The subcircuit's R is its own; one that it reads from outside has the value there."""
    assert given(tmp_path, GOOD + ".param R=5\n").values["R"] == 1e6
    outside = given(tmp_path, GOOD.replace("R=1Meg", "") + ".param R=5\n")
    assert [part.number for part in outside.parts if part.name == "rload"] == [5.0]


def test_the_capacitance_of_the_piezo_is_the_default_of_cp(tmp_path):
    """A netlist that needs the piezo's capacitance has a parameter Cp; a scene's own value has precedence."""
    assert load_circuit(Load(netlist="sece"), 1e-9).parameters == {"Cp": 1e-9}
    assert load_circuit(Load(netlist="sece", parameters={"cp": 2e-9}), 1e-9).parameters == {
        "Cp": 2e-9
    }
    assert load_circuit(Load(netlist="bridge"), 1e-9).parameters == {}


HOSTILE = [
    # commands
    (".control\nshell touch {out}\n.endc", ".control"),
    (".CONTROL\nshell touch {out}\n.endc", ".control"),
    (" \t.control\nquit\n.endc", ".control"),
    (".Control echo\n.Endc", ".control"),
    (".controlled", ".controlled"),
    (".endc", ".endc"),
    ("*#shell touch {out}", "no command"),
    ("  *# shell touch {out}", "no command"),
    ("*#pre_codemodel evil.cm", "no command"),
    ("*# source {out}", "no command"),
    (".exec touch {out}", ".exec"),
    ("R1 p n 1 shell touch {out}", "shell"),
    ("R1 p n 1\n+ system", "system"),
    ("B1 p n V=`touch`", "`"),
    ("shell touch {out}", "shell"),
    ("system touch {out}", "system"),
    ("!touch {out}", "!"),
    ("pre_codemodel evil.cm", "pre_codemodel"),
    ("pre_osdi evil.osdi", "pre_osdi"),
    ("osdi evil.osdi", "osdi"),
    (".pre_osdi evil.osdi", ".pre_osdi"),
    (".osdi evil.osdi", ".osdi"),
    (".codemodel evil.cm", ".codemodel"),
    ("N1 p n evil", "n1"),
    ("unset x", "unset"),
    ("alter x=1", "alter"),
    ("set x=$HOME", "$"),
    ("R1 p n {{$HOME}}", "$"),
    ("R1 p n 1 \\\n.control", "\\"),
    ("@", "@"),
    # files
    (".include /etc/hostname", "netlist's folder"),
    (".INCLUDE '/etc/hostname'", "netlist's folder"),
    (".inc ../outside.lib", "netlist's folder"),
    (".include inner/../../outside.lib", "netlist's folder"),
    (".include ~/outside.lib", "netlist's folder"),
    (".include link.lib", "netlist's folder"),
    (".include\n+ ../outside.lib", "netlist's folder"),
    (".include", "netlist's folder"),
    (".include inner", "netlist's folder"),
    (".include pipe", "netlist's folder"),
    (".include none.lib", "netlist's folder"),
    (".include mine.cir", "within itself"),
    (".incpslt ../outside.lib", ".incpslt"),
    (".lib ../outside.lib", ".lib"),
    (".LIB '../outside.lib' tt", ".lib"),
    (".endl", ".endl"),
    (".write out", ".write"),
    (".csparam x=1", ".csparam"),
    ('A1 %v([p n]) src\n.model src filesource(file="/etc/hostname")', "a1"),
    (".model src filesource(amploffset=[0])", "filesource"),
    (".model src d_source(input_file=x)", "input_file"),
    (".model t table2d(file=x)", "file"),
    (".MODEL t\n+ File_Source(x=1)", "file_source"),
    (".model cider numd level=1", "numd"),
    (".model cider\n+ nbjt level=1", "nbjt"),
    ("D2 p n diode ic.file=x", "file"),
    ("V1 p n pwl file=x", "file"),
    ("V1 p n PWLFILE x", "pwlfile"),
    ("B1 p n V=file2d(1)", "file2d"),
    ("M1 p n n n m\n.model m nmos level=8 paramchk=1", "level"),
    (".model m nmos(level = 54)", "level"),
    (".model m nmos level 14", "level"),
    (".model m nmos level={{8}}", "level"),
    # cards that belong to the whole deck
    (".option rawfile=x", ".option"),
    (".options savecurrents", ".options"),
    (".save all", ".save"),
    (".print tran v(p) > x", ".print"),
    (".meas tran x max v(p)", ".meas"),
    (".tran 1 1", ".tran"),
    (".end", ".end"),
    (".global p", ".global"),
    (".temp 27", ".temp"),
    (".if (1)", ".if"),
    (".func f(x) {{f(x)+f(x)}}\nR1 p n {{f(1)}}", "call no function f in itself"),
    (".title x", ".title"),
    (".\ninclude x", "."),
    # sources that would speak for the mass, or draw numbers without a seed
    ("V1 p n external", "external"),
    ("I1 p n\n+ EXTERNAL", "external"),
    ("V1 p n dc 0 trnoise(1 1 1 1)", "trnoise"),
    ("V1 p n dc 0 trrandom(1 1 1 1)", "trrandom"),
    ("R1 p n {{agauss(1k,100,3)}}", "agauss"),
    ("R1 p n {{1k*UNIF (1,0.1)}}", "unif"),
    ("C1 p n 'gauss(1n,0.1,3)'", "gauss"),
    (".param q=aunif(1,1)", "aunif"),
    ("D1 p n d\n.model d d(is={{limit(1e-9,1e-10)}})", "limit"),
    ("V1 p n portnum 1 port", "port"),
    # text that is none
    ("R1 p n 1\x00k", "printable"),
    ("R1 p n 1\x0c.control", "printable"),
    ("R1 p n 1\r.control", "printable"),
    ("R1 p n 1\u2028.control", "printable"),
    ("R1 p n 1k\u00e9", "\u00e9"),
    # subcircuits without end
    (".subckt deeper a b", "inside another"),
    ("X1 p n mine", "within itself"),
    ("X1 p n nowhere", "of this netlist"),
]


@pytest.mark.parametrize("line, word", HOSTILE)
def test_commands_and_files_are_refused(tmp_path, line, word):
    """Nothing that runs a command, reaches a file elsewhere or disturbs the lock-step comes through."""
    inside = tmp_path / "scene"
    (inside / "inner").mkdir(parents=True)
    (tmp_path / "outside.lib").write_text("R1 p n 1\n")
    (inside / "link.lib").symlink_to(tmp_path / "outside.lib")
    os.mkfifo(inside / "pipe")
    said = refusal(inside, GOOD.replace("Rload", line.format(out=tmp_path / "ran") + "\nRload"))
    assert word in said
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "text", ["sesame:x:0", "-----BEGIN sesame", "\nsesame 1\nX1 sesame", "+ sesame", "*#sesame\x00"]
)
def test_the_text_of_another_file_is_never_shown(tmp_path, text):
    """Neither of a file that a scene calls a netlist, nor of one that a netlist includes."""
    assert "sesame" not in refusal(tmp_path, text)
    (tmp_path / "key").write_text(text)
    assert "netlist key" in (
        said := refusal(tmp_path, GOOD.replace("Rload", ".include key\nRload"))
    )
    assert "sesame" not in said


@pytest.mark.parametrize(
    "text, word",
    [
        ("*ng_script\n" + GOOD, "no command"),
        ("*#shell touch x\n" + GOOD, "no command"),
        (".control\n" + GOOD, ".control"),
        (GOOD + ".control\nshell true\n.endc\n", ".control"),
        (GOOD + ".include ../outside.lib\n", "folder"),
        ("* t\n+ x\n" + GOOD, "+"),
        (GOOD.encode() + b"\x81", "utf-8"),
        (b"\x7fELF\x00", "printable"),
        (GOOD + "* " + MOST_BYTES * "x", "bytes"),
        (GOOD + GOOD, "name of its own"),
        (GOOD + GOOD.replace("mine", "other"), "has 2"),
        ("* nothing\n", "hold a subcircuit"),
        ("", "hold a subcircuit"),
        (".ends\n" + GOOD, ".ends"),
        (".subckt\n" + GOOD, "have a name"),
    ],
)
def test_files_that_are_no_netlist_are_refused(tmp_path, text, word):
    assert word in refusal(tmp_path, text)


def test_a_title_is_no_line(tmp_path):
    """The first line is a title, whatever it states, as long as it is neither a card nor a command."""
    assert given(tmp_path, "shell touch x: \u00b5W circuit\n" + GOOD).name == "mine"


def test_subcircuits_that_multiply_are_refused(tmp_path):
    """Ten levels of ten calls each would be 10^10 elements."""
    levels = [
        f".subckt l{k} a b\n" + "".join(f"X{j} a b l{k + 1}\n" for j in range(10)) + ".ends\n"
        for k in range(10)
    ]
    last = ".subckt l10 a b\nR1 a b 1\n.ends\n"
    assert "elements" in refusal(
        tmp_path, GOOD.replace("Rload", "X1 p n l0\nRload") + "".join(levels) + last
    )


def test_subcircuits_that_call_each_other_are_refused(tmp_path):
    others = ".subckt one a b\nX1 a b two\n.ends\n.subckt two a b\nX1 a b one\n.ends\n"
    assert "within itself" in refusal(tmp_path, GOOD.replace("Rload", "X1 p n one\nRload") + others)


@pytest.mark.slow
def test_includes_count_towards_the_size(tmp_path):
    (tmp_path / "big.lib").write_text(20_000 * "*\n")
    assert "bytes" in refusal(tmp_path, GOOD + 8 * ".include big.lib\n")


@pytest.mark.parametrize(
    "old, new, why",
    [
        ("Rload", "Rother", "rload"),
        ("mine p n", "mine p n ground", "two terminals"),
        ("mine p n", "mine p", "two terminals"),
        ("mine p n", "mine", "two terminals"),
        ("D1 p", "D1 x", "terminal 'p'"),
        ("n {", "x {", "terminal 'n'"),
        (".ends", "*", "hold a subcircuit"),
        (".subckt mine p n\n+", "*", ".ends without .subckt"),
        ("{R}", "{R2}", "'r2' has none"),
        ("{R}", "{2*R*k+1k}", "'k' has none"),
        ("{C}", "'C/scale'", "'scale' has none"),
        ("D1 p a diode", "B1 p a I=v(p,n)*slope", "'slope' has none"),
        ("R=1Meg", "params: R", "must give r "),
        ("{R}", "{R", "braces"),
        ("{R}", "'R", "quotes"),
        ("{R}", "R='R*(1+abs(v(a)))'", "constant resistance"),
        ("{R}", "R={R*time}", "constant resistance"),
        ("R=1Meg", "R=1Meg m=2", "no parameter m"),
        ("R=1Meg", "R=1Meg sin=2", "'sin'"),
        ("R=1Meg", "R=1Meg R=2Meg", "give r once"),
    ],
)
def test_a_circuit_that_is_no_load_is_refused(tmp_path, old, new, why):
    assert why in refusal(tmp_path, GOOD.replace(old, new))


def test_ground_may_take_the_second_terminals_place(tmp_path):
    assert given(tmp_path, GOOD.replace(" n {", " 0 {")).name == "mine"


def test_a_parameter_without_default_takes_the_scenes_value(tmp_path):
    text = GOOD.replace("R=1Meg C=1u", "params: C=1u R")
    assert given(tmp_path, text, r=2e6).values == {"C": 1e-6, "R": 2e6}


def test_unknown_names_have_their_nearest_match(tmp_path):
    with pytest.raises(InputError, match="did you mean 'bridge'"):
        load_circuit(Load(netlist="brigde"))
    with pytest.raises(InputError, match="did you mean 'C'"):
        given(tmp_path, GOOD, CC=1.0)
    with pytest.raises(InputError, match="No such file"):
        load_circuit(Load(netlist=str(tmp_path / "none.cir")))
    with pytest.raises(InputError, match="readable file"):
        load_circuit(Load(netlist=f"{tmp_path}/"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5Meg", 5e6),
        ("1u", 1e-6),
        ("2.2k", 2200.0),
        ("1e-9", 1e-9),
        ("1F", 1e-15),
        ("{R}", None),
        ("", None),
    ],
)
def test_numbers_of_ngspice(text, value):
    assert plain_number(text) == (None if value is None else pytest.approx(value))


def test_charging_time_of_the_smoothing_capacitor():
    """Rload Csmooth from the scene's parameters, else from the netlist's own; none without a capacitor."""
    assert load_circuit(
        Load(netlist="bridge", parameters={"R": 1e6, "C": 2e-6})
    ).storage == pytest.approx(2.0)
    assert load_circuit(Load(netlist="sece")).storage == pytest.approx(1.0)  # 1 Meg, 1 u
    assert load_circuit(Load(resistance=1e3)).storage is None


@pytest.mark.slow
def test_calls_without_end(tmp_path):
    """Deeper than Python counts."""
    inner = "".join(f".subckt s{k} p n\nX1 p n s{k + 1}\n.ends\n" for k in range(5000))
    said = refusal(
        tmp_path,
        f"{GOOD.replace('Rload', 'X1 p n s0' + chr(10) + 'Rload', 1)}{inner}.subckt s5000 p n\nR1 p n 1\n.ends\n",
    )
    assert "must call at most 100 subcircuits one within another" in said


@pytest.mark.parametrize(
    ("parameters", "old", "new", "why"),
    [
        ({"R": -1e6}, "", "", r"^load\.parameters\.R must be above 0, for Rload, but is -1000000"),
        ({"R": 0.0}, "", "", r"^load\.parameters\.R must be above 0, for Rload, but is 0\.0"),
        ({"r": -1.0}, "", "", r"^load\.parameters\.R must be above 0, for Rload"),
        (
            {"C": -1e-6},
            "",
            "",
            r"^load\.parameters\.C must be at least 0, for Csmooth, but is -1e-06",
        ),
        (
            {},
            "{R}",
            "-1k",
            r"^netlist bridge\.cir line \d+ must be above 0, for Rload, but is -1000",
        ),
    ],
)
def test_a_load_that_would_give_power_is_refused(tmp_path, parameters, old, new, why):
    file = tmp_path / "bridge.cir"
    file.write_text((netlist_folder() / "bridge.cir").read_text().replace(old or "\0", new))
    with pytest.raises(InputError, match=why):
        load_circuit(Load(netlist=str(file), parameters=parameters))


def test_a_parameter_of_a_netlist_without_any(tmp_path):
    (tmp_path / "r.cir").write_text(
        "* one resistor\n.subckt r p n\nRload p n 1Meg\n.ends r\n.end\n"
    )
    with pytest.raises(
        InputError,
        match=r"unknown parameter of netlist r 'R': it has none but its elements \(Rload\); .*'\.subckt r p n R=1Meg'",
    ):
        load_circuit(Load(netlist=str(tmp_path / "r.cir"), parameters={"R": "2 Mohm"}))


@pytest.mark.parametrize(
    "waveform, most",
    [
        ("sin(0 1 50 0 0 90 7)", "sin at most 6"),
        ("pulse(0 1 0 1u 1u 1m 2m 3 9)", "pulse at most 8"),
        ("exp(0 1 0 1m 5m 1m 9)", "exp at most 6"),
        ("sffm(0 1 50 2 5 0 0 9)", "sffm at most 7"),
    ],
)
def test_numbers_beyond_those_of_a_waveform_are_refused(tmp_path, waveform, most):
    """ngspice ignores them; LTspice stops a sine after so many cycles."""
    text = GOOD.replace("Rload", f"V1 v n {waveform}\nR1 v n 1k\nRload")
    assert most in refusal(tmp_path, text)
    assert given(tmp_path, text.replace(" 9)", ")").replace(" 7)", ")"))


def test_a_text_in_place_of_a_file_is_checked_as_a_file(tmp_path):
    """Also an empty one: the file is not read in its place."""
    path = tmp_path / "mine.cir"
    path.write_text(GOOD)
    load = Load(netlist=str(path))
    for text, word in (
        ("", "subcircuit"),
        (GOOD + "\x07", "printable"),
        (GOOD + MOST_BYTES * "*", "bytes"),
    ):
        with pytest.raises(InputError, match=word):
            load_circuit(load, text=text)
