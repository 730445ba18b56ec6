"""Random netlists of the grammar that ngspice reads, by a seed: mostly answerable, a tenth of them odd.

`netlist(seed)` is the text of a file with a subcircuit ``board`` of two terminals and a resistor
Rload.  Its elements are drawn from a spine, which leaves a path for direct current from terminal to
terminal, and from what hangs next to it:

    elements       R C L K D Q J M S W B E F G H V I X, in every form that a netlist writes them
    values         numbers with suffixes and units, parameters, expressions in braces, quotes and bare
    scopes         .param of the file and of subcircuits, headers, calls, .func, names that hide others
    models         keys with aliases, rare and misspelt ones, with and without = and parentheses, models within scopes
    lines          case, continuations, comments, blanks, tabs, commas
"""

import random
from dataclasses import dataclass, field

ODD = 0.12  # share of netlists with an odd construct
SUFFIXES = {"t": 12, "g": 9, "meg": 6, "k": 3, "": 0, "m": -3, "u": -6, "n": -9, "p": -12}
UNITS = {
    "r": ("ohm", "", "", "o"),
    "c": ("F", "", "", ""),
    "l": ("H", "", ""),
    "v": ("V", "", ""),
    "": ("",),
}
NODES = ("a", "b", "c", "x1", "mid", "OUT", "n2", "7", "net_3", "p", "n")
NAMES = ("g", "k", "gain", "r0", "q", "width", "K2", "vt0", "temp", "c", "m2", "Rx")
BRACE_ONE = ("abs", "sqrt", "exp", "ln", "log", "log10", "sqr", "int", "nint", "floor", "ceil", "sgn", "sin", "cos",
             "tanh", "atan", "arctan", "cosh")  # fmt: skip
SOURCE_ONE = (
    "abs",
    "sin",
    "cos",
    "tanh",
    "atan",
    "u",
    "uramp",
    "u2",
    "sgn",
    "floor",
    "ceil",
    "nint",
    "sinh",
    "asinh",
)
SMOOTH_ONE = ("abs", "sin", "cos", "tanh", "atan", "uramp", "u2", "asinh")


@dataclass
class Scope:
    """Where lines are written: names of parameters with their values, models by kind, functions, and lines so far."""

    parameters: dict[str, float] = field(default_factory=dict)
    models: dict[str, list[str]] = field(default_factory=dict)
    functions: dict[str, int] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)


def netlist(seed):
    """The text of a random netlist."""
    return _Writer(random.Random(seed)).file()


def flat_netlist(seed):
    """The text of a random flat netlist, the nets of the piezo's terminals, and the name of its load."""
    return _Writer(random.Random(seed)).flat_file()


def is_rough(text):
    """Whether a netlist jumps, so that two integrations agree less well: switches, steps and comparisons."""
    low = text.lower()
    words = (
        "floor(",
        "ceil(",
        "nint(",
        "sgn(",
        "u(",
        ">",
        "<",
        "==",
        "!=",
        "&&",
        "||",
        "%",
        ".model sw",
        " sw",
        "csw",
    )
    sources = [line for line in low.splitlines() if "v(" in line or "i(" in line]
    return any(word in line for line in sources for word in words) or " sw" in low or "csw" in low


class _Writer:
    """Writes one file."""

    def __init__(self, rng):
        self.rng = rng
        self.count = 0
        self.outer = Scope()
        self.used = set()
        self.foreign = {}
        self.odd = rng.random() < ODD

    # Small choices

    def maybe(self, chance):
        return self.rng.random() < chance

    def one(self, *of):
        return self.rng.choice(of)

    def name(self, letter):
        """A name of an element that no other of the file has."""
        self.count += 1
        return self.cased(f"{letter}{self.one('', '', 'x', '_a')}{self.count}")

    def cased(self, word):
        """A word in some case."""
        return self.one(word, word, word, word.upper(), word.lower(), word.capitalize())

    # Numbers and expressions

    def number(self, value, unit=""):
        """A value as a literal: plain, by an exponent, or by a suffix and a unit."""
        form = self.rng.random()
        text = f"{value:.4g}"
        if form < 0.25:
            return text
        if form < 0.3:
            return f"{value:.3e}"
        suffix = self.one(*SUFFIXES)
        scaled = value / 10.0 ** SUFFIXES[suffix]
        if not 1e-3 <= abs(scaled) < 1e5:
            return text
        if self.odd and self.maybe(0.08):
            return f"{value / 25.4e-6:.5g}mil"
        return (
            f"{scaled:.5g}{self.cased(suffix) if suffix else ''}{self.one(*UNITS.get(unit, ('',)))}"
        )

    def literal(self, value):
        """A value as a literal of an expression, where a suffix is allowed as well."""
        return self.number(value) if self.maybe(0.7) else f"{value:.4g}"

    def braces(self, value, scope, depth=0):  # noqa: PLR0912 -- a form a branch
        """An expression of parameters and numbers with about this value."""
        form = self.rng.random()
        names = [name for name, known in scope.parameters.items() if known]
        if depth > 2 or form < 0.2:
            return self.literal(value)
        if form < 0.5 and names:
            name = self.one(*names)
            return f"{self.cased(name)}{self.one('*', ' * ')}{self.literal(value / scope.parameters[name])}"
        if form < 0.6:
            a = self.rng.uniform(0.2, 2.0)
            first = self.braces(value * a, scope, depth + 1)
            second = self.braces(value * (1 - a), scope, depth + 1)
            return f"({first}){self.one('+', ' + ')}({second})"
        if form < 0.66:
            return f"{self.literal(value * 8)}/2^{self.one('3', '2', '2^1', '(3)', '1^2')}"
        if form < 0.7:
            return f"{self.one('max', 'min')}({self.literal(value)},{self.literal(value * self.rng.uniform(0.5, 2))})"
        if form < 0.75:
            function = self.one(*BRACE_ONE)
            return f"{self.literal(value)}*(1+{function}({self.rng.uniform(0.3, 3.0):.3g}))"
        if form < 0.8:
            base, power = self.one("-2", "2", "1.5", "-1.5"), self.one("2", "2", "3", "-2")
            return f"{self.literal(value)}*{self.one('pow', 'pwr')}({base},{power})/{self.one('4', '3')}"
        if form < 0.84:
            test = f"{self.rng.randint(0, 3)}{self.one('>', '<', '>=', '==', '!=', '<>')}{self.rng.randint(0, 3)}"
            return f"({test}?{self.literal(value)}:{self.literal(value * 2)})"
        if form < 0.87:
            return f"{self.literal(value)}*(1+{self.rng.randint(0, 1)}{self.one('&&', '||')}{self.rng.randint(0, 1)})"
        if form < 0.9:
            return f"{self.literal(value)}*(2{self.one('-', '+', '*', '--', '*-', '^-')}{self.one('1', '3')})"
        if form < 0.93 and scope.functions:
            name = self.one(*scope.functions)
            given = ",".join(
                f"{self.rng.uniform(0.5, 2.0):.3g}" for _ in range(scope.functions[name])
            )
            return f"{self.literal(value)}*{self.cased(name)}({given})"
        if form < 0.95:
            return f"-{self.literal(-value)}"
        if form < 0.97:
            return f"{self.literal(value)}*(7{self.one('%', '%')}{self.one('3', '4', '2.5')})"
        if self.odd:
            return self.one(
                "e",
                "pi",
                "temper",
                "u(1)",
                "if(1,2,3)",
                "1e3k",
                "2^-q",
                "x*-k",
                "!0",
                "~1",
                "3 k",
                "{k}",
            )
        return self.literal(value)

    def value(self, value, scope, unit=""):
        """A value on an element's line: a literal, a parameter, or an expression in braces or quotes."""
        form = self.rng.random()
        if form < 0.55:
            return self.number(value, unit)
        expression = self.braces(value, scope)
        if form < 0.6:
            exact = [
                name
                for name, known in scope.parameters.items()
                if known and 0.1 < known / value < 10.0
            ]
            return self.cased(self.one(*exact)) if exact else self.number(value, unit)
        blank = self.one("", "", " ")
        return f"'{expression}'" if form < 0.7 else f"{{{blank}{expression}{blank}}}"

    # Expressions of B sources, of the size 1 for voltages of some volts

    def source(self, nodes, controls, scope, depth=0):  # noqa: PLR0912 -- a form a branch
        """An expression of voltages and currents."""
        form = self.rng.random()
        if depth > 2 or form < 0.3:
            return self.probe(nodes, controls)
        if form < 0.42:
            sign = self.one("+", "-", "*", " + ", " - ")
            return f"{self.source(nodes, controls, scope, depth + 1)}{sign}{self.atom(scope)}"
        if form < 0.5:
            inner = self.source(nodes, controls, scope, depth + 1)
            return f"{self.one('-', '', '+')}({inner}){self.one('*', '/')}{self.atom(scope)}"
        if form < 0.6:
            functions = SOURCE_ONE if self.maybe(0.4) else SMOOTH_ONE
            return f"{self.cased(self.one(*functions))}({self.source(nodes, controls, scope, depth + 1)})"
        if form < 0.66:
            inner = self.source(nodes, controls, scope, depth + 1)
            return f"{self.one('min', 'max')}({inner},{self.atom(scope)})"
        if form < 0.72:
            inner = self.source(nodes, controls, scope, depth + 1)
            power = self.one("2", "2", "3", "1.5")
            return self.one(
                f"({inner})^{power}",
                f"({inner})**{power}",
                f"pow({inner},{power})",
                f"pwr({inner},{power})",
            )
        if form < 0.77:
            points = []
            x = -self.rng.uniform(0.5, 4.0)
            y = self.rng.uniform(-2.0, 0.0)
            for _ in range(self.rng.randint(2, 4)):
                points += [self.literal(x), self.literal(y)]
                x, y = x + self.rng.uniform(0.5, 4.0), y + self.rng.uniform(0.0, 2.0)
            return f"pwl({self.probe(nodes, controls)}{self.one(',', ', ')}{self.one(',', ', ').join(points)})"
        if form < 0.8:
            inner = self.probe(nodes, controls)
            sign = self.one(">", "<", ">=", "<=")
            other = self.source(nodes, controls, scope, depth + 1)
            return f"({inner}{sign}{self.rng.uniform(-3, 3):.2g} ? {self.atom(scope)} : {other})"
        if form < 0.86:
            return f"{self.probe(nodes, controls)}*{{{self.braces(1.0, scope, 1)}}}"
        if form < 0.9:
            return f"{self.probe(nodes, controls)}*'{self.braces(1.0, scope, 1)}'"
        if form < 0.93 and scope.functions:
            name = self.one(*scope.functions)
            given = ",".join(self.atom(scope) for _ in range(scope.functions[name]))
            return f"{self.probe(nodes, controls)}*{name}({given})"
        if form < 0.95:
            return f"exp({self.probe(nodes, controls)}/{self.one('5', '8', '10')})-1"
        if form < 0.97:
            return f"{self.probe(nodes, controls)}*{self.one('pi', 'e', 'temper/27', '2^3^2/64', '2*-1', '-1')}"
        if self.odd:
            inner = self.probe(nodes, controls)
            forms = (
                "int({})",
                "{}%2",
                "{}*1mil*1k",
                "limit({},0,1)",
                "ln({})",
                "sqrt({})",
                "{}*-1.5",
                "!{}",
                "{}&1",
            )
            return self.one(*forms, "ddt({})", "{}*echarge", "{}*time", "v (mid)*{}").format(inner)
        return self.probe(nodes, controls)

    def atom(self, scope):
        """A number of order one, or a parameter over its value."""
        names = [name for name, known in scope.parameters.items() if known]
        if names and self.maybe(0.35):
            name = self.one(*names)
            text = self.one(name, f"{{{name}}}", name.upper())
            return (
                f"({text}/{scope.parameters[name]:.4g})"
                if self.maybe(0.7)
                else f"{{{name}/{scope.parameters[name]:.4g}}}"
            )
        return self.literal(self.rng.choice((1.0, -1.0, 1.0)) * self.rng.uniform(0.2, 3.0))

    def probe(self, nodes, controls):
        """A voltage or a current, which is multiplied to be of the size of volts."""
        if controls and self.maybe(0.2):
            return f"{self.one('i', 'I')}({self.cased(self.one(*controls))})*{self.one('10k', '1e4', '5k')}"
        first, second = self.one(*nodes), self.one(*nodes)
        v = self.one("v", "v", "V")
        if self.maybe(0.5):
            return f"{v}({first})"
        return (
            f"{v}({first}{self.one(',', ', ')}{second})"
            if first.lower() != second.lower()
            else f"{v}({first})"
        )

    # Models

    def model(self, kind, scope):
        """The name of a model of a kind, a new one or one that the scope or the file has."""
        if self.odd and self.foreign.get(kind) and self.maybe(0.3):
            return self.one(*self.foreign[kind])  # of another subcircuit
        known = scope.models.get(kind, []) + (
            self.outer.models.get(kind, []) if self.maybe(0.5) else []
        )
        if known and self.maybe(0.5):
            return self.cased(self.one(*known))
        home = scope if scope is self.outer or self.maybe(0.6) else self.outer
        number = "1n" if self.odd else "1n4x"  # ngspice drops a model whose name reads as a number
        name = self.one(f"{kind}m", f"m{kind}", "dm", number, "mod") + (
            str(len(self.used)) if self.maybe(0.8) else ""
        )
        others = [model.lower() for models in home.models.values() for model in models]
        if name.lower() in others:
            name += f"z{len(self.used)}"
        self.used.add(name)
        home.models.setdefault(kind, []).append(name)
        if home is not self.outer:
            self.foreign.setdefault(kind, []).append(name)
        home.lines.append(self.card(name, kind, home))
        return name

    def card(self, name, kind, scope):
        """The line of a model."""
        u, log = self.rng.uniform, lambda low, high: low * (high / low) ** self.rng.random()
        common = {
            "d": {"is": log(1e-12, 1e-7), "n": u(1.0, 2.0), "rs": log(0.1, 1e3), "cjo": log(1e-12, 1e-9),
                  "vj": u(0.4, 0.9), "m": self.one(0.33, 0.5, 0.9, 1.0), "tt": log(1e-9, 1e-6), "fc": 0.5,
                  "bv": u(4.0, 40.0),
                  "ibv": log(1e-7, 1e-4), "level": 1},
            "npn": {"is": log(1e-16, 1e-12), "bf": u(20, 200), "br": u(1, 5), "nf": u(1, 1.2), "vaf": u(20, 100),
                    "ikf": log(1e-3, 1), "rb": log(1, 1e3), "re": u(0.1, 2), "rc": u(0.1, 10), "cje": 5e-12,
                    "cjc": 4e-12, "tf": 1e-9, "ise": log(1e-15, 1e-12), "ne": u(1.4, 2), "vje": 0.7, "mje": 0.35},
            "njf": {"vto": -u(0.5, 3), "beta": log(1e-6, 1e-3), "lambda": u(0, 0.05), "rd": log(1, 1e3),
                    "rs": log(1, 1e3), "is": 1e-14, "cgs": 2e-12, "cgd": 1e-12, "pb": 0.9},
            "nmos": {"level": 1, "vto": u(0.3, 2), "kp": log(1e-6, 1e-4), "lambda": u(0, 0.05), "gamma": u(0, 0.5),
                     "phi": 0.6, "rd": log(1, 1e3), "is": 1e-14, "cgso": 1e-10, "cgdo": 1e-10},
            "sw": {"vt": u(-2, 2), "vh": self.one(0.0, 0.2, 0.5, 0.3), "ron": log(1, 1e3), "roff": log(1e6, 1e9)},
            "csw": {"it": u(-1e-5, 1e-5), "ih": self.one(0.0, 1e-6), "ron": log(1, 1e3), "roff": log(1e6, 1e9)},
            "r": {"r": log(1e4, 1e6)},
            "c": {"cap": log(1e-9, 1e-7)},
        }  # fmt: skip
        keys = common[{"pnp": "npn", "pjf": "njf", "pmos": "nmos"}.get(kind, kind)]
        if kind == "pmos":
            keys["vto"] = -keys["vto"]
        must = {
            "d": {"is"},
            "sw": {"vt", "ron", "roff"},
            "csw": {"it", "ron", "roff"},
            "r": {"r"},
            "c": {"cap"},
        }
        chosen = [key for key in keys if key in must.get(kind, ()) or self.maybe(0.45)]
        if "ibv" in chosen and "bv" not in chosen:
            chosen.remove("ibv")
        self.rng.shuffle(chosen)
        equals = self.one("=", "=", "=", " = ", " ")
        blank = self.one(" ", " ", " ", ", ")
        aliases = {"cjo": ("cjo", "cj0", "cj"), "is": ("is", "js") if kind == "d" else ("is",), "vj": ("vj", "pb"),
                   "m": ("m", "mj"), "vaf": ("vaf", "va"), "vto": ("vto", "vt0")}  # fmt: skip
        pairs = []
        for key in chosen:
            text = self.number(keys[key]) if key != "level" else "1"
            if key != "level" and self.maybe(0.12):
                text = f"{{{self.braces(keys[key], scope)}}}"
            pairs.append(f"{self.cased(self.one(*aliases.get(key, (key,))))}{equals}{text}")
        if self.maybe(0.1):
            rare = (
                "tnom=27",
                "kf=1e-16",
                "af=1",
                "eg=1.11",
                "xti=3",
                "vpk=100",
                "iave=1",
                "mfg=2",
                "tmx=3",
                "isz=1n",
            )
            pairs.append(self.one(*rare))
        if self.odd and self.maybe(0.3):
            odd = (
                "is=0",
                "is=-1u",
                "tnom=50",
                "area=2",
                "temp=50",
                "level=2",
                "isr=1n",
                "ikf=1m",
                "cj0=3p",
                "bv=1k",
                "n=3",
            )
            pairs.append(self.one(*odd))
        inner = blank.join(pairs)
        word = self.cased(kind)
        form = self.rng.random()
        body = (
            f"{word}({inner})"
            if form < 0.6
            else f"{word} ({inner})"
            if form < 0.8
            else f"{word} {inner}"
        )
        if self.odd and self.maybe(0.05):
            body = f"{word}({inner}"
        return f"{self.cased('.model')} {self.one(name, name.upper())} {body}"

    # Elements

    def load_value(self):
        return 10 ** self.rng.uniform(4.3, 6.3)

    def options(self, letter, scope):
        """What may are behind an element: multiplicity, temperatures and the like."""
        text = ""
        if self.maybe(0.12):
            text += f" {self.one('m', 'M')}{self.one('=', ' = ')}{self.one('2', '3', '4', '{1+1}', '0.5')}"
        if letter in "rcl" and self.maybe(0.05):
            text += f" scale={self.one('2', '.5')}"
        if letter in "rc" and self.maybe(0.05):
            text += f" tc1={self.one('1m', '.01')}" + self.one("", " tc2=1u")
        if letter in "rcldq" and self.odd and self.maybe(0.15):
            text += self.one(" temp=50", " dtemp=10", " dtemp=10 tc1=.01", " temp=27")
        if letter == "c" and self.maybe(0.1):
            text += f" ic={self.one('0', '1', '.5')}"
        if letter == "r" and self.odd and self.maybe(0.2):
            text += self.one(" noisy=0", " ac=5", " foo=3", " 3Meg", " m=2 m=3")
        return text

    def resistor(self, name, a, b, value, scope):
        form = self.rng.random()
        if form < 0.75:
            text = self.value(value, scope, "r")
        elif form < 0.88:
            text = f"{self.one('r', 'R', 'resistance')}{self.one('=', ' = ')}{self.value(value, scope, 'r')}"
        elif form < 0.93:
            model = self.model("r", scope)
            text = self.one(
                model, f"{self.number(value)} {model}", f"{model} r={self.number(value)}"
            )
        else:
            text = self.value(value, scope, "r")
        return f"{name} {a} {b} {text}{self.options('r', scope)}"

    def spine(self, a, b, nodes, controls, scope):
        """Elements in series from a to b that leave a path for direct current."""
        before = a
        lines = []
        for _ in range(self.rng.choice((0, 1, 1, 2))):
            after = self.fresh(nodes)
            lines.append(self.series(before, after, nodes, controls, scope))
            before = after
        return lines, before

    def fresh(self, nodes):
        """A node that is new where there is one."""
        free = [node for node in NODES if node.lower() not in {known.lower() for known in nodes}]
        node = self.one(*free)
        nodes.append(node)
        return node

    def series(self, a, b, nodes, controls, scope):
        """One element from a to b that carries direct current."""
        form = self.rng.random()
        if form < 0.35:
            return self.resistor(self.name("R"), a, b, 10 ** self.rng.uniform(2.5, 5.5), scope)
        if form < 0.55:
            return self.diode(a, b, scope)
        if form < 0.65:
            value = self.value(10 ** self.rng.uniform(-1, 1.7), scope, "l")
            return f"{self.name('L')} {a} {b} {value}{self.options('l', scope)}"
        if form < 0.8:
            name = self.name("V")
            controls.append(name)
            return f"{name} {a} {b} {self.one('0', 'dc 0', 'DC 0', self.value(self.rng.uniform(-1, 1), scope, 'v'))}"
        if form < 0.9:
            return self.switch(a, b, nodes, controls, scope)
        return self.resistor(self.name("R"), a, b, 10 ** self.rng.uniform(3, 5), scope)

    def diode(self, a, b, scope):
        name = self.name("D")
        model = self.model("d", scope)
        # which ngspice takes for the model's name, unless another element has it
        last = " 2" if self.odd else ""
        area = (
            self.one("", "", " area=2", " area={2}", last, " off", " pj=1")
            if self.maybe(0.4)
            else ""
        )
        return f"{name} {a} {b} {model}{area}{self.options('d', scope)}"

    def switch(self, a, b, nodes, controls, scope):
        state = self.one("", "", " on", " off", " ON")
        if controls and self.maybe(0.4):
            return f"{self.name('W')} {a} {b} {self.cased(self.one(*controls))} {self.model('csw', scope)}{state}"
        first, second = self.one(*nodes), self.one(*nodes)
        return f"{self.name('S')} {a} {b} {first} {second} {self.model('sw', scope)}{state}"

    def beside(self, nodes, controls, coils, scope):  # noqa: PLR0912 -- a form a branch
        """An element next to the spine, between known nodes."""
        a, b = self.rng.sample(nodes, 2) if len(nodes) > 1 else (nodes[0], nodes[0])
        form = self.rng.random()
        if form < 0.15:
            return self.resistor(self.name("R"), a, b, 10 ** self.rng.uniform(4, 6.5), scope)
        if form < 0.3:
            value = self.value(10 ** self.rng.uniform(-9.5, -6.5), scope, "c")
            if self.maybe(0.08):
                value = self.model("c", scope)
            prefix = self.one("", "", "", "c=", "C = ")
            return f"{self.name('C')} {a} {b} {prefix}{value}{self.options('c', scope)}"
        if form < 0.4:
            return self.diode(a, b, scope)
        if form < 0.47:
            kind = self.one("npn", "npn", "pnp")
            name = self.name("Q")
            other = self.one(*nodes)
            area = self.one("", "", " 2", " area=2", " off") if self.maybe(0.5) else ""
            return (
                f"{name} {a} {other} {b} {self.model(kind, scope)}{area}{self.options('q', scope)}"
            )
        if form < 0.52:
            area = self.one("", "", " 2", " area=3") if self.maybe(0.5) else ""
            model = self.model(self.one("njf", "pjf"), scope)
            return f"{self.name('J')} {a} {self.one(*nodes)} {b} {model}{area}{self.options('j', scope)}"
        if form < 0.58:
            size = self.one("", " l=1u w=2u", " W=10u L=10u", " w=5u")
            model = self.model(self.one("nmos", "nmos", "pmos"), scope)
            return f"{self.name('M')} {a} {self.one(*nodes)} {b} {b} {model}{size}{self.options('m', scope)}"
        if form < 0.62:
            return self.switch(a, b, nodes, controls, scope)
        if form < 0.76:
            size = self.one("1u", "1e-6", "2u", ".5u")
            text = f"({self.source(nodes, controls, scope)})*{size}"
            kind = self.one("i", "I")
            if self.maybe(0.15):
                text = self.one(f"{{{text}}}", f"'{text}'")
            last = self.one("", "", "", " m=2", " tc1=1m", " m={2}")
            return f"{self.name('B')} {a} {b} {kind}{self.one('=', ' = ')}{text}{last}"
        if form < 0.84:
            first, second = self.one(*nodes), self.one(*nodes)
            gain = self.value(self.rng.choice((1, 1, -1)) * 10 ** self.rng.uniform(-7, -5.3), scope)
            words = self.one("", "", "", "VCCS ")
            pair = self.one(f"{first} {second}", f"({first},{second})", f"{first} {second}")
            if self.maybe(0.25):
                expression = f"({self.source(nodes, controls, scope)})*1u"
                key = self.one("value", "VALUE", "cur")
                text = self.one(f"{{{expression}}}", f"'{expression}'")
                return f"{self.name('G')} {a} {b} {key}{self.one('=', ' = ')}{text}{self.one('', '', ' m=2')}"
            return (
                f"{self.name('G')} {a} {b} {words}{pair} {gain}{self.one('', '', ' m=2', ' m=3')}"
            )
        if form < 0.89 and controls:
            gain = self.value(self.rng.choice((1, -1)) * self.rng.uniform(0.05, 0.4), scope)
            return f"{self.name('F')} {a} {b} {self.cased(self.one(*controls))} {gain}{self.one('', '', ' m=2')}"
        if form < 0.93:
            current = self.value(self.rng.choice((1, -1)) * 10 ** self.rng.uniform(-7, -5.5), scope)
            return f"{self.name('I')} {a} {b} {self.one('', '', 'dc ', 'DC ')}{current}{self.one('', '', '', ' m=2')}"
        if form < 0.95 and len(nodes) < len(NODES):
            return self.transformer(a, b, nodes, scope)
        if form < 0.97 and len(coils) > 1:
            one, other = self.rng.sample(coils, 2)
            return f"{self.name('K')} {self.cased(one)} {self.cased(other)} {self.one('.5', '{.3}', '0.9', '0.8')}"
        # a voltage source behind a resistor, to a node of its own
        node = self.fresh(nodes) if len(nodes) < len(NODES) else b
        if node == b:
            return self.resistor(self.name("R"), a, b, 1e5, scope)
        joined = self.resistor(self.name("R"), node, b, 10 ** self.rng.uniform(4, 6), scope)
        first, second = self.one(*nodes), self.one(*nodes)
        if controls and self.maybe(0.3):
            gain = self.value(10 ** self.rng.uniform(3, 4.3), scope)
            source = f"{self.name('H')} {node} {a} {self.cased(self.one(*controls))} {gain}"
        elif self.maybe(0.4):
            expression = self.source(nodes, controls, scope)
            source = self.one(
                f"{self.name('B')} {node} {a} v={expression}",
                f"{self.name('E')} {node} {a} value={{{expression}}}",
                f"{self.name('E')} {node} {a} vol='{expression}'",
            )
        else:
            gain = self.value(self.rng.uniform(-1.5, 1.5), scope)
            source = (
                f"{self.name('E')} {node} {a} {self.one('', '', 'vcvs ')}{first} {second} {gain}"
            )
        return f"{source}\n{joined}"

    def transformer(self, a, b, nodes, scope):
        """Two coupled coils, the first behind a resistor, the second on one of its own."""
        first = self.name("L")
        second = self.name("L")
        node = self.fresh(nodes)
        free = [one for one in NODES if one.lower() not in {known.lower() for known in nodes}]
        between = free[0] if free else a
        lines = [
            self.resistor(self.name("R"), a, between, 10 ** self.rng.uniform(2.5, 4), scope),
            f"{first} {between} {b} {self.value(10 ** self.rng.uniform(0, 1.7), scope, 'l')}",
            f"{second} {node} {b} {self.value(10 ** self.rng.uniform(0, 1.7), scope, 'l')}",
            self.resistor(self.name("R"), node, b, 10 ** self.rng.uniform(3.5, 5.5), scope),
            f"{self.name('K')} {self.cased(first)} {self.cased(second)} {self.one('.5', '0.9', '{.3}', '-.4')}",
        ]
        if free:
            nodes.append(between)
        if self.odd and self.maybe(0.4):
            other = self.one(first, second)
            lines.append(
                f"{self.name('K')} {other} {self.one(first, second)} {self.one('.2', '.1')}"
            )
        return "\n".join(lines)

    # Subcircuits and the file

    def parameters(self, scope, count, values=True):
        """Add .param lines to a scope: literals, expressions of others, some set twice or after use."""
        for _ in range(count):
            name = self.one("temper", "e") if self.odd and self.maybe(0.2) else self.one(*NAMES)
            value = self.rng.choice((1e5, 2.2e5, 1e-8, 3.0, 0.5, 2.0, 4.7e4))
            # no parameter is an expression of itself
            known = scope.parameters.pop(name.lower(), None)
            text = (
                self.literal(value)
                if self.maybe(0.6)
                else self.one(
                    f"{{{self.braces(value, scope, 1)}}}", f"'{self.braces(value, scope, 1)}'"
                )
            )
            scope.lines.append(
                f"{self.cased('.param')} {self.cased(name)}{self.one('=', ' = ')}{text}"
            )
            # or of one that is an expression of it
            scope.parameters[name.lower()] = value if known is None else 0.0

    def functions(self, scope):
        """Add a .func line."""
        name = self.one("f", "twice", "fx", "half")
        many = self.rng.randint(1, 2)
        body = (
            self.one("x*2", "x+1", "2*x-1", "x/(x+1)", "x^2")
            if many == 1
            else self.one("x*y", "x+2*y", "max(x,y)", "x-y")
        )
        body = self.one(f"{{{body}}}", f"'{body}'", body)
        scope.lines.append(
            f"{self.cased('.func')} {name}({self.one('x', 'X') if many == 1 else self.one('x,y', 'x, y')}) {body}"
        )
        scope.functions[name] = many

    def body(self, a, b, scope, size, top, calls):
        """The elements between two terminals, with Rload where it is the ``top``."""
        nodes = [a, b]
        controls = []
        coils = []
        lines, end = self.spine(a, b, nodes, controls, scope)
        if top:
            options = self.one("", "", "", "", " m=2", " tc1=1m") if self.maybe(0.3) else ""
            load = self.value(self.load_value(), scope, "r")
            lines.append(
                f"{self.one('Rload', 'RLOAD', 'rload')} {end} {self.one(b, b, self.one(*nodes[1:]))} {load}{options}"
            )
            if end != b and lines[-1].split()[1].lower() == lines[-1].split()[2].lower():
                lines[-1] = f"Rload {end} {b} {load}{options}"
        else:
            lines.append(self.series(end, b, nodes, controls, scope))
            lines.append(self.resistor(self.name("R"), a, b, 10 ** self.rng.uniform(5, 6.5), scope))
        if top and self.maybe(0.5):
            lines.append(
                f"Csmooth {end} {b} {self.value(10 ** self.rng.uniform(-8.5, -6.3), scope, 'c')}"
            )
        for _ in range(size):
            coils = [line.split()[0] for line in lines if line[:1].lower() == "l"]
            lines.append(self.beside(nodes, controls, coils, scope))
        for inner in calls:
            first, second = self.rng.sample(nodes, 2)
            lines.append(self.call(inner, first, second, scope))
        self.rng.shuffle(lines)
        return lines

    def call(self, inner, a, b, scope):
        """An X line."""
        name, header = inner
        given = [
            f"{self.cased(key)}{self.one('=', ' = ')}{self.value(value, scope)}"
            for key, value in header.items()
            if self.maybe(0.5)
        ]
        if self.maybe(0.12):
            given.append(f"m={self.one('2', '3', '{2}')}")
        if self.odd and self.maybe(0.1):
            given.append("unknown=3")
        word = self.one("", "", "params: ", "PARAMS: ") if given else ""
        nodes = self.one(f"{a} {b}", f"{a} {b}", f"({a} {b})", f"{a}, {b}")
        return f"{self.name('X')} {nodes} {self.cased(name)} {word}{' '.join(given)}".rstrip()

    def subcircuit(self, name, calls, size):
        """The lines of an inner subcircuit, and its header's parameters."""
        scope = Scope(parameters=dict(self.outer.parameters), functions=dict(self.outer.functions))
        header = {
            self.one(*NAMES).lower(): self.rng.choice((1e5, 3.0, 2e-8, 0.5))
            for _ in range(self.rng.choice((0, 0, 1, 2)))
        }
        scope.parameters |= header
        a, b = self.one(("a", "b"), ("p", "n"), ("x", "y"), ("1", "2"), ("n", "p"), ("in", "out"))
        if self.maybe(0.3):
            self.parameters(scope, 1)
        if self.maybe(0.15):
            self.functions(scope)
        elements = self.body(a, b, scope, size, False, calls)
        if self.maybe(0.1) and (
            self.odd or scope.parameters
        ):  # a name of the caller's, or of nobody
            elements.append(
                f"{self.name('R')} {a} {b} {{{self.one(*(list(scope.parameters) or ['k']))}}}"
            )
        words = " ".join(
            f"{self.cased(key)}{self.one('=', ' = ')}{self.literal(value)}"
            for key, value in header.items()
        )
        params = self.one("", "", "params: ", "PARAMS: ") if words else ""
        lines = scope.lines + elements if self.maybe(0.7) else elements + scope.lines
        subckt = self.cased(".subckt")
        nodes = self.one(f"{a} {b}", f"{a} {b}", f"({a} {b})")
        head = f"{subckt} {name} {nodes} {params}{words}".rstrip()
        return [head, *lines, self.one(".ends", f".ends {name}", ".ENDS")], header

    def file(self):
        """The whole file."""
        rng = self.rng
        if self.maybe(0.45):
            self.parameters(self.outer, rng.randint(1, 3))
        if self.maybe(0.2):
            self.functions(self.outer)
        inner, blocks = [], []
        for k in range(rng.choice((0, 0, 0, 1, 1, 2))):
            name = f"{self.one('sub', 'cell', 'Part')}{k}"
            calls = [rng.choice(inner)] if inner and self.maybe(0.6) else []
            lines, header = self.subcircuit(name, calls, rng.randint(0, 2))
            inner.append((name, header))
            blocks.append(lines)
        scope = Scope(parameters=dict(self.outer.parameters), functions=dict(self.outer.functions))
        header = {
            self.one(*NAMES).lower(): rng.choice((1e5, 3.0, 2e-8))
            for _ in range(rng.choice((0, 0, 1, 2)))
        }
        scope.parameters |= header
        if self.maybe(0.2):
            self.parameters(scope, 1)
        a, b = self.one(("p", "n"), ("p", "n"), ("x", "y"), ("1", "2"), ("in", "gnd2"), ("n", "p"))
        calls = [inner[-1]] if inner else []
        calls += [rng.choice(inner) for _ in range(rng.choice((0, 0, 1)))] if inner else []
        elements = self.body(a, b, scope, rng.randint(1, 4), True, calls)
        words = " ".join(
            f"{self.cased(key)}={self.literal(value)}" for key, value in header.items()
        )
        lines = scope.lines + elements if self.maybe(0.7) else elements + scope.lines
        board = [f".subckt board {a} {b} {words}".rstrip(), *lines, ".ends"]
        blocks.append(board)
        rng.shuffle(blocks)
        text = [line for block in blocks for line in block]
        text = self.outer.lines + text if self.maybe(0.6) else text + self.outer.lines
        text = [part for line in text for part in line.split("\n")]
        if self.odd and self.maybe(0.3):
            text.append(
                self.one(
                    ".options temp=50",
                    ".temp 40",
                    ".options gmin=1n",
                    ".option tnom=27",
                    ".ic v(a)=1",
                    ".global a",
                )
            )
        return "\n".join(["* a random netlist", *(self.dressed(line) for line in text), ""])

    def flat_file(self):
        """A whole file without a subcircuit around it, as KiCad exports one, with a ground of its own."""
        if self.maybe(0.4):
            self.parameters(self.outer, self.rng.randint(1, 2))
        a, b = self.one(("/pz_p", "/pz_n"), ("Net-_D1-A_", "Net-_D2-K_"), ("pz", "0"), ("p", "q"))
        elements = self.body(a, b, self.outer, self.rng.randint(1, 4), True, [])
        if b != "0":
            value = self.value(10 ** self.rng.uniform(1, 6), self.outer, "r")
            elements.append(
                f"{self.name('R')} {self.one('0', 'GND', 'gnd')} {self.one(b, a)} {value}"
            )
        load = self.one("R7", "Rload", "R_load")
        elements = [
            f"{load} {line.partition(' ')[2]}" if line.lower().startswith("rload") else line
            for line in elements
        ]
        text = [part for line in [*self.outer.lines, *elements] for part in line.split("\n")]
        return (
            "\n".join([".title a board", *(self.dressed(line) for line in text), ".end", ""]),
            (a, b),
            load,
        )

    def dressed(self, line):
        """A line with continuations, comments and blanks."""
        form = self.rng.random()
        if form < 0.08 and "{" not in line and "'" not in line:
            words = line.split(" ")
            at = self.rng.randint(1, len(words))
            if at < len(words):
                middle = self.one("\n+ ", "\n+", "\n* within\n+ ", " ; c\n+ ", "\n\n+ ")
                return " ".join(words[:at]) + middle + " ".join(words[at:])
        if form < 0.12:
            return f"{line} {self.one('; comment', '$ comment', '// comment', ';')}"
        if form < 0.15:
            return self.one(f"  {line}", f"\t{line}", line.replace(" ", "  ", 2))
        if form < 0.18:
            return f"* before\n{line}"
        return line
