"""Expressions of netlists: their values are ngspice's, and their generated derivatives those of differences."""

import math

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.derivatives import Writer
from harvester.circuits.expression import input_of, number, read
from harvester.circuits.newton_parts import fudged, power_slope

NAMES = {"r": 1e6, "c": 2e-6}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("{1/(r*c)}", 0.5),
        ("2.2k", 2200.0),
        ("5Meg", 5e6),
        ("1e-7*20m", 2e-9),
        ("-2^2", -4.0),
        ("2*-3", -6.0),
        ("1 > 0 ? 3 : 4", 3.0),
        ("!(1 < 0) && 2 >= 2", 1.0),
        ("min(max(r, 0), 5)", 5.0),
        ("limit(7, 0, 5)", 5.0),
        ("pwl(1.5, 0, 0, 1, 10, 2, 30)", 20.0),
        ("pwl(-1, 0, 3, 1, 10)", 3.0),
        ("pwl(9, 0, 3, 1, 10)", 10.0),
        ("sqrt(c/2u)", 1.0),
        ("ln(exp(2)) + log10(100)", 4.0),
        ("uramp(-2) + u(3) + floor(2.7)", 3.0),
        ("10m*exp(0)", 0.01),
    ],
)
def test_a_constant_has_the_value_that_it_has_in_ngspice(text, value):
    assert number(text, "here", NAMES) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("1 +", "its end"), ("2 ** (3", "its end"), ("foo*2", "'foo'"), ("bessel(2)", "'bessel'"), ("1/0", "finite"),
     ("v(a)", "must be a constant"), ("3 # 4", "'# 4'")],
)  # fmt: skip
def test_what_cannot_be_read_is_said_in_one_line(text, complaint):
    with pytest.raises(hv.InputError, match=r"^here must") as error:
        number(text, "here", NAMES)
    assert complaint in str(error.value)


TREES = [
    "x*y - x/y",
    "exp(-x)*tanh(3*y)",
    "min(x, y) + max(x, 2*y)*abs(x - y)",
    "x > 0.4 ? x*x : (y > 0 ? y : -3*x)",
    "pwl(x, -1, 0, 0, 1, 2, -3)*y",
    "sqrt(x*x + y*y) + ln(2 + x)",
    "x^3 + pwr(y, 2) + (x*y)**2",
    "0.5 + 0.5*tanh(100*(x - 0.3 + 0.2*y))",
    "uramp(x - y)/max(y, 0.5)",
    "sin(x)*cos(y) + atan(x*y)",
]


@pytest.mark.parametrize("text", TREES)
def test_generated_derivatives_are_those_of_differences(text):
    tree = read(text, "here", {"x": input_of(0), "y": input_of(1)})
    writer = Writer(["x", "y"])
    value, slopes = writer.write(tree)
    lines = "\n    ".join([*writer.lines, f"return {value}, {slopes.get(0, '0.0')}, {slopes.get(1, '0.0')}"])
    scope = {"math": math, "fudged": fudged, "power_slope": power_slope}
    exec(f"def f(x, y, p):\n    {lines}", scope)
    rng = np.random.default_rng(1)
    for x, y in rng.uniform(-1.5, 1.5, (40, 2)):
        p, step = writer.constants, 1e-7
        _, by_x, by_y = scope["f"](x, y, p)
        across = scope["f"](x + step, y, p)[0] - scope["f"](x - step, y, p)[0]
        along = scope["f"](x, y + step, p)[0] - scope["f"](x, y - step, p)[0]
        assert by_x == pytest.approx(across / (2 * step), rel=1e-5, abs=1e-5)
        assert by_y == pytest.approx(along / (2 * step), rel=1e-5, abs=1e-5)


def test_the_form_of_a_generated_function_does_not_depend_on_its_numbers():
    texts = []
    for values in ({"a": 1.0, "b": 0.0}, {"a": -3.0, "b": 7.0}):
        writer = Writer(["x"])
        writer.write(read("a*tanh(x - b) + (x > b ? a : 2*x)", "here", {"x": input_of(0), **values}))
        texts.append(writer.lines)
    assert texts[0] == texts[1]
