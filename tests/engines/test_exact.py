"""What `exact` says of the motion beside the power, against an integration of the equations."""

import math

import numpy as np
from scipy.integrate import solve_ivp

import harvester as hv

DRIVEN = {"c1": -0.2, "beta": 0.4, "mu": 0.7, "drive": 0.3, "drive_frequency": 1.1}


def test_the_amplitudes_under_a_sinusoid_are_those_of_an_integration():
    scene = hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN))
    answer = hv.Exact().run(scene)
    period = 2.0 * math.pi / DRIVEN["drive_frequency"]

    def slope(t, y):
        x, speed, voltage = y
        force = DRIVEN["drive"] * math.cos(DRIVEN["drive_frequency"] * t)
        return speed, force + DRIVEN["c1"] * speed - x - DRIVEN["beta"] * voltage, speed - DRIVEN["mu"] * voltage

    times = np.linspace(60.0 * period, 61.0 * period, 2001)
    path = solve_ivp(slope, (0.0, times[-1]), (0.0, 0.0, 0.0), "DOP853", times, rtol=1e-10, atol=1e-12).y
    details = answer.details
    assert math.isclose(details["displacement_amplitude"], np.abs(path[0]).max(), rel_tol=1e-5)
    assert math.isclose(details["voltage_amplitude"], np.abs(path[2]).max(), rel_tol=1e-5)
    assert math.isclose(details["displacement_rms"], math.sqrt(np.mean(path[0, :-1] ** 2)), rel_tol=1e-6)
    assert math.isclose(0.5 * details["voltage_amplitude"] ** 2, answer.mean_square_voltage.value, rel_tol=1e-12)


def test_random_shaking_has_an_rms_and_no_largest_value():
    noisy = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN, D11=0.01)))
    assert set(noisy.details) == {"displacement_rms"}
    quiet = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**DRIVEN)))
    alone = {key: value for key, value in DRIVEN.items() if not key.startswith("drive")}
    noise = hv.Exact().run(hv.Scene(nondimensional=hv.Nondimensional(**alone, D11=0.01)))
    squares = [one.details["displacement_rms"] ** 2 for one in (noisy, quiet, noise)]
    assert math.isclose(squares[0], squares[1] + squares[2], rel_tol=1e-12)
