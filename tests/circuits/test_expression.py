"""Expressions of netlists: their values are ngspice's, and their generated derivatives those of differences."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.derivatives import Writer
from harvester.circuits.newton_parts import ALMOST, fudged, power_slope, table_at, table_slope
from harvester.netlists.expression import BRACES, SOURCES, read, resolved
from harvester.netlists.expression_tree import Node, constant, input_of, with_leaves

NAMES = {"r": 1e6, "c": 2e-6}


def tree_of(text, language, names):
    return resolved(read(text, "here", language), "here", language, names.get, lambda name: None)


# The rows that differ between the languages are those that ngspice 39 gives
# (tests/netlists/constructs has them again).
VALUES = [
    ("1/(r*c)", 0.5, 0.5),
    ("2.2k", 2200.0, 2200.0),
    ("5Meg", 5e6, 5e6),
    ("1e3k", 1e6, 1e6),
    ("1mil", 1e-3, 25.4e-6),
    ("1e-7*20m", 2e-9, 2e-9),
    ("-2^2", -4.0, -4.0),
    ("2^3^2", 64.0, 64.0),
    ("2*-3", -6.0, -6.0),
    ("2*-3^2", 18.0, -18.0),
    ("2^-1", 0.5, 0.5),
    ("pow(-2, 3)", -8.0, 8.0),
    ("pwr(-2, 3)", 8.0, -8.0),
    ("(-2)^3", 8.0, 8.0),
    ("1 > 0 ? 3 : 4", 3.0, 3.0),
    ("!(1 < 0) && 2 >= 2", 1.0, 1.0),
    ("min(max(r, 0), 5)", 5.0, 5.0),
    ("sqrt(c/2u)", 1.0, 1.0),
    ("ln(exp(2)) + log10(100)", 4.0, 4.0),
    ("log(exp(2))", 2.0, 2.0),
    ("nint(2.5)", 2.0, 2.0),
    ("10m*exp(0)", 0.01, 0.01),
    ("7%3", 1.0, None),
    ("int(-2.7)", -2.0, None),
    ("sqr(3)", 9.0, None),
    ("2*-r", None, -2e6),
    ("1 ? 0 ? 4 : 5 : 6", None, 5.0),
    ("pwl(1.5, 0, 0, 1, 10, 2, 30)", None, 20.0),
    ("pwl(-1, 0, 3, 1, 10)", None, -4.0),
    ("pwl(9, 0, 3, 1, 10)", None, 66.0),
    ("uramp(-2) + u(3) + u(0) + u2(.25) + floor(2.7)", None, 3.75),
    ("2*pi", None, 2 * math.pi),
    ("2*{1+2}", None, 4.0),
]


@pytest.mark.parametrize(("text", "in_braces", "in_sources"), VALUES)
def test_a_constant_has_the_value_that_it_has_in_ngspice(text, in_braces, in_sources):
    for language, value in ((BRACES, in_braces), (SOURCES, in_sources)):
        if value is None:
            with pytest.raises(hv.InputError):
                tree_of(text, language, NAMES)
        else:
            assert tree_of(text, language, NAMES).value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("1 +", "its end"),
        ("2 ** (3", "its end"),
        ("foo*2", "'foo'"),
        ("bessel(2)", "'bessel'"),
        ("min(1, 2, 3)", "give 2 arguments to min"),
        ("3 # 4", "'# 4'"),
        ("(" * 300 + "1" + ")" * 300, "at most 100 parentheses"),
        ("+".join(["v(a)"] * 2000), "at most 5,000 operations"),
        ("1e999", "'1e999'"),
    ],
)
def test_what_cannot_be_read_is_said_in_one_line(text, complaint):
    with pytest.raises(hv.InputError, match="here") as error:
        tree_of(text, SOURCES, NAMES)
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)


def test_trees_that_share_their_branches_are_read_in_no_time():
    """A table in a table, forty times, and a function of itself three times, eight times over."""
    text = "v(a)"
    for _ in range(40):
        text = f"pwl({text}, -1, 0, 1, 2)"
    assert tree_of(text, SOURCES, {}).depth == 41
    with pytest.raises(hv.InputError, match="at most 5,000 operations"):
        text = "v(a)"
        for _ in range(8):
            text = f"({text}+{text}+{text})"
        tree_of(text, SOURCES, {})


TREES = [
    "x*y - x/y",
    "exp(-x)*tanh(3*y)",
    "min(x, y) + max(x, 2*y)*abs(x - y)",
    "x > 0.4 ? x*x : (y > 0 ? y : -3*x)",
    "pwl(x, -1, 0, 0, 1, 2, -3)*y",
    "asin(x/2) + acos(y/3) + asinh(x) + acosh(2 + x*x) + atanh(y/2)",
    "u2(x) + nint(y) + sgn(x) + gt0(y)*x",
    "sqrt(x*x + y*y) + ln(2 + x)",
    "x^3 + pwr(y, 2) + (x*y)**2",
    "0.5 + 0.5*tanh(100*(x - 0.3 + 0.2*y))",
    "uramp(x - y)/max(y, 0.5)",
    "sin(x)*cos(y) + atan(x*y)",
]


def of_inputs(text, **values):
    """The tree of an expression whose names x and y are inputs."""
    numbers = {name: constant(value) for name, value in values.items()}
    table = {"x": input_of(0), "y": input_of(1), **numbers}
    return with_leaves(
        resolved_tables(read(text, "here", SOURCES)), lambda node: table[node.names[0]]
    )


def resolved_tables(tree):
    """The same with voltages in place of names, so that tables are checked."""
    renamed = with_leaves(tree, lambda node: Node("v", names=node.names))
    return resolved(renamed, "here", SOURCES, lambda name: None, lambda name: None)


@pytest.mark.parametrize("text", TREES)
def test_generated_derivatives_are_those_of_differences(text):
    tree = of_inputs(text)
    writer = Writer(["x", "y"])
    value, slopes = writer.write(tree)
    lines = "\n    ".join(
        [*writer.lines, f"return {value}, {slopes.get(0, '0.0')}, {slopes.get(1, '0.0')}"]
    )
    scope = {"math": math, "fudged": fudged, "power_slope": power_slope, "ALMOST": ALMOST}
    scope |= {"table_at": table_at, "table_slope": table_slope}
    exec(f"def f(x, y, p):\n    {lines}", scope)
    rng = np.random.default_rng(1)
    for x, y in rng.uniform(-1.5, 1.5, (40, 2)):
        p = np.array(writer.constants)
        step = 1e-7
        _, by_x, by_y = scope["f"](x, y, p)
        across = scope["f"](x + step, y, p)[0] - scope["f"](x - step, y, p)[0]
        along = scope["f"](x, y + step, p)[0] - scope["f"](x, y - step, p)[0]
        assert by_x == pytest.approx(across / (2 * step), rel=1e-5, abs=1e-5)
        assert by_y == pytest.approx(along / (2 * step), rel=1e-5, abs=1e-5)


def test_the_form_of_a_generated_function_does_not_depend_on_its_numbers():
    texts = []
    for values in ({"a": 1.0, "b": 0.0}, {"a": -3.0, "b": 7.0}):
        writer = Writer(["x"])
        writer.write(of_inputs("a*tanh(x - b) + (x > b ? a : 2*x)", **values))
        texts.append(writer.lines)
    assert texts[0] == texts[1]
