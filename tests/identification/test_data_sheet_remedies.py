"""Refusals and notes of `identify` on a data sheet name what was given, and a remedy that works when it is typed."""

import shlex

import pytest

import harvester as hv

SHEET = {"frequency": "60 Hz", "capacitance": "30 nF", "open_circuit_voltage": "15 V at 0.25 g"}


@pytest.mark.parametrize(
    "points, prior",
    [
        (["frequency"], "bulk"),
        (SHEET | {"open_circuit_voltage": 15.0}, "bulk"),
        (SHEET, None),
        (SHEET, 3),
    ],
)
def test_arguments_of_another_type(points, prior):
    with pytest.raises(hv.InputError, match="must be"):
        hv.identify(known={"mass": 4e-3}, points=points, prior=prior)


VOLTS, WATTS = (
    {"open_circuit_voltage": "15 V at 0.25 g"},
    {"power_at_load": "0.2 mW at 90k, 0.25 g"},
)
BOTH = {"frequency": "60 Hz", "open_circuit_frequency": "62 Hz"}
SHORT, OPENED = {"frequency": "60 Hz"}, {"open_circuit_frequency": "62 Hz"}
MASS = "give the mass in `known`"


@pytest.mark.parametrize(
    "known, points, remedy, works",
    [
        ({"mass": "4 g"}, SHORT,
         "add one of `open_circuit_voltage`, `power_at_load`, `open_circuit_frequency`", OPENED),
        ({"mass": "4 g"}, OPENED,
         "add one of `open_circuit_voltage`, `power_at_load`, `frequency`", SHORT),
        ({}, BOTH, f"{MASS}, or add one of `open_circuit_voltage`, `power_at_load`", VOLTS),
        ({}, SHORT | VOLTS, f"{MASS}, or add one of `power_at_load`, `open_circuit_frequency`",
         OPENED),
        ({}, SHORT, f"{MASS} and add one of `open_circuit_voltage`, `power_at_load`, "
         "`open_circuit_frequency`, or add two of `open_circuit_voltage`, `power_at_load`, "
         "`open_circuit_frequency`", OPENED | WATTS),
    ],
)  # fmt: skip
def test_the_remedy_for_too_few_points_works(known, points, remedy, works):
    capacitance = {"capacitance": "30 nF"}
    with pytest.raises(hv.InputError) as refused:
        hv.identify(known=known, points=points | capacitance)
    assert str(refused.value).endswith(f"they do not: {remedy}")
    assert hv.identify(known=known, points=points | capacitance | works).parameters


def test_two_resonances_determine_no_mass():
    """A file with the coupling leaves the mass open, and two resonances do not change that."""
    with pytest.raises(hv.InputError, match="points must determine the mass"):
        hv.identify("examples/bench_impedance.csv", points=BOTH)


def test_the_prior_of_the_damping_is_not_blamed(harvester):
    """The line names the numbers that were given: options of the command, and no --points."""
    status, _, err = harvester(
        "identify", "--frequency", "60 Hz", "--capacitance", "30 nF", "--known", "mass=4 g",
        "--power-at-load", "100 mW at 100 kohm and 0.25 g",
    )  # fmt: skip
    assert status == 2 and "--frequency, --capacitance, --power-at-load must be possible" in err
    assert "--points" not in err and "prior" not in err


def test_a_power_below_that_of_each_coupling_states_the_range(harvester, tmp_path):
    """A picowatt is possible, at a coupling below those that are sought."""
    status, _, err = harvester(
        "new", tmp_path / "a.toml", "--mass", "4 g", "--frequency", "60 Hz", "--q", "60",
        "--capacitance", "30 nF", "--power-at-load", "1 pW at 15 kohm and 0.25 g",
    )  # fmt: skip
    assert status == 2 and "no --coupling (theta^2/(K Cp) from 1e-08 to 10) gives '1 pW" in err


def test_a_known_mass_is_not_asked_for(harvester, tmp_path):
    path = tmp_path / "open.toml"
    status, out, _ = harvester(
        "identify", "--frequency", "60 Hz", "--capacitance", "30 nF", "--known", "mass=4 g",
        "--q", "50", "--power-at-load", "1 mW at 100 kohm and 0.25 g", "--out", path,
    )  # fmt: skip
    assert status == 0 and "piezo.coupling: these data do not determine it" in out
    assert "the scene file is not complete" in out
    assert "--known mass" not in out + path.read_text()


def test_a_scene_without_mass_has_a_command_that_works(harvester, tmp_path):
    path = tmp_path / "open.toml"
    file = "examples/bench_impedance.csv"
    status, out, _ = harvester("identify", file, "--known", "damping_ratio=0.01", "--out", path)
    assert status == 0
    [line] = [line for line in out.splitlines() if "with a known mass: " in line]
    typed = shlex.split(line.partition("with a known mass: ")[2])
    assert typed[:4] == ["harvester", "identify", file, "--known"]
    assert typed[4:] == ["damping_ratio=0.01", "--known", "mass=12 g", "--out", "..."]
    status, out, _ = harvester(*typed[1:-1], tmp_path / "whole.toml")
    assert status == 0 and "next: harvester run" in out


def test_the_command_has_the_options_that_were_given():
    from harvester.commands.identify import typed

    words = typed(["a b.csv@short"], {"open_circuit_voltage": "9 V at 1 g"}, "film", ["gap=1 mm"])
    assert shlex.split(words) == [
        "a b.csv@short", "--open-circuit-voltage", "9 V at 1 g", "--known", "gap=1 mm",
        "--prior", "film",
    ]  # fmt: skip


@pytest.mark.parametrize("q", ["1.8", "150000"])
def test_a_stated_quality_factor_has_no_limits(q):
    """The limits of a fit are those of numbers that nothing states."""
    points = {"frequency": "60 Hz", "capacitance": "30 nF", "open_circuit_frequency": "62 Hz"}
    found = hv.identify(known={"mass": "4 g"}, points=points | {"q": q})
    assert found["quality_factor"].value == pytest.approx(float(q), rel=0.01)


def test_a_coupling_at_its_least_with_a_known_mass_asks_for_the_numbers():
    points = {
        "frequency": "60 Hz",
        "capacitance": "30 nF",
        "open_circuit_voltage": "1 uV at 0.25 g",
    }
    with pytest.raises(hv.InputError, match="ends at its least, 1e-08: check the units"):
        hv.identify(known={"mass": "4 g"}, points=points)
