"""Frequency response: closed forms, branches and jumps, half-power bandwidth, files and errors."""

import csv
import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.cli import cli
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import scales
from harvester.errors import CannotServeError, InputError
from harvester.studies.frequency_response.curve import FrequencyResponse
from harvester.studies.frequency_response.point import ResponsePoint
from harvester.studies.frequency_response.response import draw, frequencies, response
from harvester.uncertainty.value import Value
from tests.support.systems import COLOURED, DRIVEN, changed, linear_v2, scene

pytestmark = pytest.mark.slow

PLATE = hv.load("examples/plate_harmonic.toml")
DUFFING = Equations(alpha=0.03, beta=0.01, mu=1.0, c1=-0.04, drive=0.2, drive_frequency=1.0)


@pytest.mark.thorough("test_physical_units")
def test_linear_response():
    """Up and down the same: in closed form, and from trajectories within 1.2 times the stated bias of the step.

    These have a cubic spring of no size.
    """
    sweep = np.linspace(0.6, 1.8, 13)
    closed = response(scene(DRIVEN), sweep)
    found = response(scene(changed(DRIVEN, alpha=1e-12)), sweep)
    for true, up, down in zip(
        closed.sweep("up"), found.sweep("up"), found.sweep("down"), strict=True
    ):
        exact = math.sqrt(linear_v2(changed(DRIVEN, drive_frequency=up.frequency)))
        assert true.voltage_rms.value == pytest.approx(exact, rel=1e-14)
        assert abs(up.voltage_rms.value - exact) < 1.2 * up.voltage_rms.bias + 1e-6 * exact
        assert true.voltage_rms.bias < 1e-9 * up.voltage_rms.bias < 1e-11 * exact
        assert down.voltage_rms.value == pytest.approx(up.voltage_rms.value, rel=1e-5)
        assert up.mean_power.value == pytest.approx(
            DRIVEN.beta * DRIVEN.mu * up.voltage_rms.value**2
        )
        assert (up.mean_power.stderr, true.mean_power.stderr) == (None, None)
    assert found.hysteresis == closed.hysteresis == []


def test_physical_units():
    """Volts and watts: v^2/R."""
    point = response(PLATE, [4.0, 4.5, 5.0]).sweep("up")[1]
    assert point.mean_power.value == pytest.approx(point.voltage_rms.value**2 / 1e6)
    assert point.mean_power.value == pytest.approx(
        hv.Ensemble(trajectories=64).run(PLATE).mean_power.value, rel=1e-3
    )


def amplitudes(eqs):
    """Harmonic balance: real roots X^2 of F^2 = X^2 ((1 + 3/4 alpha X^2 + k - W^2)^2 + (c W)^2), ascending.

    The electric side adds stiffness k and damping: beta s/(s + mu).
    """
    s = 1j * eqs.drive_frequency
    load = eqs.beta * s / (s + eqs.mu)
    k = 1.0 - eqs.drive_frequency**2 + load.real
    c = -eqs.c1 * eqs.drive_frequency + load.imag
    a = 0.75 * eqs.alpha
    roots = np.roots([a * a, 2 * a * k, k * k + c * c, -(eqs.drive**2)])
    return np.sort(roots.real[np.abs(roots.imag) < 1e-9])


@pytest.mark.thorough("test_physical_units")
def test_hardening_spring_jumps_where_harmonic_balance_says():
    """The upper branch upwards, the lower one downwards, a jump at either fold."""
    sweep = np.arange(1.0, 1.3, 0.01)
    found = response(scene(DUFFING), sweep)
    many = [len(amplitudes(changed(DUFFING, drive_frequency=f))) == 3 for f in sweep]
    fold = sweep[many]
    assert len(fold) > 5
    for direction, branch in (("up", -1), ("down", 0)):
        for p in found.sweep(direction):
            roots = amplitudes(changed(DUFFING, drive_frequency=p.frequency))
            s = 1j * p.frequency
            exact = [abs(s / (s + DUFFING.mu)) ** 2 * x2 / 2 for x2 in roots]
            near = abs(p.frequency - fold[0]) < 0.011 or abs(p.frequency - fold[-1]) < 0.021
            if not near:
                assert p.mean_square_voltage.value == pytest.approx(exact[branch], rel=0.05)
    assert fold[0] < np.mean(found.hysteresis) < fold[-1]
    assert len(found.hysteresis) == pytest.approx(len(fold), abs=2)
    assert "hysteresis" in str(found)


@pytest.mark.thorough("test_physical_units")
def test_stop_at_a_distance_hardens():
    """An impacting device follows the upper branch further up than down."""
    eqs = Equations(
        beta=0.01, mu=1.0, c1=-0.05, restitution=0.9, gap=1.0, drive=0.1, drive_frequency=1.0
    )
    found = response(scene(eqs), np.linspace(0.9, 1.4, 6))
    assert found.hysteresis
    assert min(found.hysteresis) > 1.0
    up, down = found.peak("up"), found.peak("down")
    assert up.frequency > down.frequency
    assert up.mean_power.value > down.mean_power.value


@pytest.mark.thorough("test_physical_units")
def test_noise_beside_the_drive_has_a_sampling_error():
    found = response(scene(changed(DRIVEN, alpha=1e-12, n1=0.01)), [0.9, 1.0, 1.1])
    assert all(p.mean_power.stderr > 0.0 for p in found.points)


def triangle(powers):
    points = [ResponsePoint("up", float(k), Value(p), Value(p), 0.0) for k, p in enumerate(powers)]
    return FrequencyResponse(tuple(points), True)


@pytest.mark.parametrize(
    "powers, width",
    [
        ([0, 1, 2, 3, 4, 3, 2, 1, 0], 4.0),
        ([0, 4, 0], 1.0),
        ([0, 1, 4, 3, 1], 3.5 - 4.0 / 3.0),
        ([3, 4, 3, 1], None),
        ([1, 2, 3, 4], None),
        ([4, 2, 1], None),
    ],
)
def test_half_power_bandwidth(powers, width):
    """Linear between points; None if the half is not to both sides of the peak."""
    assert triangle(powers).bandwidth("up") == (width if width is None else pytest.approx(width))


@pytest.mark.thorough("test_physical_units")
def test_bandwidth_of_a_weakly_coupled_resonance():
    """2 zeta f0: that of the power, near c for a light damping."""
    eqs = Equations(beta=1e-4, mu=1.0, c1=-0.02, drive=1.0, drive_frequency=1.0)
    found = response(scene(eqs), np.linspace(0.97, 1.03, 61))
    assert found.bandwidth("up") == pytest.approx(0.02, rel=0.02)


@pytest.mark.thorough("test_physical_units")
def test_a_peak_between_the_frequencies_of_the_sweep():
    """In closed form the answer has the true peak and half-power points, however coarse the sweep is."""
    eqs = Equations(beta=1e-4, mu=1.0, c1=-0.02, drive=1.0, drive_frequency=1.0)
    fine = response(scene(eqs), np.linspace(0.985, 1.015, 3001))
    coarse = response(scene(eqs), "0.73:1.24:5")
    true, found = fine.peak("up"), coarse.peak("up")
    assert found.frequency == pytest.approx(true.frequency, abs=1.1e-5)
    assert found.mean_power.value == pytest.approx(true.mean_power.value, rel=1e-6)
    assert coarse.bandwidth("up") == pytest.approx(fine.bandwidth("up"), rel=1e-4)
    assert "best of the sweep" not in str(coarse)


@pytest.mark.thorough("test_physical_units")
def test_where_the_true_peak_may_be():
    """A peak that was not sought between the frequencies states so, and one at an end of the sweep."""
    found = response(scene(DRIVEN), [0.9, 1.0, 1.1, 1.3])
    place = [p.frequency for p in found.sweep("up")].index(found.peak("up").frequency)
    assert 0 < place < 3 and "the best of the sweep (the true one lies between" in str(found)
    assert (
        str(response(scene(DRIVEN), "2:4:3")).count(
            "an end of the sweep (a higher one may lie beyond)"
        )
        == 2
    )


def test_files(tmp_path):
    (found,) = draw(PLATE, "3Hz:6Hz:4", tmp_path).curves
    with (tmp_path / "response.csv").open() as file:
        rows = list(csv.DictReader(file))
    shown = [float(row["frequency (Hz)"]) for row in rows if row["direction"] == "up"]
    # and the peak with its half-power points
    assert shown == sorted(shown) and {3, 4, 5, 6} < set(shown)
    assert [float(row["frequency (Hz)"]) for row in rows] == [*shown, *shown[::-1]]
    assert float(rows[1]["mean_power (W)"]) == pytest.approx(found.sweep("up")[1].mean_power.value)
    assert rows[0]["mean_power_stderr (W)"] == ""
    assert (tmp_path / "response.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "provenance.json").read_text())["sweep"] == [3, 4, 5, 6]


def test_command(tmp_path):
    arguments = [
        "response",
        "examples/plate_harmonic.toml",
        "--sweep",
        "3Hz:6Hz:4",
        "--out",
        str(tmp_path),
    ]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0
    assert "half-power bandwidth" in done.output
    answer = json.loads(CliRunner().invoke(cli, [*arguments, "--json"]).output)
    assert len(answer["sweeps"]["up"]["points"]) > 4
    assert answer["hysteresis"] == []


@pytest.mark.parametrize("text", ["", "1Hz", "1Hz:2Hz", "1Hz:2Hz:2", "1Hz:2Hz:x", "1Hz:2Hz:100000"])
def test_bad_sweep_is_one_line(text):
    with pytest.raises(InputError, match=r"^`sweep` must be FROM:TO:COUNT"):
        frequencies(Problem(PLATE), text)


def test_refusals():
    with pytest.raises(InputError, match="`sweep` must be between two different frequencies"):
        frequencies(Problem(PLATE), "1Hz:1Hz:3")
    with pytest.raises(InputError, match=r"excitation\.frequency must be a frequency"):
        frequencies(Problem(PLATE), "1kg:2Hz:3")
    with pytest.raises(
        InputError,
        match="acceleration_amplitude must be given, above 0, for a frequency response, but is left out",
    ):
        response(hv.load("examples/plate.toml"), [1.0, 2.0, 3.0])
    with pytest.raises(
        CannotServeError, match="cannot model coloured noise: use engine 'ensemble'"
    ):
        response(scene(COLOURED), [1.0, 2.0, 3.0])
    with pytest.raises(
        CannotServeError, match="is netlist 'bridge': use engine 'spice', or 'ideal'"
    ):
        response(PLATE.with_load(hv.Load(netlist="bridge")), [1.0, 2.0, 3.0], engine="ensemble")
    with pytest.raises(
        CannotServeError,
        match="'averaged' has no frequency response, as its formulas are for noise",
    ):
        response(PLATE, [1.0, 2.0, 3.0], engine="averaged")
    assert scales(PLATE).length == pytest.approx(0.01 * 9.80665 / 400.0)
