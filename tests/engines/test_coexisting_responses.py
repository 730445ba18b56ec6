"""Several responses to one steady excitation: found from many starts, named, each with its own
mean."""

import importlib
import math
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv
from harvester.engines.coexisting_responses import may_have_several
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.studies.sweep.rows import SweepRow
from harvester.studies.sweep.sweep_table import SweepTable
from tests.support.bimorph import bimorph
from tests.support.paths import ROOT
from tests.support.systems import DRIVEN, scene

sys.path.append(str(ROOT / "benchmarks"))
products = importlib.import_module("products")

FREQUENCY = 0.127324
LOAD = 200.0
CAPACITANCE = 0.1
COUPLING = 0.05


def beam(amplitude: float) -> hv.Scene:
    """The bistable beam of Erturk, Hoffmann and Inman (Appl. Phys. Lett. 94, 254102, 2009) in its own units."""
    return hv.Scene(
        oscillator=hv.Oscillator(mass=1.0, stiffness=-0.5, cubic_stiffness=0.5, damping=0.02),
        piezo=hv.Piezo(coupling=COUPLING, capacitance=CAPACITANCE),
        excitation=hv.Excitation(acceleration_amplitude=amplitude, frequency=FREQUENCY),
        load=hv.Load(resistance=LOAD),
    )


def integrated(amplitude: float, start: tuple[float, float]) -> tuple[float, float]:
    """Mean power (W) over the last ten of 150 periods, and the mean of x there, by Dormand and Prince's method."""
    w = 2.0 * math.pi * FREQUENCY

    def rate(t, y):
        x, v, voltage, _, _ = y
        force = 0.5 * x - 0.5 * x**3 - 0.02 * v - COUPLING * voltage - amplitude * math.cos(w * t)
        return v, force, (COUPLING * v - voltage / LOAD) / CAPACITANCE, voltage**2 / LOAD, x

    times = np.array([140.0, 150.0]) / FREQUENCY
    found = solve_ivp(
        rate, (0.0, times[1]), (*start, 0.0, 0.0, 0.0), "DOP853", times, rtol=1e-7, atol=1e-9
    )
    power, place = np.diff(found.y[3:], axis=1)[:, 0] / np.diff(times)
    return float(power), float(place)


@pytest.mark.slow
def test_a_bistable_beam_has_three():
    """In either well, and from well to well; the third has 94 times the power."""
    inner, outer = integrated(0.06, (1.0, 0.0)), integrated(0.06, (2.0, 0.0))
    assert inner[1] > 0.5 and abs(outer[1]) < 0.01
    answer = hv.Ensemble().run(beam(0.06))
    by_power = sorted(answer.responses, key=lambda one: one.mean_power.value)
    assert [one.periods for one in by_power] == [1, 1, 1]
    for one, (expected, _) in zip(by_power, (inner, inner, outer), strict=True):
        assert (
            abs(one.mean_power.value - expected)
            < 1.1 * one.mean_power.known_error95
            < 3e-3 * expected
        )
    assert sum(one.share_of_starts for one in by_power) == pytest.approx(1.0, abs=0.05)
    printed = answer.as_json()["responses"]
    assert [one["periods"] for one in printed] == [1, 1, 1] and all(
        one["mean_power"]["error95"] for one in printed
    )
    assert "  responses\n" in str(
        answer
    ) and "  mean power  error, 95 %  fraction of starts" in str(answer)
    row = SweepRow.answered(answer)
    assert row.responses == 3
    found = SweepTable((), (row, SweepRow.failed("ensemble", SimulationError("no"))))
    assert "ensemble: several responses to the excitation at 1 of 1 points, 3 at most: " in str(
        found
    )


@pytest.mark.slow
def test_chaos_and_a_subharmonic_are_named():
    """Published as chaos: other starts of the same drive come to a response of five periods, or of one."""
    found = hv.Ensemble().run(beam(0.095)).responses
    (chaos,) = (one for one in found if one.chaotic)
    # which falls: it lasts some thousand periods
    assert chaos.periods is None and chaos.share_of_starts > 0.15
    assert sorted(one.periods for one in found if one is not chaos) == [1, 5]
    power, _ = integrated(0.095, (2.0, 0.0))
    (single,) = (one.mean_power for one in found if one.periods == 1)
    assert abs(single.value - power) < single.known_error95 < 1e-3 * power


@pytest.mark.thorough("test_means_that_scatter_without_a_gap_are_one_response")
@pytest.mark.parametrize("netlist", ["series_sshi", "sece"])
def test_a_voltage_that_jumps_is_no_second_response(netlist):
    """Read at 16 places of each period, starts differed by a fifth, and a step of a 64th made three periods of one."""
    load = bimorph(
        'R = "100 kohm", C = "0.2 uF"',
        "0.4 g",
        "50 Hz",
        netlist,
        '[stop]\nrestitution = 0.8\ngap = "0.2 mm"',
    )
    answer = hv.Ideal(judged=False).run(hv.loads(load))
    (only,) = answer.responses
    assert only.periods == 1 and not any("trajectories" in str(one) for one in answer.warnings)
    assert (
        only.share_of_starts == 1.0 and only.mean_power.known_error95 < 2e-3 * only.mean_power.value
    )
    gap = abs(answer.mean_power.value - only.mean_power.value)
    assert (
        gap
        < answer.mean_power.known_error95 + only.mean_power.known_error95
        < 5e-3 * only.mean_power.value
    )


def test_a_linear_mass_is_not_searched():
    assert not may_have_several(Problem(scene(DRIVEN)))
    assert hv.Ensemble(trajectories=64).run(scene(DRIVEN)).responses == ()


@pytest.mark.ngspice
def test_ngspice_follows_each_of_three():
    """From well to well the voltage is near 0 where a period begins, beside which no response seemed to come back."""
    answer = hv.Spice().run(beam(0.06))
    assert any(
        "the excitation has 3 responses, and this is the one from rest" in str(one)
        for one in answer.warnings
    )
    assert answer.details["response_periods"] == 1
    powers = [integrated(0.06, start)[0] for start in ((1.0, 0.0), (1.0, 0.0), (2.0, 0.0))]
    by_power = sorted(answer.responses, key=lambda one: one.mean_power.value)
    for one, expected in zip(by_power, powers, strict=True):
        assert (one.engine, one.periods, one.note) == ("spice", 1, "")
        assert (
            abs(one.mean_power.value - expected)
            < one.mean_power.known_error95 + 2e-5 * expected
            < 3e-4 * expected
        )
    assert answer.mean_power in [one.mean_power for one in by_power[:2]]


@pytest.mark.thorough("test_ngspice_follows_each_of_three")
@pytest.mark.ngspice
@pytest.mark.slow
def test_ngspice_follows_a_subharmonic_beside_chaos():
    """Its power is known by Dormand and Prince's method to 1e-10, from a state that the search found."""
    answer = hv.Spice().run(beam(0.095))
    by_engine = sorted((one.engine, one.periods) for one in answer.responses)
    assert by_engine == [("ensemble", None), ("spice", 1), ("spice", 5)]
    (five,) = (one.mean_power for one in answer.responses if one.periods == 5)
    assert abs(five.value - 920.8986e-6) < five.known_error95 + 1e-10 < 1.2e-6 * five.value
    (chaos,) = (one for one in answer.responses if one.chaotic)
    assert chaos.note == "ngspice finds none near it that repeats"


@pytest.mark.thorough("test_ngspice_follows_each_of_three")
@pytest.mark.ngspice
def test_ngspice_follows_the_doubler_to_the_other_well(tmp_path):
    """Its powers in both wells are those of ngspice alone with the whole device (`benchmarks/folded_device.py`)."""
    answer = hv.Spice().run(products.scene_of("doubler", "harmonic", "bistable", tmp_path))
    ours, other = answer.responses
    assert ours.mean_power == answer.mean_power and other.engine == "spice"
    for one, expected in ((ours, 0.2996017e-3), (other, 0.2142132e-3)):
        assert (
            abs(one.mean_power.value - expected)
            < one.mean_power.known_error95 + 6e-9
            < 3e-4 * expected
        )


@pytest.mark.thorough("test_a_bistable_beam_has_three")
@pytest.mark.parametrize(("henries", "told"), [("2 H", True), ("0.05 H", False)])
def test_a_slow_switching_is_told(henries, told):
    """SECE at 50 Hz with its default inductor: 0.45 ms of 10 ms, and 5 % more power than in
    ngspice."""
    load = bimorph(
        f'R = "100 kohm", C = "0.2 uF", L = "{henries}"',
        "0.4 g",
        "50 Hz",
        "sece",
        '[stop]\nrestitution = 0.8\ngap = "0.2 mm"',
    )
    answer = hv.Ideal(trajectories=64, budget="5s").run(hv.loads(load))
    words = [str(one) for one in answer.warnings if "each inversion lasts" in str(one)]
    assert len(words) == told
    assert not told or words[0].startswith(
        "each inversion lasts 451.2 us, 0.045 of a half-period, but engine 'ideal'"
    )
