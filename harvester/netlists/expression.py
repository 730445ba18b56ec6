"""Expressions of netlists as trees, read in the two languages that ngspice has for them.

`BRACES` is the language of ``{...}``, ``'...'`` and .param cards (numparam): numbers and parameters
only.  `SOURCES` is that of B sources: also voltages and currents, its braces and quotes are
dropped. They differ in their functions, in their constants and in the precedence of a sign, and pow
and pwr change places:

    BRACES     pow(x, y) = x^y            pwr(x, y) = |x|^y          from the left: 2^3^2 = 64, x^y = |x|^y
    SOURCES    pow(x, y) = |x|^y          pwr(x, y) = sgn(x) |x|^y   also from the left

A tree's leaves are constants, names of parameters, and voltages v(a), v(a,b) or currents i(Vname).
An expression with none of the latter becomes a constant once its names have values, so that trees
of the same text are alike for all values.

Source: ngspice 39's xpressn.c (numparam), inpptree-parser.y, inpptree.c, ptfuncs.c, and
`INPevaluate`; each rule is a row of tests/netlists/constructs.

Long because both languages and their reader belong together.
"""

import math
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from harvester.errors import InputError, shown, unknown
from harvester.netlists.expression_tree import Node, checked, constant, limited, operation, table

DEEPEST = 100  # parentheses, functions or signs one within another

# powers of ten
SUFFIXES = {"t": 12, "g": 9, "meg": 6, "k": 3, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15}
_MIL = 25.4e-6  # m
_PLAIN = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:([ed])([+-]?\d+))?([a-z]*)(.*)", re.DOTALL)
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?[a-z]*"
_SIGNS = r"\*\*|&&|\|\||<=|>=|==|!=|<>|[-+*/%^()<>!?:,={}'\"\\&|~]"
_TOKEN = re.compile(rf"\s*({_NUMBER}|[a-z_][\w.]*|{_SIGNS})", re.ASCII)
_PROBE = re.compile(r"([vi])\(\s*([^\s(),]+)\s*(?:,\s*([^\s(),]+)\s*)?\)")


class Language(NamedTuple):
    """The grammar of an expression.

    ``operators`` have their precedence; a sign includes the operators behind its operand that bind
    at least as ``sign``. ``functions`` have their number of arguments and the operation that they
    are.
    """

    name: str
    operators: Mapping[str, int]
    sign: int
    functions: Mapping[str, tuple[int, str]]
    constants: Mapping[str, float]


_UNARY = ("abs", "exp", "ln", "log10", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "floor", "ceil", "nint", "sgn")  # fmt: skip
_BOTH = {name: (1, name) for name in _UNARY} | {
    "log": (1, "ln"),
    "min": (2, "min"),
    "max": (2, "max"),
}
_BOTH |= {"ternary_fcn": (3, "?")}
BRACES = Language(
    "braces",
    {"||": 1, "&&": 2, **dict.fromkeys(("<", ">", "<=", ">=", "==", "=", "!=", "<>"), 3),
     **dict.fromkeys("+-", 4), **dict.fromkeys("*/%", 5), "^": 6, "**": 6},
    5,
    {**_BOTH, "sqr": (1, "sqr"), "arctan": (1, "atan"), "int": (1, "int"), "pow": (2, "power"), "pwr": (2, "pow")},
    {},
)  # fmt: skip
SOURCES = Language(
    "sources",
    {"||": 1, "&&": 2, **dict.fromkeys(("==", "!=", "<>"), 3), **dict.fromkeys(("<", ">", "<=", ">="), 4),
     **dict.fromkeys("+-", 5), **dict.fromkeys("*/", 6), "^": 8, "**": 8},
    8,
    {**_BOTH, "u": (1, "u"), "u2": (1, "u2"), "uramp": (1, "uramp"), "pow": (2, "pow"), "pwr": (2, "pwr"),
     "gt0": (1, "gt0"), "lt0": (1, "lt0"), "ge0": (1, "ge0"), "le0": (1, "le0"), "eq0": (1, "eq0"), "ne0": (1, "ne0")},
    {"pi": math.pi, "e": math.e},
)  # fmt: skip
_OPERATIONS = {"^": "pow", "**": "pow", "<>": "!=", "=": "==", "&&": "and", "||": "or"}
_RANDOM = ("agauss", "gauss", "unif", "aunif")
_REMEDIES = {
    "limit": "with two arguments it draws a random number; limit(x, low, high) bounds x",
    **dict.fromkeys(
        _RANDOM, "it draws a random number without a seed: harvester tolerance --vary draws parts"
    ),
    "if": "write condition ? a : b",
    "ddt": "ngspice's derivative is no more than a difference of its steps: let a capacitor make it",
    "stp": "write u",
    "table": "write pwl",
}
# Functions of LTspice, unless the netlist has its own of that name.
_OF_LTSPICE = {
    "buf": "write x > 0.5 ? 1 : 0",
    "inv": "write x > 0.5 ? 0 : 1",
    **dict.fromkeys(("delay", "absdelay"), "let a resistor and a capacitor delay the voltage"),
    **dict.fromkeys(("idt", "sdt", "idtmod"), "let a current source charge a capacitor"),
    **dict.fromkeys(("mc", "flat", "rand", "random", "white"), _REMEDIES["gauss"]),
}


def plain_number(text: str, mil: bool = True) -> float | None:
    """A number as an element's value has it (2.2k, 5Meg, 1e3k, 10mil), by `INPevaluate`.

    None for anything else.

    A parameter has no ``mil``: ngspice reads 10mil as 10m there.

    The text after the number and its suffix is a unit that ngspice does not read.
    """
    match = _PLAIN.fullmatch(text.strip().lower())
    if match is None or (match[5] and not re.fullmatch(r"[\w%]*", match[5], re.ASCII)):
        return None
    return _scaled(f"{match[1]}e{match[3] or 0}", match[4], mil)


def _scaled(number: str, letters: str, mil: bool) -> float | None:
    """The value of a number with an exponent and the letters behind it; braces have no mil.

    None for one too large.
    """
    digits, _, exponent = number.partition("e")
    if len(exponent) > 5:
        return None
    if mil and letters.startswith("mil"):
        return float(f"{digits}e{exponent}") * _MIL
    power = SUFFIXES["meg"] if letters.startswith("meg") else SUFFIXES.get(letters[:1], 0)
    value = float(f"{digits}e{int(exponent) + power}")
    return value if math.isfinite(value) else None


def read(text: str, where: str, language: Language) -> Node:
    """The tree of an expression, in lower case, whose names have no values yet.

    Raises InputError, which names ``where``, for a text that cannot be read or is too long, and
    functions of other languages.
    """
    return _Reader(text, where, language).whole()


class _Reader:
    """Reads one expression: operands, and operators by their precedence."""

    def __init__(self, text: str, where: str, language: Language) -> None:
        self.text = text
        self.where = where
        self.language = language
        self.tokens: list[str] = []
        self.probes: list[Node] = []
        self.position = self.nesting = 0
        rest = text.strip().lower()
        while rest.strip():
            match = _PROBE.match(rest.lstrip()) if language is SOURCES else None
            if match is not None and not (self.tokens and self.tokens[-1] == "."):
                self.probes.append(
                    Node(match[1], names=tuple(name for name in match.groups()[1:] if name))
                )
                self.tokens.append(f"@{len(self.probes) - 1}")
                rest = rest.lstrip()[match.end() :]
                continue
            if (token := _TOKEN.match(rest)) is None:
                raise self._unread(rest.strip()[:20])
            if language is not SOURCES or token[1] not in "{}'\"":  # which ngspice drops there
                self.tokens.append(token[1])
            rest = rest[token.end() :]

    def _unread(self, what: str) -> InputError:
        must = "have an expression that ngspice can read, but not"
        remedy = f": write {2 * what}" if what in ("&", "|") else ""
        return InputError(f"{self.where} must {must} at {what!r} of {self.text[:60]!r}{remedy}")

    def _next(self) -> str:
        return self.tokens[self.position] if self.position < len(self.tokens) else ""

    def _take(self, expected: str = "") -> str:
        token = self._next()
        if not token or (expected and token != expected):
            raise self._unread(token or "its end")
        self.position += 1
        return token

    def whole(self) -> Node:
        """The tree of all tokens."""
        tree = self._expression()
        if self._next():
            raise self._unread(self._next())
        return checked(tree, self.where)

    def _expression(self) -> Node:
        """An expression up to its end."""
        tree = self._rest(self._operand(first=True), 1)
        return self._branches(tree) if self._next() == "?" else tree

    def _rest(self, left: Node, least: int) -> Node:
        """An operand with the operators after it that bind at least as much as ``least``, from the left."""
        while (precedence := self.language.operators.get(token := self._next(), 0)) >= least:
            self._take()
            right = self._rest(self._operand(first=False), precedence + 1)
            left = checked(operation(_OPERATIONS.get(token, token), left, right), self.where)
        return left

    def _branches(self, condition: Node) -> Node:
        """The two branches of ``condition ? a : b``.

        In braces ngspice misreads one within another.
        """
        self._take("?")
        first = self._branch()
        self._take(":")
        second = self._branch()
        if self.language is BRACES and self._next() == "?":
            raise InputError(
                f"{self.where} must put a ? within another in parentheses, which ngspice misreads without"
            )
        return operation("?", condition, first, second)

    def _branch(self) -> Node:
        return (
            self._nested(self._expression)
            if self.language is SOURCES
            else self._rest(self._operand(first=False), 1)
        )

    def _operand(self, first: bool) -> Node:
        """A number, a name, a call or a parenthesis, with its sign.

        ``first``: no operator precedes it.
        """
        token = self._next()
        if token not in ("-", "+", "!"):
            return self._atom()
        self._take()
        if self.language is BRACES and token == "!":
            return operation("not", self._atom())
        if self.language is BRACES and not first:
            if token == "+" or not re.fullmatch(_NUMBER, self._next()):
                raise InputError(
                    f"{self.where} must put a sign that follows an operator in parentheses, as ngspice reads it before "
                    f"a number only, in {self.text[:60]!r}"
                )
            return operation("negative", self._atom())
        inner = self._nested(lambda: self._rest(self._operand(first=False), self.language.sign))
        return inner if token == "+" else operation("not" if token == "!" else "negative", inner)

    def _nested(self, read_inner: Callable[[], Node]) -> Node:
        """The expression one level deeper."""
        self.nesting += 1
        if self.nesting > DEEPEST:
            raise InputError(
                f"{self.where} must have at most {DEEPEST} parentheses or signs one within another"
            )
        inner = read_inner()
        self.nesting -= 1
        return inner

    def _atom(self) -> Node:
        token = self._take()
        if token.startswith("@"):
            return self.probes[int(token[1:])]
        if token == "(":
            inner = self._nested(self._expression)
            self._take(")")
            return inner
        if token[0] in ".0123456789":
            return constant(self._number(token))
        if not re.match(r"[a-z_]", token):
            raise self._unread(token)
        if self._next() == "(":
            return self._call(token)
        if token in ("time", "temper", "hertz"):
            return Node(token)
        return Node("name", names=(token,))

    def _number(self, token: str) -> float:
        """The value of a number with its suffix."""
        digits = re.match(r"(\d+\.?\d*|\.\d+)(?:e([+-]?\d+))?", token)
        assert digits is not None, "a number begins with digits"
        value = _scaled(
            f"{digits[1]}e{digits[2] or 0}", token[digits.end() :], mil=self.language is SOURCES
        )
        if value is None:
            raise self._unread(token)
        return value

    def _call(self, name: str) -> Node:
        self._take("(")
        arguments = [self._nested(self._expression)]
        while self._next() == ",":
            self._take()
            arguments.append(self._nested(self._expression))
        self._take(")")
        if name == "pwl" and self.language is SOURCES:
            return Node("pwl", tuple(arguments))
        if name == "limit" and len(arguments) == 3:
            return limited(arguments[0], arguments[1], arguments[2])
        if name in self.language.functions:
            count, which = self.language.functions[name]
            if len(arguments) != count:
                raise InputError(
                    f"{self.where} must give {count} arguments to {name}, but gives {len(arguments)}"
                )
            return operation(which, *arguments)
        if name in _REMEDIES:
            raise InputError(f"{self.where} must not use {name}: {_REMEDIES[name]}")
        return Node("call", tuple(arguments), names=(name,))


Values = Callable[[str], float | None]  # of a name
# of a name: its arguments and its text
Functions = Callable[[str], tuple[tuple[str, ...], str] | None]


def resolved(
    tree: Node, where: str, language: Language, values: Values, functions: Functions, depth: int = 0
) -> Node:
    """The tree with ``values`` in place of its names, and the netlist's ``functions`` written out.

    Raises InputError, which names ``where``, for a name or a function that is not known.
    """
    done: dict[Node, Node] = {}

    def new(node: Node) -> Node:
        if node not in done:
            done[node] = made(node)
        return done[node]

    def made(node: Node) -> Node:
        if node.operation == "name":
            value = values(node.names[0])
            value = language.constants.get(node.names[0]) if value is None else value
            if value is None:
                raise InputError(
                    f"{where} must use names that have a value, but {shown(node.names[0])} has none"
                )
            return constant(value)
        arguments = [new(argument) for argument in node.arguments]
        if node.operation == "call":
            return called(node.names[0], arguments)
        if node.operation == "pwl":
            return table(arguments, where)
        if not arguments:
            return node
        return operation(node.operation, *arguments)

    def called(name: str, arguments: list[Node]) -> Node:
        if (function := functions(name)) is None and name in _OF_LTSPICE:
            raise InputError(f"{where} must not use {name}: {_OF_LTSPICE[name]}")
        if function is None:
            raise unknown(
                f"function of {where}",
                name,
                [*language.functions, *(["pwl"] if language is SOURCES else [])],
            )
        parameters, text = function
        if len(parameters) != len(arguments) or depth > 20:
            must = (
                f"give {len(parameters)} arguments to {name}"
                if depth <= 20
                else f"call no function {name} in itself"
            )
            raise InputError(f"{where} must {must}")
        body = read(text, where, language)
        given = dict(zip(parameters, arguments, strict=True))
        return resolved(_with(body, given), where, language, values, functions, depth + 1)

    return checked(new(tree), where)


def _with(tree: Node, given: Mapping[str, Node]) -> Node:
    """The tree with other trees in place of names."""
    if tree.operation == "name":
        return given.get(tree.names[0], tree)
    if not tree.arguments:
        return tree
    arguments = tuple(_with(argument, given) for argument in tree.arguments)
    return Node(tree.operation, arguments, names=tree.names)
