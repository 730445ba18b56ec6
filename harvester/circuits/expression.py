"""Expressions of netlists, as trees: read as ngspice reads them, with their constants already computed.

    c ? a : b, or, and, comparisons, + -, * / %, unary - and !, ^ or **        from the weakest to the strongest

A tree's leaves are constants and inputs; an input is a voltage v(a), v(a,b) or a current i(Vname) of the circuit.  What
has no input is a constant whatever its size, so that trees of the same text are alike for all values of parameters.

Source of the rules: ngspice manual, sections 2.14 and 5.1, and ngspice's inpptree.c.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from harvester.errors import InputError
from harvester.quantities.units import PREFIXES

_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?[a-z]*"
_SIGNS = r"\*\*|&&|\|\||<=|>=|==|!=|<>|[-+*/%^()<>!?:,={}]"
_TOKEN = re.compile(rf"\s*(?:{_NUMBER}|[a-z_][\w.]*|{_SIGNS})", re.IGNORECASE | re.ASCII)
_SUFFIXES = {"meg" if prefix == "M" else prefix.lower(): 10.0**power for prefix, power in PREFIXES.items()}
_CONSTANTS = {"pi": math.pi, "e": math.e, "echarge": 1.602176634e-19, "boltz": 1.380649e-23, "kelvin": -273.15,
              "temper": 27.0, "true": 1.0, "false": 0.0, "yes": 1.0, "no": 0.0}  # fmt: skip
_BINARY = ({"||": "or"}, {"&&": "and"}, {sign: sign for sign in ("<", ">", "<=", ">=", "==", "!=", "<>")},
           {"+": "+", "-": "-"}, {"*": "*", "/": "/", "%": "%"})  # fmt: skip


@dataclass(frozen=True)
class Node:
    """A node of a tree: an operation on ``arguments``, a constant of a ``value``, or the input of an ``index``."""

    operation: str
    arguments: tuple["Node", ...] = ()
    value: float = 0.0
    index: int = 0


def constant(value: float) -> Node:
    """A leaf that has a value."""
    return Node("constant", value=float(value))


def input_of(index: int) -> Node:
    """A leaf that is an input."""
    return Node("input", index=index)


Input = Callable[[str, tuple[str, ...]], Node]  # of "v" and its nodes, or "i" and its source


def read(text: str, where: str, names: Mapping[str, float | Node], inputs: Input | None = None) -> Node:
    """The tree of an expression; ``names`` are its parameters in lower case, which may be trees themselves.

    Raises InputError, which says ``where``, for what cannot be read, unknown names and functions, and an input where
    ``inputs`` is None.
    """
    return _Reader(text, where, names, inputs).whole()


def number(text: str, where: str, names: Mapping[str, float]) -> float:
    """The value of an expression of parameters, with or without braces.

    Raises InputError where it cannot be computed.
    """
    node = read(text, where, names)
    if not math.isfinite(node.value):
        raise InputError(f"{where} must give a finite number, but {text[:60]!r} does not")
    return node.value


class _Reader:
    """Reads one expression by recursive descent."""

    def __init__(self, text: str, where: str, names: Mapping[str, float | Node], inputs: Input | None) -> None:
        self.text, self.where, self.names, self.inputs = text, where, names, inputs
        self.tokens: list[str] = []
        rest = text.strip().strip("'\"").lower()
        while rest.strip():
            if (token := _TOKEN.match(rest)) is None:
                raise self._unread(rest.strip()[:20])
            self.tokens.append(token[0].strip())
            rest = rest[token.end() :]
        self.position = 0

    def _unread(self, what: str) -> InputError:
        must = "have an expression that can be read, but not"
        return InputError(f"{self.where} must {must} at {what!r} of {self.text[:60]!r}")

    def _next(self) -> str:
        return self.tokens[self.position] if self.position < len(self.tokens) else ""

    def _take(self, expected: str = "") -> str:
        token = self._next()
        if not token or (expected and token != expected):
            raise self._unread(token or "its end")
        self.position += 1
        return token

    def whole(self) -> Node:
        tree = self._ternary()
        if self._next():
            raise self._unread(self._next())
        return tree

    def _ternary(self) -> Node:
        condition = self._binary(0)
        if self._next() != "?":
            return condition
        self._take()
        first = self._ternary()
        self._take(":")
        return operation("?", condition, first, self._ternary())

    def _binary(self, level: int) -> Node:
        if level == len(_BINARY):
            return self._unary()
        left = self._binary(level + 1)
        while self._next() in _BINARY[level]:
            word = _BINARY[level][self._take()]
            left = operation("!=" if word == "<>" else word, left, self._binary(level + 1))
        return left

    def _unary(self) -> Node:
        if self._next() in ("-", "+", "!"):
            sign = self._take()
            inner = self._unary()
            return inner if sign == "+" else operation("negative" if sign == "-" else "not", inner)
        base = self._atom()
        if self._next() in ("^", "**"):
            self._take()
            return operation("pow", base, self._unary())
        return base

    def _atom(self) -> Node:
        token = self._take()
        if token in ("(", "{"):
            inner = self._ternary()
            self._take(")" if token == "(" else "}")
            return inner
        if re.fullmatch(_NUMBER, token):
            digits = re.match(r"(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", token)
            assert digits is not None, "a number begins with digits"
            rest = token[digits.end() :]
            scale = _SUFFIXES["meg"] if rest.startswith("meg") else _SUFFIXES.get(rest[:1], 1.0) if rest else 1.0
            return constant(float(digits[0]) * scale)
        if not re.match(r"[a-z_]", token):
            raise self._unread(token)
        return self._call(token) if self._next() == "(" else self._name(token)

    def _name(self, name: str) -> Node:
        if name in self.names:
            value = self.names[name]
            return value if isinstance(value, Node) else constant(value)
        if name in _CONSTANTS:
            return constant(_CONSTANTS[name])
        raise InputError(f"{self.where} must use names that have a value here, but {name!r} has none")

    def _call(self, name: str) -> Node:
        self._take("(")
        if name in ("v", "i"):
            if self.inputs is None:
                raise InputError(f"{self.where} must be a constant, but depends on {name}(...)")
            words = [self._take()]
            while self._next() != ")":
                self._take(",")
                words.append(self._take())
            self._take(")")
            return self.inputs(name, tuple(words))
        arguments = [self._ternary()]
        while self._next() == ",":
            self._take()
            arguments.append(self._ternary())
        self._take(")")
        name = {"log": "ln", "ternary_fcn": "?", "sgn": "sign"}.get(name, name)
        if name == "pwl":
            return _table(arguments)
        if name not in FUNCTIONS or len(arguments) != FUNCTIONS[name]:
            given = f"{name!r} with {len(arguments)} arguments"
            raise InputError(f"{self.where} must use functions that compiled circuits know, but {given} is none")
        return operation(name, *arguments)


# Functions by their number of arguments
FUNCTIONS = {
    **dict.fromkeys(("abs", "exp", "ln", "log10", "sqrt", "sin", "cos", "tan", "atan", "tanh", "sinh", "cosh"), 1),
    **dict.fromkeys(("u", "uramp", "sign", "floor", "ceil", "int", "nint"), 1),
    **dict.fromkeys(("min", "max", "pow", "pwr"), 2),
    "?": 3,
    "limit": 3,
}


def operation(name: str, *arguments: Node) -> Node:
    """An operation on trees, computed at once where all are constants."""
    if name == "limit":
        x, low, high = arguments
        return operation("min", operation("max", x, low), high)
    if all(argument.operation == "constant" for argument in arguments):
        return constant(value_of(name, *(argument.value for argument in arguments)))
    return Node(name, arguments)


def _table(arguments: list[Node]) -> Node:
    """A table pwl(x, x0, y0, x1, y1, ...): straight between its points, and constant beyond them."""
    x, knots, values = arguments[0], arguments[1::2], arguments[2::2]
    tree = values[-1]
    for k in range(len(knots) - 2, -1, -1):
        slope = operation("/", operation("-", values[k + 1], values[k]), operation("-", knots[k + 1], knots[k]))
        line = operation("+", values[k], operation("*", slope, operation("-", x, knots[k])))
        tree = operation("?", operation("<", x, knots[k + 1]), line, tree)
    return operation("?", operation("<", x, knots[0]), values[0], tree)


def value_of(name: str, *x: float) -> float:
    """The value of an operation on numbers; infinite or nan where there is none."""
    try:
        return float(_VALUES[name](*x))
    except (OverflowError, ZeroDivisionError, ValueError):
        return math.nan


_VALUES: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "%": math.fmod, "negative": lambda a: -a, "not": lambda a: a == 0.0, "or": lambda a, b: bool(a) or bool(b),
    "and": lambda a, b: bool(a) and bool(b), "<": lambda a, b: a < b, ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b, "==": lambda a, b: a == b, "!=": lambda a, b: a != b,
    "?": lambda c, a, b: a if c else b, "abs": abs, "exp": math.exp, "ln": math.log, "log10": math.log10,
    "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "atan": math.atan, "tanh": math.tanh,
    "sinh": math.sinh, "cosh": math.cosh, "u": lambda a: a > 0.0, "uramp": lambda a: max(a, 0.0),
    "sign": lambda a: (a > 0.0) - (a < 0.0), "floor": math.floor, "ceil": math.ceil, "int": math.trunc,
    "nint": round, "min": min, "max": max, "pow": lambda a, b: abs(a) ** b,
    "pwr": lambda a, b: math.copysign(abs(a) ** b, a),
}  # fmt: skip
