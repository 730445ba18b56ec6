"""A linear oscillator at a rigid stop under a harmonic excitation: period-one orbits in closed form
(Shaw and Holmes 1983).

    x'' + x = F cos(Omega t + phi),   x'+ = -r x'-  at x = 0,   one impact, of speed v, in T = 2 pi/Omega

With C = cos T, S = sin T: x = a (cos t + (1 - C)/S sin t) + P cos(Omega t + phi), P = F/(1 -
Omega^2), a = -P cos phi, tan phi = -(1 - C)(1 - r)/(S (1 + r) Omega), and v = 2 a (1 - C)/(S (1 +
r)).  The Poincare map of small differences has the determinant r^2 and the trace -2 r C - (1 + r)^2
(Omega^2 - 1)(1 + C)/2; the period doubles at 1 + trace + r^2 = 0.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.trace import trace
from tests.support.systems import changed, scene, z

pytestmark = pytest.mark.slow

R, F = 0.7, 0.8


def driven(frequency, **others):
    return Equations(restitution=R, drive=F, drive_frequency=frequency, **others)


def orbit(frequency):
    """(phase, speed) of the impact."""
    T = 2 * math.pi / frequency
    C, S = math.cos(T), math.sin(T)
    phase = math.atan(-(1 - C) * (1 - R) / (S * (1 + R) * frequency))
    speed = -2 * F / (1 - frequency**2) * math.cos(phase) * (1 - C) / (S * (1 + R))
    return (phase, speed) if speed > 0 else (phase + math.pi, -speed)


def doubling(frequency):
    """1 + trace + determinant of the Poincare map."""
    C = math.cos(2 * math.pi / frequency)
    return 1 + R * R - 2 * R * C - (1 + R) ** 2 * (frequency**2 - 1) * (1 + C) / 2


LIMIT = brentq(doubling, 2.0, 3.0)


def last_impacts(eqs, steps, count, periods=400, start=None):
    """Phase of the excitation, as a complex number of size 1, and speed of the last impacts."""
    h = 2 * math.pi / eqs.drive_frequency / steps
    impacts = trace(eqs, np.zeros(periods * steps), h, start=start).impacts[-count:]
    return np.column_stack([np.exp(1j * eqs.drive_frequency * impacts[:, 0]), impacts[:, 1]])


@pytest.mark.parametrize("frequency", [1.95, 2.05, 2.15])
def test_period_one_orbit(frequency):
    """Phase and speed of every impact, of second order in h."""
    errors = []
    for steps in (60, 120, 240, 480):
        found = last_impacts(driven(frequency), steps, 8)
        assert np.abs(found - found[0]).max() < 1e-8
        phase, speed = orbit(frequency)
        errors.append(np.abs(found[-1] - [np.exp(1j * phase), speed]).max())
    assert np.polyfit(np.log([60, 120, 240, 480]), np.log(errors), 1)[0] < -1.8
    assert errors[-1] < 2e-4


def on_the_orbit(frequency, off, steps=400, periods=1200):
    """Speeds of the last eight impacts of a mass that begins on the orbit, faster by a part ``off``, less its speed."""
    phase, speed = orbit(frequency)
    h = 2 * math.pi / frequency / steps
    shaking = F * np.cos(frequency * h * np.arange(periods * steps + 1) + phase)
    start = (0.0, R * speed * (1 + off), 0.0)
    return (
        trace(
            driven(frequency), np.zeros(periods * steps), h, start=start, shaking=shaking
        ).impacts[-8:, 1]
        - speed
    )


def test_stability_limit():
    """A disturbed orbit comes back below the frequency of the closed form; above, impacts alternate.

    Their difference grows like the square root of the distance from there (a pitchfork of the
    twofold map).
    """
    assert 2.1 < LIMIT < 2.9
    for off in (0.005, 0.05, 0.2):
        assert np.abs(on_the_orbit(LIMIT - off, 1e-3)).max() < 2e-5
    doubled = [np.ptp(on_the_orbit(LIMIT + off, 1e-3)) for off in (0.005, 0.02)]
    assert doubled[0] > 0.002
    assert doubled[1] / doubled[0] == pytest.approx(2.0, rel=0.15)
    speeds = on_the_orbit(LIMIT + 0.02, 1e-3)
    assert speeds[::2] == pytest.approx(speeds[0], abs=1e-6)
    assert speeds[1::2] == pytest.approx(speeds[1], abs=1e-6)


@pytest.mark.thorough("test_period_one_orbit")
def test_ensemble_finds_the_orbit():
    """One impact in a period from every start, and the loss of one of that speed, within twice the step's bias."""
    frequency = 2.1
    many = Trajectories(driven(frequency), 64, np.random.SeedSequence(1), 0.01)
    many.run(2000.0)
    moments = many.run(100.0)
    loss = 0.5 * (1 - R * R) * orbit(frequency)[1] ** 2 * frequency / (2 * math.pi)
    assert moments.impacts == pytest.approx(frequency / (2 * math.pi), rel=1e-9)
    assert moments.impact_loss == pytest.approx(loss, rel=1e-3)
    # the work of a kick in whose step an impact falls is off by O(h)
    assert abs(z(moments.mean("driven"), loss)) < 4
    assert moments.driven == pytest.approx(loss, rel=0.01)


@pytest.mark.thorough("test_period_one_orbit")
@pytest.mark.parametrize("r", [0.0, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("gap", [0.0, 0.6, -0.3])
@pytest.mark.parametrize("beta", [None, 1.25])
def test_grazing_chatter_and_sticking(r, gap, beta):
    """Amplitudes just below, at and above the stop, at frequencies with chatter: finite, and on the right side."""
    for frequency in (0.3, 0.7, 1.4, 3.1):
        rest = abs(1.0 / (1.0 - frequency**2 + 0.1j * frequency))
        for share in (0.999, 1.0, 1.001, 3.0):
            eqs = Equations(c1=-0.1, restitution=r, gap=gap or None, drive=share * abs(gap or 0.3) / rest,
                            drive_frequency=frequency, beta=beta, mu=None if beta is None else 0.5)  # fmt: skip
            path = trace(eqs, np.zeros(8000), 0.02)
            assert np.isfinite(path.samples).all()
            assert path.x.min() >= -gap
            assert abs(path.x).max() < 60.0


def test_mass_sticks_until_the_drive_frees_it():
    """r = 0: after an impact under a force on to the stop it lies there until the force turns, and then flies.

    With Omega = 1/2: free at the time where F cos(t/2) turns positive, x = a cos s + b sin s + P
    cos(Omega s + phi).
    """
    frequency = 0.5
    eqs = changed(driven(frequency), restitution=0.0)
    steps = 4000
    h = 2 * math.pi / frequency / steps
    path = trace(eqs, np.zeros(6 * steps), h)
    lying = path.x[-2 * steps :] == 0.0
    phase = (frequency * path.t[-2 * steps :]) % (2 * math.pi)
    freed = phase[1:][lying[:-1] & ~lying[1:]]
    assert freed == pytest.approx(1.5 * math.pi, abs=2 * frequency * h)
    late = path.impacts[:, 0] > 4 * steps * h
    # in a period one, and a touch of 1e-9 as it comes to rest; lying there is none
    assert late.sum() == 4
    s = np.linspace(0, 3, 31)
    P = F / (1 - frequency**2)
    phi = -math.pi / 2
    exact = (
        -P * math.cos(phi) * np.cos(s)
        + P * frequency * math.sin(phi) * np.sin(s)
        + P * np.cos(frequency * s + phi)
    )
    start = 5 * 2 * math.pi / frequency - math.pi / 2 / frequency
    assert np.interp(start + s, path.t, path.x) == pytest.approx(exact, abs=1e-4)


@pytest.mark.thorough("test_period_one_orbit")
@pytest.mark.parametrize(
    "more", [{}, {"beta": 0.3, "mu": 0.5}, {"gap": 0.4}, {"gap": 0.2, "opposite_gap": 0.5}]
)
def test_path_converges_at_second_order(more):
    """x at fixed times over some impacts, against a path of a step 16 times finer."""
    eqs = Equations(
        **{"c1": -0.05, "restitution": 0.8, "drive": 1.0, "drive_frequency": 1.7, **more}
    )
    if "opposite_gap" in more:
        eqs = changed(eqs, opposite_restitution=0.6)
    ends = []
    for parts in (20, 40, 80, 160, 1280):
        path = trace(eqs, np.zeros(16 * parts), 1.0 / parts, stride=parts, start=(0.1, 0.0, 0.0))
        ends.append(path.samples[:, 0])
    errors = [np.abs(x - ends[-1]).mean() for x in ends[:-1]]
    assert np.polyfit(np.log([20, 40, 80, 160]), np.log(errors), 1)[0] < -1.7
    assert errors[-1] < 1e-3


@pytest.mark.thorough("test_chaos_and_a_subharmonic_are_named")
def test_chaotic_response_is_told():
    """Beyond the cascade trajectories differ, and the engine states so."""
    eqs = changed(driven(2.8), c1=-0.02, beta=0.01, mu=1.0)
    answer = hv.Ensemble(trajectories=128, duration=200.0).run(scene(eqs))
    assert any("a chaotic one" in str(one) for one in answer.warnings)
