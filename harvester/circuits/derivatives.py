"""Trees of expressions written as lines of Python, each value with its derivatives by the inputs (forward mode).

    z = f(a, b)   =>   dz/dw = df/da da/dw + df/db db/dw      for each input w that a or b depends on

A constant becomes an argument, so that the lines depend on the expression's form only; a sub-tree
that occurs twice is computed once; for c ? a : b only one branch is computed.
"""

from dataclasses import dataclass, field

from harvester.netlists.expression_tree import Node

Derivatives = dict[int, str]  # the name of each derivative by the number of its input
LARGEST_EXPONENT = 227.9559242064523  # ln(1e99), beyond which ngspice's exp does not grow
_AGAINST_ZERO = {"gt": ">", "lt": "<", "ge": ">=", "le": "<=", "eq": "==", "ne": "!="}


@dataclass
class Writer:
    """Writes lines: ``inputs`` are their variables by number, ``constants`` the values of the arguments p[0], ..."""

    inputs: list[str]
    constants: list[float] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    indent: str = ""
    _known: dict[Node, tuple[str, Derivatives]] = field(default_factory=dict)
    _names: int = 0

    def write(self, node: Node) -> tuple[str, Derivatives]:
        """The name of a node's value, and those of its derivatives that are not zero."""
        if node.operation == "constant":
            self.constants.append(node.value)
            return f"p[{len(self.constants) - 1}]", {}
        if node.operation == "input":
            return self.inputs[node.index], {node.index: "1.0"}
        if node.operation == "state":
            return f"s[{node.index}]", {}
        if node not in self._known:
            write = {"?": self._branches, "pwl": self._table}.get(node.operation, self._operation)
            self._known[node] = write(node)
        return self._known[node]

    def line(self, text: str) -> str:
        """Write an assignment, and return its variable."""
        name = f"t{self._names}"
        self._names += 1
        self.lines.append(f"{self.indent}{name} = {text}")
        return name

    def argument(self, value: float) -> str:
        """A number as an argument."""
        self.constants.append(value)
        return f"p[{len(self.constants) - 1}]"

    def _operation(self, node: Node) -> tuple[str, Derivatives]:
        parts = [self.write(argument) for argument in node.arguments]
        a = parts[0][0]
        b = parts[-1][0]
        text, slopes = _rule(node.operation, a, b)
        value = self.line(text)
        total: dict[int, list[str]] = {}
        for (_, derivatives), slope in zip(parts, slopes, strict=True):
            if slope is None or not derivatives:
                continue
            by_this = slope if slope in ("1.0", "-1.0") else self.line(slope.replace("$z", value))
            for index, inner in derivatives.items():
                product = (
                    inner
                    if by_this == "1.0"
                    else by_this
                    if inner == "1.0"
                    else f"{by_this}*{inner}"
                )
                total.setdefault(index, []).append(product)
        return value, {
            k: some[0] if some == ["1.0"] else self.line(" + ".join(some))
            for k, some in total.items()
        }

    def _table(self, node: Node) -> tuple[str, Derivatives]:
        """A table, whose points are arguments one after the other."""
        x, inner = self.write(node.arguments[0])
        first = len(self.constants)
        points = len(node.arguments) // 2
        self.constants += [argument.value for argument in node.arguments[1:]]
        value = self.line(f"table_at({x}, p, {first}, {points})")
        slope = self.line(f"table_slope({x}, p, {first}, {points})")
        return value, {
            k: slope if name == "1.0" else self.line(f"{slope}*{name}") for k, name in inner.items()
        }

    def _branches(self, node: Node) -> tuple[str, Derivatives]:
        condition = self.write(node.arguments[0])[0]
        outer = self.indent
        branches = []
        before = dict(self._known)
        blocks: list[list[str]] = []
        for branch in node.arguments[1:]:
            kept = self.lines
            self.lines = []
            self.indent = outer + "    "
            branches.append(self.write(branch))
            blocks.append(self.lines)
            # what a branch computes is known in it only
            self.lines = kept
            self._known = dict(before)
        self.indent = outer
        indices = sorted(set(branches[0][1]) | set(branches[1][1]))
        names = [f"t{self._names + k}" for k in range(len(indices) + 1)]
        self._names += len(names)
        heads = f"if {condition} != 0.0:", "else:"
        for head, block, (value, derivatives) in zip(heads, blocks, branches, strict=True):
            self.lines += [outer + head, *block, f"{outer}    {names[0]} = {value}"]
            for k, name in zip(indices, names[1:], strict=True):
                self.lines.append(f"{outer}    {name} = {derivatives.get(k, '0.0')}")
        return names[0], dict(zip(indices, names[1:], strict=True))


def _rule(operation: str, a: str, b: str) -> tuple[str, list[str | None]]:
    """The text of an operation on a and b, and its derivatives by them.

    None if that is zero ($z: the value).
    """
    if operation in ("<", ">", "<=", ">=", "==", "!="):
        return f"1.0 if {a} {operation} {b} else 0.0", [None, None]
    binary: dict[str, tuple[str, list[str | None]]] = {
        "+": (f"{a} + {b}", ["1.0", "1.0"]),
        "-": (f"{a} - {b}", ["1.0", "-1.0"]),
        "*": (f"{a} * {b}", [b, a]),
        "/": (f"{a} / fudged({b})", [f"1.0 / fudged({b})", f"-$z / fudged({b})"]),
        "and": (f"1.0 if {a} != 0.0 and {b} != 0.0 else 0.0", [None, None]),
        "or": (f"1.0 if {a} != 0.0 or {b} != 0.0 else 0.0", [None, None]),
        "min": (f"min({a}, {b})", [f"1.0 if {a} < {b} else 0.0", f"0.0 if {a} < {b} else 1.0"]),
        "max": (f"max({a}, {b})", [f"1.0 if {a} > {b} else 0.0", f"0.0 if {a} > {b} else 1.0"]),
        "pow": (
            f"abs({a}) ** {b}",
            [f"{b} * power_slope({a}, {b})", f"$z * math.log(max(abs({a}), 1e-300))"],
        ),
        "pwr": (
            f"math.copysign(abs({a}) ** {b}, {a})",
            [f"{b} * abs(power_slope({a}, {b}))", f"$z * math.log(max(abs({a}), 1e-300))"],
        ),
    }
    if operation in binary:
        return binary[operation]
    unary: dict[str, tuple[str, str | None]] = {
        "negative": (f"-{a}", "-1.0"),
        "not": (f"1.0 if {a} == 0.0 else 0.0", None),
        "abs": (f"abs({a})", f"1.0 if {a} >= 0.0 else -1.0"),
        "exp": (f"math.exp(min({a}, {LARGEST_EXPONENT!r}))", "$z"),
        "ln": (f"math.log(max({a}, 1e-300))", f"1.0 / max({a}, 1e-300)"),
        "log10": (f"math.log10(max({a}, 1e-300))", f"0.4342944819032518 / max({a}, 1e-300)"),
        "sqrt": (f"math.sqrt(max({a}, 0.0))", "0.5 / max($z, 1e-150)"),
        "sin": (f"math.sin({a})", f"math.cos({a})"),
        "cos": (f"math.cos({a})", f"-math.sin({a})"),
        "tan": (f"math.tan({a})", "1.0 + $z * $z"),
        "asin": (
            f"math.asin(min(max({a}, -1.0), 1.0))",
            f"1.0 / math.sqrt(max(1.0 - {a} * {a}, 1e-300))",
        ),
        "acos": (
            f"math.acos(min(max({a}, -1.0), 1.0))",
            f"-1.0 / math.sqrt(max(1.0 - {a} * {a}, 1e-300))",
        ),
        "asinh": (f"math.asinh({a})", f"1.0 / math.sqrt({a} * {a} + 1.0)"),
        "acosh": (f"math.acosh(max({a}, 1.0))", f"1.0 / math.sqrt(max({a} * {a} - 1.0, 1e-300))"),
        "atanh": (
            f"math.atanh(min(max({a}, -ALMOST), ALMOST))",
            f"1.0 / max(1.0 - {a} * {a}, 1e-300)",
        ),
        "atan": (f"math.atan({a})", f"1.0 / (1.0 + {a} * {a})"),
        "tanh": (f"math.tanh({a})", "1.0 - $z * $z"),
        "sinh": (f"math.sinh({a})", f"math.cosh({a})"),
        "cosh": (f"math.cosh({a})", f"math.sinh({a})"),
        "u": (f"0.5 if {a} == 0.0 else 1.0 if {a} > 0.0 else 0.0", None),
        "u2": (f"min(max({a}, 0.0), 1.0)", f"1.0 if 0.0 < {a} < 1.0 else 0.0"),
        "uramp": (f"max({a}, 0.0)", f"1.0 if {a} > 0.0 else 0.0"),
        "sgn": (f"math.copysign(1.0, {a}) if {a} != 0.0 else 0.0", None),
        **{
            f"{word}0": (f"1.0 if {a} {sign} 0.0 else 0.0", None)
            for word, sign in _AGAINST_ZERO.items()
        },
        "floor": (f"math.floor({a})", None),
        "ceil": (f"math.ceil({a})", None),
        "nint": (f"float(round({a}))", None),
    }
    text, slope = unary[operation]
    return text, [slope]
