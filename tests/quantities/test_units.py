"""Numbers with units: right dimension, right size, and nothing but ValueError for anything else."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import harvester as hv
from harvester.quantities.kinds import (
    ACCELERATION,
    CAPACITANCE,
    FREQUENCY,
    Kind,
    any_quantity,
    with_prefix,
)
from harvester.quantities.units import USUAL_UNITS, factor_by_pint
from harvester.scene.keys import read_value

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
        (PSD, "0.01 g2/Hz", 0.01 * G**2),
        (PSD, "0.01 G^2/Hz", 0.01 * G**2),
        (PSD, "10 mg/rtHz", (0.01 * G) ** 2),
        (PSD, "100 µg/√Hz", (1e-4 * G) ** 2),
        (PSD, "0.1 m/s^2/sqrt(Hz)", 0.01),
        (LOAD, "470k", 470e3),
        (LOAD, "10K", 10e3),
        (LOAD, "1Meg", 1e6),
        (LOAD, "1 MegOhm", 1e6),
        (LOAD, "1 MOhm", 1e6),
        (LOAD, "1 kOhm", 1e3),
        (LOAD, "4k7", 4700.0),
        (LOAD, "4R7", 4.7),
        (CAPACITANCE, "50 nf", 50e-9),
        (CAPACITANCE, "2n2", 2.2e-9),
        (FREQUENCY, "3.2hz", 3.2),
        (RATIO, "2.7%", 0.027),
        (ACCELERATION, "5 mg", 0.005 * G),
        (ACCELERATION, "0.1G", 0.1 * G),
    ],
)
def test_read(kind, text, value):
    assert kind.read(text) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    "bad",
    [
        *(True, None, [1.0], {}, 0.0, -1.0, float("nan"), float("inf"), 10**400, 1e-51, 1e51),
        *(
            "",
            "40",
            "g",
            "40 s",
            "-1 g",
            "nan kg",
            "1e999 kg",
            "1e99 kg",
            "5 5 kg",
            "1 kg kg",
            "1 kg\nkg",
            "1 kg/0",
        ),
        *("1 (", "1 )", "1 %", "1 degC", "1 kg^degC", "1 lambda", "1 __import__('os')"),
    ],
)
def test_what_is_no_mass(bad):
    with pytest.raises(ValueError, match="must be a mass"):
        MASS.read(bad)


@pytest.mark.parametrize(
    ("kind", "text", "why"),
    [
        (LOAD, "1 kOm", "the unit 'kOm' was not understood"),
        (LOAD, "5 kg", "the unit 'kg' is one of another quantity"),
        (LOAD, "about 5", "a text must begin with a number"),
        (
            LOAD,
            "40",
            "it has no unit: write the number without quotation marks for ohm, or add the unit",
        ),
        (CAPACITANCE, "5,2 nF", "the decimal sign must be a point"),
        (RATIO, "0.5 kg", "'kg' after the number was not understood, for it has no unit"),
    ],
)
def test_an_error_says_which_part_was_not_understood(kind, text, why):
    with pytest.raises(ValueError, match="must be") as caught:
        kind.read(text)
    assert caught.value.why == why


def test_percent_is_exact():
    """It is in the scene file that `harvester new` writes."""
    assert RATIO.read("2.7%") == 0.027


def test_a_root_of_a_density_keeps_its_sign():
    """The square of a negative number is above 0, and would be accepted."""
    with pytest.raises(ValueError, match="at least 0"):
        PSD.read("-1 mg/rtHz")


@pytest.mark.parametrize(
    ("kind", "text"),
    [(MASS, "40 g rad"), (FREQUENCY, "3 rad^2/s"), (FREQUENCY, "3 Hz/rad"), (PSD, "1 g^2 rad/Hz")],
)
def test_angles_elsewhere_are_no_units(kind, text):
    with pytest.raises(ValueError, match="must be a"):
        kind.read(text)


@pytest.mark.parametrize(
    "slow",
    [
        "1 kg^9^9^9^9",
        "1 kg*9^9^9^9",
        "1 kg**9**9**9",
        "1 kg²^9^9",
        "1 x" + " " * 50_000 + "y",
        "1" * 50_000,
    ],
)
def test_what_would_take_for_ever(slow):
    """Towers of powers and quadratic matching: seconds to hours without their guards (the suite would hang)."""
    with pytest.raises(ValueError, match="must be a mass"):
        MASS.read(slow)


@pytest.mark.slow
@settings(deadline=None, max_examples=300, derandomize=True)
@given(
    st.text(max_size=30)
    | st.text("0123456789.eE+-*/^() gkmsHzµΩ²_%°\n", max_size=30).map("1".__add__)
)
def test_any_text_is_a_number_or_a_value_error(text):
    for read in (MASS.read, PSD.read, RATIO.read, any_quantity, lambda t: with_prefix(t, LOAD)):
        try:
            assert 0.0 <= abs(read(text)) <= 1e50
        except ValueError as error:
            assert "must be" in str(error)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1k", 1e3), ("10M", 1e7), ("2 Meg", 2e6), ("1 Mohm", 1e6), ("3e4", 3e4), (".5", 0.5)],
)
def test_command_line_numbers(text, value):
    assert with_prefix(text, LOAD) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", ["", "k", "1 Q", "-1k", "0", "1 nF", "nan"])
def test_what_is_no_command_line_number(text):
    with pytest.raises(ValueError, match="must be a load resistance"):
        with_prefix(text, LOAD)


@pytest.mark.parametrize(
    ("text", "value"), [("10 uF", 1e-5), ("10u", 1e-5), (5, 5.0), ("1 Mohm", 1e6), ("-2 V", -2.0)]
)
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


def test_times_with_a_unit(harvester, tmp_path):
    """--dt 1ms is a thousandth of a second; in a nondimensional scene no time has a unit, nor is mu's table needed."""
    assert hv.Ensemble(dt="1ms").dt == hv.Ensemble(dt="0.001").dt == 1e-3
    with pytest.raises(
        hv.InputError,
        match=r"`dt` must be a time .*, but is '1 kg': the unit 'kg' is not a unit of time",
    ):
        hv.Ensemble(dt="1 kg")
    path = tmp_path / "a.toml"
    path.write_text("nondimensional = { c1 = -0.1, beta = 0.05, mu = 1.0, D11 = 0.01 }")
    _, _, err = harvester("run", path, "--engine", "ensemble", "--dt", "1ms")
    assert (
        "--dt must be a number without a unit, in 1/w0, for a nondimensional scene, but is 0.001 s"
        in err
    )
    assert (
        harvester(
            "sweep", path, "--vary", "mu=0.5,2", "--engine", "exact", "--out", tmp_path / "out"
        )[0]
        == 0
    )
    assert (tmp_path / "out" / "sweep.csv").read_text().startswith("nondimensional.mu,")
