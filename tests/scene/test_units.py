"""Numbers with units: right dimension, right size, and nothing but ValueError for anything else."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harvester.scene.keys import read_value
from harvester.scene.kinds import FREQUENCY, Kind, any_quantity, with_prefix
from harvester.scene.units import USUAL_UNITS, factor_by_pint

MASS = Kind("a mass (kg)", "kg", "'40 g'", above=0.0)
PSD = Kind("a density", "(m/s^2)^2/Hz", "'0.01 g^2/Hz'", least=0.0, gravity=True)
RATIO = Kind("a ratio", "", "0.96", least=0.0, most=1.0)
LOAD = Kind("a load resistance (ohm)", "ohm", "'1 Mohm'", above=0.0)
G = 9.80665


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (MASS, 0.04, 0.04),
        (MASS, "40 g", 0.04),
        (MASS, " 4e1g ", 0.04),
        (LOAD, "1 Mohm", 1e6),
        (LOAD, "2 kΩ", 2e3),
        (PSD, "0.01 g^2/Hz", 0.01 * G**2),
        (PSD, "0.01 g**2/Hz", 0.01 * G**2),
        (PSD, "0.01 g²/Hz", 0.01 * G**2),
        (PSD, "2 (m/s^2)^2/Hz", 2.0),
        (PSD, "2 m^2/s^3", 2.0),
        (RATIO, "0.5", 0.5),
        (FREQUENCY, "20.1 rad/s", 20.1 / (2.0 * math.pi)),
        (FREQUENCY, "192 rpm", 3.2),
        (FREQUENCY, "1152 deg/s", 3.2),
        (FREQUENCY, "3.2 cycle/s", 3.2),
        (PSD, "2 (m/s^2)^2 s/rad", 4.0 * math.pi),
    ],
)
def test_read(kind, text, value):
    assert kind.read(text) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    "bad",
    [
        *(True, None, [1.0], {}, 0.0, -1.0, float("nan"), float("inf"), 10**400, 1e-51, 1e51),
        *("", "40", "g", "40 s", "-1 g", "nan kg", "1e999 kg", "1e99 kg", "5 5 kg", "1 kg kg", "1 kg\nkg", "1 kg/0"),
        *("1 (", "1 )", "1 %", "1 degC", "1 kg^degC", "1 lambda", "1 __import__('os')"),
    ],
)
def test_what_is_no_mass(bad):
    with pytest.raises(ValueError, match="must be a mass"):
        MASS.read(bad)


@pytest.mark.parametrize(
    ("kind", "text"), [(MASS, "40 g rad"), (FREQUENCY, "3 rad^2/s"), (FREQUENCY, "3 Hz/rad"), (PSD, "1 g^2 rad/Hz")]
)
def test_angles_elsewhere_are_no_units(kind, text):
    with pytest.raises(ValueError, match="must be a"):
        kind.read(text)


@pytest.mark.parametrize(
    "slow", ["1 kg^9^9^9^9", "1 kg*9^9^9^9", "1 kg**9**9**9", "1 kg²^9^9", "1 x" + " " * 50_000 + "y", "1" * 50_000]
)
def test_what_would_take_for_ever(slow):
    """Towers of powers and quadratic matching: seconds to hours without their guards (the suite would hang)."""
    with pytest.raises(ValueError, match="must be a mass"):
        MASS.read(slow)


@settings(deadline=None, max_examples=300, derandomize=True)
@given(st.text(max_size=30) | st.text("0123456789.eE+-*/^() gkmsHzµΩ²_%°\n", max_size=30).map("1".__add__))
def test_any_text_is_a_number_or_a_value_error(text):
    for read in (MASS.read, PSD.read, RATIO.read, any_quantity, lambda t: with_prefix(t, LOAD)):
        try:
            assert 0.0 <= abs(read(text)) <= 1e50
        except ValueError as error:
            assert "must be" in str(error)


@pytest.mark.parametrize(
    ("text", "value"), [("1k", 1e3), ("10M", 1e7), ("2 Meg", 2e6), ("1 Mohm", 1e6), ("3e4", 3e4), (".5", 0.5)]
)
def test_command_line_numbers(text, value):
    assert with_prefix(text, LOAD) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", ["", "k", "1 Q", "-1k", "0", "1 nF", "nan"])
def test_what_is_no_command_line_number(text):
    with pytest.raises(ValueError, match="must be a load resistance"):
        with_prefix(text, LOAD)


@pytest.mark.parametrize(("text", "value"), [("10 uF", 1e-5), ("10u", 1e-5), (5, 5.0), ("1 Mohm", 1e6), ("-2 V", -2.0)])
def test_any_quantity(text, value):
    assert any_quantity(text) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("kind", "must"),
    [
        (RATIO, "be a ratio, such as 0.96, between 0 and 1"),
        (PSD, "be a density, such as '0.01 g^2/Hz', at least 0"),
        (MASS, "be a mass (kg), such as '40 g', above 0"),
    ],
)
def test_must_tells_the_range(kind, must):
    assert kind.must == must


def test_usual_units_are_those_of_pint():
    """The short way and pint's agree; 1m of a gap is a metre, of a resistance a milliohm."""
    for (text, unit), factor in USUAL_UNITS.items():
        assert factor_by_pint(text, unit) == pytest.approx(factor, rel=1e-15, abs=0.0), text
    assert read_value("stop.gap", "1m") == read_value("stop.gap", "1 m") == 1.0
    assert read_value("stop.gap", "1mm") == read_value("load.resistance", "1m") == 1e-3
