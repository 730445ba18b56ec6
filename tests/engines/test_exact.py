"""What `exact` states of the motion next to the power, against an integration of the equations."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv
from tests.support.systems import BEAM, SECOND, THIRD

NGSPICE = [pytest.mark.ngspice, pytest.mark.thorough("test_amplitudes_of_engines_that_step")]
DRIVEN = {"c1": -0.2, "beta": 0.4, "mu": 0.7, "drive": 0.3, "drive_frequency": 1.1}


def test_the_amplitudes_under_a_sinusoid_are_those_of_an_integration():
    scene = hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN))
    answer = hv.Exact().run(scene)
    period = 2.0 * math.pi / DRIVEN["drive_frequency"]

    def slope(t, y):
        x, speed, voltage = y
        force = DRIVEN["drive"] * math.cos(DRIVEN["drive_frequency"] * t)
        return (
            speed,
            force + DRIVEN["c1"] * speed - x - DRIVEN["beta"] * voltage,
            speed - DRIVEN["mu"] * voltage,
        )

    times = np.linspace(60.0 * period, 61.0 * period, 2001)
    path = solve_ivp(
        slope, (0.0, times[-1]), (0.0, 0.0, 0.0), "DOP853", times, rtol=1e-10, atol=1e-12
    ).y
    details = answer.details
    assert math.isclose(details["displacement_amplitude"], np.abs(path[0]).max(), rel_tol=1e-5)
    assert math.isclose(details["voltage_amplitude"], np.abs(path[2]).max(), rel_tol=1e-5)
    biases = {details[name] for name in details if name.endswith("_bias")}
    assert biases == {0.0}
    assert math.isclose(
        details["displacement_rms"], math.sqrt(np.mean(path[0, :-1] ** 2)), rel_tol=1e-6
    )
    assert math.isclose(
        0.5 * details["voltage_amplitude"] ** 2, answer.mean_square_voltage.value, rel_tol=1e-12
    )


def test_random_shaking_has_an_rms_and_no_largest_value():
    noisy = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN, D11=0.01)))
    assert set(noisy.details) == {"displacement_rms", "displacement_rms_bias"}
    quiet = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN)))
    alone = {key: value for key, value in DRIVEN.items() if not key.startswith("drive")}
    noise = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**alone, D11=0.01)))
    squares = [one.details["displacement_rms"] ** 2 for one in (noisy, quiet, noise)]
    assert math.isclose(squares[0], squares[1] + squares[2], rel_tol=1e-12)


def integrated(alpha=0.0, restitution=1.0, gap=math.inf, settle=60):
    """The largest |x| and |V| of a period by DOP853 from impact to impact, after ``settle`` periods from rest."""
    period = 2.0 * math.pi / DRIVEN["drive_frequency"]

    def slope(t, y):
        x, speed, voltage = y
        force = DRIVEN["drive"] * math.cos(DRIVEN["drive_frequency"] * t)
        return (
            speed,
            force + DRIVEN["c1"] * speed - x - alpha * x**3 - DRIVEN["beta"] * voltage,
            speed - 0.7 * voltage,
        )

    def stop(_, y):
        return y[0] + gap if gap < math.inf else 1.0

    stop.terminal = True
    stop.direction = -1
    t = 0.0
    end = (settle + 1) * period
    y = (0.0, 0.0, 0.0)
    found = [0.0, 0.0]
    while t < end:
        leg = solve_ivp(
            slope, (t, end), y, "DOP853", events=stop, rtol=1e-10, atol=1e-12, dense_output=True
        )
        late = (
            np.linspace(max(t, settle * period), leg.t[-1], 4001)
            if leg.t[-1] > settle * period
            else []
        )
        if len(late):
            found = np.maximum(found, np.abs(leg.sol(late)[[0, 2]]).max(axis=1))
        t = leg.t[-1]
        y = leg.y[:, -1] * (1.0, -restitution if leg.status == 1 else 1.0, 1.0)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("scene", [{"alpha": 0.5}, {"restitution": 0.7, "gap": 0.3}])
@pytest.mark.parametrize("engine", [hv.Ensemble, pytest.param(hv.Spice, marks=NGSPICE)])
def test_amplitudes_of_engines_that_step(scene, engine):
    """They stated the RMS alone, or nothing; with a stop the voltage has a corner at its peak."""
    details = engine().run(hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN, **scene))).details
    for name, true in zip(
        ("displacement_amplitude", "voltage_amplitude"), integrated(**scene), strict=True
    ):
        assert abs(details[name] - true) <= details[f"{name}_bias"] < 0.01 * true
    assert details["displacement_rms_bias"] < 1e-3 * details["displacement_rms"]


@pytest.mark.slow
@pytest.mark.thorough("test_amplitudes_of_engines_that_step")
def test_amplitudes_of_several_modes():
    """The swing of the oscillator and the peak of the voltage are those of the complex amplitudes."""
    drive = hv.Excitation(acceleration_amplitude="0.5 g", frequency="50 Hz")
    scene = BEAM.replace(mode=(SECOND, THIRD), excitation=drive)
    stepped, true = (kind().run(scene).details for kind in (hv.Ensemble, hv.Exact))
    for name in ("displacement_rms", "displacement_amplitude", "voltage_amplitude"):
        # a kick is at most half of its interval from the largest value
        assert math.isclose(stepped[name], true[name], rel_tol=2e-5)
        assert stepped[f"{name}_bias"] < 1e-4 * true[name]


def test_chaos_and_several_responses_have_no_one_amplitude():
    """Two wells, between which the mass moves once and does not return."""
    wells = hv.Nondimensional(
        c1=-0.1, alpha=1.0, linear=-1.0, beta=0.01, mu=1.0, drive=0.35, drive_frequency=1.2
    )
    assert "displacement_amplitude" not in hv.Ensemble().run(hv.Scene(nondimensional=wells)).details
