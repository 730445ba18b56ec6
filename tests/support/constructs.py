# ruff: noqa: E501, as a row of a table is a line
"""What a netlist may hold, construct by construct: the smallest netlist of each, for ngspice and for the package.

A `Row` is a subcircuit ``board`` with Rload between the piezo's electrodes p and n (`text`); the
current that feeds it is that of tests/support/ngspice_oracle.py.  Three bodies recur: a value in
series with the load, an expression in braces that is such a value, and a function that a B source
draws from the piezo.
"""

from typing import NamedTuple

from harvester.circuits.solvability import check_solvable
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.ngspice_oracle import CAPACITANCE


class Row(NamedTuple):
    """A construct: its group, its words, the lines within the subcircuit, and those outside."""

    group: str
    construct: str
    body: str
    outside: str = ""
    terminals: str = "p n"
    means: str = ""  # of a construct of LTspice's: lines of ngspice within the subcircuit, which are the same circuit

    @property
    def name(self):
        """The group and the construct."""
        return f"{self.group}: {self.construct}"

    @property
    def text(self):
        """The netlist."""
        return f"* {self.group}\n.subckt board {self.terminals}\n{self.body}\n.ends board\n{self.outside}\n"


def in_series(word):
    """A resistor of a value in series with the load."""
    return f"R1 p a {word}\nRload a n 100k"


def in_braces(expression):
    """The same of an expression in braces."""
    return in_series("{100k*(" + expression + ")}")


def drawn(function):
    """A B source next to the load that draws a microampere times a function."""
    return f"B1 p n I=1u*({function})\nRload p n 1Meg"


def with_diode(card, more=""):
    """A half-wave rectifier whose diode has a card."""
    return f"D1 p a dm {more}\nR2 p n 1Meg\nRload a n 200k\nC1 a n 20n\n.model dm {card}"


def _rows():
    yield from (Row("numbers", f"`{word}`", in_series(word)) for word in (
        "100k", "0.1Meg", "1e5", "100e3", "1e2k", ".1e6", "1.e5", "100kohm", "4k7", "100K", "0.0001G", "1mil", "1a",
        "1e999", "100k 200k", "1k 3Meg", "1k ohm"))  # fmt: skip
    yield from (Row("operators in braces", f"`{word}`", in_braces(word)) for word in (
        "2^3^2", "2**3", "-1+2", "(-2)^2", "2*-3^2*(-1)", "2*(-1)*(-1)", "3*-1*(-1)", "7%4", "1 ? 2 : 3", "0 ? 1 : 1 ? 2 : 3",
        "(1 > 2) + 1", "1 == 1", "!0", "1 && 0 || 1", "2--1", "2*-(1)"))  # fmt: skip
    yield from (Row("functions in braces", f"`{word}`", in_braces(word)) for word in (
        "pow(-2,3)*(-1)", "pwr(-2,3)", "sqrt(4)", "sqr(2)", "abs(-2)", "exp(1)", "ln(10)", "log(10)", "log10(100)", "sin(1)",
        "cos(1)", "tan(1)", "arctan(1)", "asin(0.5)", "acos(0.5)", "atan(2)", "sinh(1)", "cosh(1)", "tanh(1)", "asinh(1)",
        "acosh(2)", "atanh(0.5)", "min(2,3)", "max(2,3)", "int(2.7)", "nint(2.5)", "floor(2.7)", "ceil(2.2)", "sgn(3)",
        "ternary_fcn(1,2,3)", "min(1,2,3)", "u(1)", "uramp(2)", "limit(2,1)", "agauss(1,0.1,3)", "pi", "e", "temper",
        "bessel(1)"))  # fmt: skip
    yield from (Row("operators in B sources", f"`{word}`", drawn(word)) for word in (
        "v(p,n)^2*sgn(v(p))", "v(p,n)**2*sgn(v(p))", "-v(p,n)^2*sgn(v(n,p))", "2^3^2*v(p,n)/64", "2*-v(p,n)", "v(p) > 1 ? v(p) : 0",
        "v(p) > 1 ? v(p) > 2 ? 2 : 1 : 0", "!v(p)", "v(p) > 1 && v(p) < 3", "v(p) < 1 || v(p) > 3", "v(p)*{1+1}", "v(p)%2",
        "v(p) == 0", "1/v(p)*0", "2^-1*v(p)"))  # fmt: skip
    yield from (Row("functions in B sources", f"`{word}`", drawn(word)) for word in (
        "pow(v(p),3)*sgn(v(p))", "pwr(v(p),3)", "abs(v(p))", "sqrt(abs(v(p)))", "exp(v(p)/5)", "ln(1+abs(v(p)))", "log(1+abs(v(p)))",
        "log10(1+abs(v(p)))", "sin(v(p))", "cos(v(p))", "tan(v(p)/20)", "atan(v(p))", "asin(v(p)/50)", "acos(v(p)/50)",
        "sinh(v(p)/5)", "cosh(v(p)/5)", "tanh(v(p))", "asinh(v(p))", "acosh(1+abs(v(p)))", "atanh(v(p)/50)", "u(v(p))",
        "u2(v(p))", "uramp(v(p))", "sgn(v(p))", "floor(v(p))", "ceil(v(p))", "nint(v(p))", "min(v(p),1)", "max(v(p),1)",
        "ternary_fcn(v(p) > 1, v(p), 0)", "gt0(v(p))", "lt0(v(p))", "ge0(v(p))", "le0(v(p))", "pi*v(p)", "e*v(p)",
        "pwl(v(p), -1, -1, 1, 1)", "pwl(v(p), -1, -1, 0, 0, 2, 1)", "pwl(v(p), 1, 1)", "int(v(p,n))", "limit(v(p),0,1)",
        "ddt(v(p))", "sqr(v(p))", "temper*v(p)/27", "time*v(p)", "i(R9)"))  # fmt: skip
    yield from _scopes()
    yield from _elements()
    yield from _models()
    yield from _lines()


def _scopes():
    outer = ".subckt outer a b k=5\n{own}X2 a b inner\n.ends\n.subckt inner a b\nR1 a b {{k*20k}}\n.ends\n"
    inner = ".subckt inner a b r=50k\n{own}R1 a b {{r}}\n.ends\n"
    call = "X1 p a {0}\nRload a n 100k"
    for words, body, outside in (
        ("a parameter of the caller", call.format("outer k=7"), outer.format(own="")),
        ("the same, and a global one", call.format("outer k=7"), outer.format(own="") + ".param k=3"),
        ("a .param of the caller", call.format("outer"), outer.format(own=".param k=7\n").replace(" k=5", "")),
        ("a default", call.format("inner"), inner.format(own="")),
        ("a call's value", call.format("inner r=70k"), inner.format(own="")),
        ("a call's value, `params:`", call.format("inner params: r=70k"), inner.format(own="")),
        ("a .param over a default", call.format("inner"), inner.format(own=".param r=90k\n")),
        ("a call's value over a .param", call.format("inner r=70k"), inner.format(own=".param r=90k\n")),
        ("a default of a global one", call.format("inner"), inner.format(own="").replace("50k", "{g}") + ".param g=30k"),
        ("a default of a later one", call.format("inner"), inner.format(own="").replace("r=50k", "r={q*2} q=30k")),
        ("a default of its own name outside", call.format("inner"), inner.format(own="").replace("50k", "{r}") + ".param r=30k"),
        ("an unknown name in a call", call.format("inner q=70k"), inner.format(own="")),
        ("a call's value that names another of the call", call.format("inner r={q*2} q=30k"), inner.format(own="").replace("r=50k", "r=50k q=1")),
        (".param set twice", in_series("{w}"), ".param w=50k\n.param w=70k"),
        (".param after its use", in_series("{w}"), ".param w=50k"),
        (".param of a later one", in_series("{w}"), ".param w={v0*2}\n.param v0=30k"),
        (".param of itself", in_series("{w}"), ".param w={w+1}"),
        (".param called temper", in_series("{temper}"), ".param temper=50k"),
        (".param called e", in_series("{e}"), ".param e=50k"),
        (".param called sin", in_series("{sin}"), ".param sin=50k"),
        (".param without braces", in_series("{w}"), ".param w=2*25k"),
        ("a parameter's name alone", in_series("w"), ".param w=50k"),
        ("a name without a value", in_series("{w}"), ""),
        (".func", in_series("{f(25k)}"), ".func f(x) {2*x}"),
        (".func of .func", in_series("{g(25k)}"), ".func f(x) {x+1k}\n.func g(x) {f(x)*2}"),
        (".func in a B source", drawn("f(v(p))"), ".func f(x) {2*x}"),
        (".func in itself", in_series("{f(25k)}"), ".func f(x) {f(x)}"),
        (".func of other arguments", in_series("{f(25k)}"), ".func f(x,y) {x*y}"),
        ("a call of too few nodes", "X1 p inner\nRload p n 100k", inner.format(own="")),
        ("a call of no subcircuit", "X1 p a nowhere\nRload a n 100k", ""),
        ("a subcircuit in itself", "X1 p n s\nRload p n 100k", ".subckt s a b\nR1 a b 1Meg\nX1 a b s\n.ends"),
        ("an inner node called p", "X1 p a s\nRload a n 100k", ".subckt s x y\nR1 x p 50k\nR2 p y 50k\n.ends"),
        ("ground inside", "X1 p n s\nRload p n 100k", ".subckt s x y\nR1 x gnd 100k\n.ends"),
        ("a pin called gnd at ground", "X1 p n s\nRload p n 100k", ".subckt s x gnd\nR1 x gnd 100k\n.ends"),
        ("a pin called gnd elsewhere", "X1 p a s\nR2 a n 1k\nRload p n 100k", ".subckt s x gnd\nR1 x gnd 100k\n.ends"),
    ):  # fmt: skip
        yield Row("scopes", words, body, outside)
    yield Row(
        "scopes",
        "the load's own node called p",
        "R1 x p 1Meg\nRload p y 1Meg\nCs x y 1n",
        "",
        "x y",
    )
    model = ".subckt s a b\nD1 a b dm\n.ends\n"
    outer = "X1 p a s\n.model dm D(Is=1u)\nR2 p n 1Meg\nRload a n 200k"
    yield Row("scopes", "the caller's model", outer, model)
    yield Row(
        "scopes", "the caller's model, and a global one", outer, model + ".model dm D(Is=1n N=2)"
    )
    yield Row(
        "scopes",
        "a global model",
        outer.replace(".model dm D(Is=1u)\n", ""),
        model + ".model dm D(Is=1n)",
    )


def _elements():
    multiplied = ".subckt s a b\n{0}\n.ends"
    diode = "\n.model dm D(Is=1n)"
    for words, body in (
        ("R m=", in_series("100k m=2")), ("R scale=", in_series("100k scale=2")), ("R tc1= dtemp=", in_series("100k tc1=0.01 dtemp=50")),
        ("R tc1=", in_series("100k tc1=0.01")), ("R r=", in_series("r=100k")), ("R ac=", in_series("100k ac=1")),
        ("R of 0", in_series("0")), ("R below 0", in_series("-10k")), ("R without a value", in_series("")), ("R foo=", in_series("100k foo=1")),
        ("R of a function", "R1 p a r={100k+10k*v(p,a)}\nRload a n 100k"), ("R of a function, m=", "R1 p a r={100k+abs(v(p,a))} m=2\nRload a n 100k"),
        ("R of a model", in_series("rm 100k") + "\n.model rm R(tc1=0)"), ("Rload m=", "Rload p n 200k m=2"),
        ("R in the model's square", in_series("rm l=10u w=1u") + "\n.model rm R(rsh=10k)"),
        ("C", "C1 p a 100n\nRload a n 100k"), ("C m=", "C1 p a 50n m=2\nRload a n 100k"), ("C scale=", "C1 p a 50n scale=2\nRload a n 100k"),
        ("C ic=", "C1 p a 1u ic=2\nRload a n 100k"), ("C c=", "C1 p a c=100n\nRload a n 100k"), ("C rser=", "C1 p a 100n rser=1k\nRload a n 100k"),
        ("C of a charge", "C1 p n q={20n*v(p,n)}\nRload p n 100k"), ("C of a function", "C1 p n c={20n+1n*abs(v(p,n))}\nRload p n 100k"),
        ("L", "L1 p a 100\nRload a n 100k"), ("L m=", "L1 p a 200 m=2\nRload a n 100k"), ("two L in parallel", "L1 p a 200\nL2 p a 300\nRload a n 100k"),
        ("K", "L1 p n 300\nL2 a n 200\nK1 L1 L2 0.8\nRload a n 100k"), ("K twice", "L1 p n 300\nL2 a n 200\nK1 L1 L2 0.4\nK2 L1 L2 0.4\nRload a n 100k"),
        ("K of one inductor", "L1 p n 300\nK1 L1 L1 0.4\nRload p n 100k"), ("K of no inductor", "L1 p n 300\nK1 L1 L9 0.4\nRload p n 100k"),
        ("K above 1", "L1 p n 300\nL2 a n 200\nK1 L1 L2 1.2\nRload a n 100k"), ("K of m=", "L1 p n 300 m=2\nL2 a n 200\nK1 L1 L2 0.8\nRload a n 100k"),
        ("K of three", "L1 p n 300\nL2 a n 200\nL3 b n 100\nR3 b n 1k\nK1 L1 L2 L3 0.5\nRload a n 100k"),
        ("V", "V1 p a 2\nRload a n 100k"), ("V dc", "V1 p a dc 2\nRload a n 100k"), ("V m=", "V1 p a 2 m=2\nRload a n 100k"), ("V sin", "V1 p a sin(0 2 50)\nRload a n 100k"),
        ("V of two numbers", "V1 p a 2 3\nRload a n 100k"), ("V external", "V1 p a external\nRload a n 100k"),
        ("I", "I1 p n 10u\nRload p n 100k"), ("I m=", "I1 p n 10u m=2\nRload p n 100k"), ("I dc=", "I1 p n dc=10u\nRload p n 100k"), ("I pulse", "I1 p n pulse(0 10u 1m)\nRload p n 100k"),
        ("E", "E1 a n p n 2\nRload a n 100k"), ("E m=", "E1 a n p n 2 m=2\nRload a n 100k"), ("E value=", "E1 a n value={2*v(p,n)}\nRload a n 100k"),
        ("E vol=", "E1 a n vol='2*v(p,n)'\nRload a n 100k"), ("E poly", "E1 a n poly(2) p n a n 0 1 0 0.01\nRload a n 100k"),
        ("E poly of one number", "E1 a n poly(1) p n 2\nRload a n 100k"), ("E table", "E1 a n table {v(p,n)} (-1,-1) (1,1)\nRload a n 100k"),
        ("E laplace", "E1 a n laplace {v(p,n)} {1/(1+s)}\nRload a n 100k"),
        ("G", "G1 p n p n 1u\nRload p n 1Meg"), ("G m=", "G1 p n p n 1u m=2\nRload p n 1Meg"), ("G cur=", "G1 p n cur={1u*v(p,n)}\nRload p n 1Meg"),
        ("G value= m=", "G1 p n value={1u*v(p,n)} m=2\nRload p n 1Meg"),
        ("F", "V1 p a 0\nRload a n 1Meg\nF1 p n V1 1"), ("F m=", "V1 p a 0\nRload a n 1Meg\nF1 p n V1 1 m=3"), ("F of a resistor", "Rload p n 1Meg\nF1 p n Rload 1"),
        ("H", "V1 p a 0\nR1 a n 1Meg\nH1 b n V1 2Meg\nRload b n 100k"),
        ("B I=", drawn("v(p,n)")), ("B V=", "B1 a n V=2*v(p,n)\nRload a n 100k"), ("B m=", "B1 p n I=1u*v(p,n) m=2\nRload p n 1Meg"),
        ("B tc1=", "B1 p n I=1u*v(p,n) tc1=0.01\nRload p n 1Meg"), ("B of a current", "V1 p a 0\nRload a n 1Meg\nB1 p n I=2*i(V1)"),
        ("B of another form", "B1 p n v(p,n)\nRload p n 1Meg"), ("B of an unknown node", drawn("v(nowhere)")),
        ("S", "S1 p a p n sw1\nR9 p a 10Meg\nRload a n 100k\n.model sw1 SW(Vt=1 Vh=0.2 Ron=1k Roff=100Meg)"),
        ("S, negative hysteresis", "S1 p a p n sw1\nR9 p a 10Meg\nRload a n 100k\n.model sw1 SW(Vt=1 Vh=-0.2 Ron=1k Roff=100Meg)"),
        ("W", "V1 p b 0\nW1 b a V1 sw1\nR9 b a 10Meg\nRload a n 100k\n.model sw1 CSW(It=0.1u Ih=0.02u Ron=1k Roff=100Meg)"),
        ("D", with_diode("D(Is=1n)")), ("D m=", with_diode("D(Is=1n Rs=10k)", "m=2")), ("D area=", with_diode("D(Is=1n Rs=10k)", "area=2")),
        ("D off", with_diode("D(Is=1n)", "off")), ("D temp=", with_diode("D(Is=1n)", "temp=85")), ("D of two models", with_diode("D(Is=1n)", "dm")),
        ("Q", "Q1 a p n qm\nR1 p a 1Meg\nRload p n 100k\n.model qm NPN(Is=1f Bf=50 Vaf=50 Cjc=5p Cje=5p)"),
        ("Q area=", "Q1 a p n qm area=2\nR1 p a 1Meg\nRload p n 100k\n.model qm NPN(Is=1f Bf=50 Br=2)"),
        ("Q, substrate", "Q1 a p n 0 qm\nR1 p a 1Meg\nRload p n 100k\n.model qm NPN(Is=1f Bf=50)"),
        ("J", "J1 p a a jm\nR9 p a 10Meg\nRload a n 100k\n.model jm NJF(Vto=-1 Beta=10u)"),
        ("M", "M1 p p a a mm w=100u l=2u\nR9 p a 10Meg\nRload a n 100k\n.model mm NMOS(Level=1 Vto=0.5 Kp=20u)"),
        ("M of level 3", "M1 p p a a mm w=100u l=2u\nR9 p a 10Meg\nRload a n 100k\n.model mm NMOS(Level=3 Vto=0.5 Kp=20u)"),
        ("M of level 14", "M1 p p a a mm\nR9 p a 10Meg\nRload a n 100k\n.model mm NMOS(Level=14)"),
        ("M, vertical", "M1 p p a mm\nR9 p a 10Meg\nRload a n 100k\n.model mm VDMOS(Vto=0.5 Kp=0.1)"),
        ("T", "T1 p n a n z0=50k td=1m\nRload a n 100k"), ("A", "A1 p a am\nRload a n 100k\n.model am gain(gain=1)"), ("Y", "Y1 p n a n ym\nRload a n 100k"),
        ("two elements of one name", "R1 p n 1Meg\nr1 p n 1Meg\nRload p n 100k"), ("no Rload", "R1 p n 1Meg"),
        ("an element too few words", "R1 p\nRload p n 100k"), ("a node without a path", "R1 x y 1k\nRload p n 100k"),
    ):  # fmt: skip
        yield Row("elements", words, body)
    for element in ("R1 a b 1Meg", "C1 a b 10n", "L1 a b 300", "D1 a b dm" + diode, "G1 a b a b 1u", "I1 a b 1u",
                    "B1 a b I=1u*v(a,b)", "R1 a b r={1Meg+v(a,b)}", "R1 a b 1Meg m=3"):  # fmt: skip
        words = f"`{element.splitlines()[0]}` in a call with m=2"
        yield Row("elements", words, "X1 p n s m=2\nRload p n 500k", multiplied.format(element))


def _models():
    for words, card in (
        ("`D` alone", "D"), ("`D()`", "D()"), ("no =", "D(is 1n n 2)"), ("commas", "D(is=1n, n=2)"), ("units", "D(is=1nA n=2)"), ("no parentheses", "D is=1n n=2"),
        ("braces", "D(is={1n*2})"), ("quotes", "D(is='1n*2')"), ("a key twice", "D(is=1n is=2n)"), ("cjo and cj0", "D(is=1n cjo=10p cj0=20p)"),
        ("an unknown key", "D(is=1n foo=2)"), ("`is-1n`", "D(is-1n n=2)"), ("Is=0", "D(is=0)"), ("Is below 0", "D(is=-1n)"), ("N=0.5", "D(is=1n n=0.5)"),
        ("Bv", "D(is=1n bv=3 ibv=1u)"), ("Bv and area", "D(is=1n bv=3 ibv=1u area=2)"), ("Rs, Cjo, Tt", "D(is=1n rs=10k cjo=100p tt=1u)"), ("M above 0.9", "D(is=1n cjo=1n m=0.95)"),
        ("Fc", "D(is=1n cjo=1n fc=0.2)"), ("Ikf", "D(is=1n ikf=1u)"), ("Isr", "D(is=1n isr=1n)"), ("Level=1", "D(level=1 is=1n)"), ("Eg, Xti, Kf", "D(is=1n eg=0.7 xti=2 kf=1)"),
        ("Tnom", "D(is=1n tnom=50)"), ("ratings", "D(is=1n vpk=30 iave=1)"), ("another type", "DIODE(is=1n)"), ("LTspice's", "D(Ron=1k Roff=1G Vfwd=0.2)"), ("ako", "ako:dx D(is=1n)"),
    ):  # fmt: skip
        yield Row("models", words, with_diode(card))
    yield Row("models", "two of one name", with_diode("D(is=1n)\n.model dm D(is=1u)"))
    yield Row("models", "none", with_diode("D(is=1n)").replace(".model dm", ".model dx"))


def _lines():
    plain = "R1 p a 100k\nRload a n 100k"
    for words, body, outside in (
        ("`*`, `;`, `$`, `//`", "* R9 p n 1\nR1 p a 100k ; R9\n* x\nRload a n 100k $ 1k\n", "* done // all"),
        ("`+`", "R1 p\n+ a\n+ 100k\nRload a n 100k", ""), ("`+` over a comment", "R1 p a\n* x\n\n+ 100k\nRload a n 100k", ""),
        ("capitals", "r1 P A 100K\nRLOAD a N 100k", ""), ("parentheses", "R1 (p a) 100k\nRload (a,n) 100k", ""), ("blanks around =", "R1 p a r = 100k\nRload a n 100k", ""),
        ("a semicolon in a card", in_series("100k") + "\nD1 a n dm", ".model dm D(is=1n;n=2)"), ("`#`", "# x\n" + plain, ""),
        ("a line behind .end", plain, ".end\n.param w=1"), (".options reltol", plain, ".options reltol=1e-5"), (".options temp", plain + "\nD1 a n dm", ".model dm D(is=1n)\n.options temp=85"),
        (".temp", plain + "\nD1 a n dm", ".model dm D(is=1n)\n.temp 85"), (".options rshunt", plain, ".options rshunt=1Meg"), (".options gmin", plain, ".options gmin=1u"),
        (".if", plain, ".if (1)\n.endif"), (".control", plain, ".control\nlisting\n.endc"), (".global", plain, ".global vcc"), (".csparam", plain, ".csparam w=1"),
        (".include of another folder", plain, ".include /etc/hostname"), (".lib", plain, ".lib /etc/hostname tt"), ("a subcircuit within another", plain + "\n.subckt s a b\nR1 a b 1k\n.ends", ""),
    ):  # fmt: skip
        yield Row("lines", words, body, outside)


_LTSPICE = {  # constructs of LTspice's, which ngspice refuses or leaves out, and the same in ngspice
    "functions in B sources: `limit(v(p),0,1)`": drawn("min(max(v(p),0),1)"),
    "elements: C rser=": "C1 p b 100n\nR9 b a 1k\nRload a n 100k",
    "models: LTspice's": "B1 p a I=1n*v(p,a)+(1m-1n)*uramp(v(p,a)-0.2)\nR2 p n 1Meg\nRload a n 200k\nC1 a n 20n",
}


def _ltspice():
    for words, body, means in (
        ("`limit(600k,1k,50k)` in braces", in_series("{limit(600k,1k,50k)}"), in_series("50k")),
        ("C rser= lser=", "C1 p a 100n rser=9k lser=20\nRload a n 100k", "C1 p b 100n\nR9 b c 9k\nL9 c a 20\nRload a n 100k"),
        ("C v= irms= mfg= pn= type=", "C1 p a 100n v=25 irms=0 mfg=\"x\" pn=\"y\" type=\"z\"\nRload a n 100k", "C1 p a 100n\nRload a n 100k"),
        ("C rpar=0", "C1 p a 100n rpar=0\nRload a n 100k", "C1 p a 100n\nRload a n 100k"),
        ("L rser=", "L1 p a 200 rser=9k\nRload a n 100k", "L1 p b 200\nR9 b a 9k\nRload a n 100k"),
        ("V rser=", "V1 p a 2 rser=9k\nRload a n 100k", "V1 p b 2\nR9 b a 9k\nRload a n 100k"),
        ("R tol= pwr=", in_series("50k tol=1 pwr=0.1"), in_series("50k")),
        ("a diode of Vrev and Rrev", "D1 p n dm\nRload p n 200k\n.model dm D(Ron=1k Roff=1G Vfwd=9 Vrev=3 Rrev=5k)",
         "B1 p n I=1n*v(p,n)+(1m-1n)*uramp(v(p,n)-9)-(0.2m-1n)*uramp(-v(p,n)-3)\nRload p n 200k"),
        ("a diode of Ron, m=", with_diode("D(Ron=20k)", "m=2"), "B1 p a I=uramp(v(p,a))/10k\nR2 p n 1Meg\nRload a n 200k\nC1 a n 20n"),
        ("a resistor's T_ABS", in_series("rm 50k") + "\n.model rm RES(T_ABS=-273.15)", in_series("50k")),
    ):  # fmt: skip
        yield Row("constructs of LTspice", words, body, means=means)


ROWS = tuple(
    row._replace(means=_LTSPICE.get(row.name, row.means)) for row in (*_rows(), *_ltspice())
)


def given_to_ngspice(file):
    """What engine `spice` gives to ngspice of a netlist's file: lines with the piezo between p and 0."""
    load = load_circuit(Load(netlist=str(file)), CAPACITANCE)
    check_solvable(load)
    return "\n".join(
        [load.text, *(f".options {name}={value!r}" for name, value in load.settings.items())]
    )
