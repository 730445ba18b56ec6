"""A free ball in a box on the mass: energy and momentum, bounces in closed form, and exact flow between impacts."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes
from harvester.equations.problem import Problem
from harvester.linear.transfer import amplitudes
from harvester.mechanics.trace import trace
from tests.support.systems import BEAM, SECOND

TURN = 2.0 * math.pi
G = 9.80665
BALL = hv.Ball(mass="2 g", room="0.4 mm", restitution=0.7, tilt=30.0)
DRIVE = hv.Excitation(acceleration_amplitude="0.5 g", frequency="45 Hz")


def test_energy_and_momentum():
    """Without forces impacts dissipate what the kinetic energy loses, and leave the momentum, to rounding."""
    root = math.sqrt(0.2)
    r = 0.8
    modes = Modes((0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, root), (1.0, -1.0 / root), pull=0.0)
    ends = {"gap": 0.3, "opposite_restitution": r, "opposite_gap": 0.3}
    eqs = Equations(linear=1e-30, restitution=r, modes=modes, **ends)
    start = np.array([0.0, 0.0, -1.0, 0.3, 0.0])
    path = trace(eqs, np.zeros(600), 0.02, 100, start)
    speeds = path.coordinates[-1, 1]
    assert len(path.impacts) > 5
    assert 0.5 * (speeds**2).sum() + path.lost == pytest.approx(
        0.5 * (start[2:4] ** 2).sum(), rel=1e-9
    )
    assert speeds @ modes.base == pytest.approx(start[2:4] @ modes.base, rel=1e-9)
    places = path.coordinates[:, 0] @ modes.contact
    assert np.abs(places).max() <= 0.3 * (1.0 + 1e-9)


def test_a_ball_is_carried_where_it_and_its_box_are_shaken_alike():
    """What shakes them alike moves neither towards the other; so it is in every scene."""
    assert Problem(BEAM.replace(mode=(), ball=BALL)).equations.modes.is_carried
    other = Modes((0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 0.3), pull=0.0)
    assert not other.is_carried and not replace(other, base=(0.3, -1.0), pull=None).is_carried
    assert replace(other, base=(0.3, -1.0)).is_carried


@pytest.mark.thorough("test_energy_and_momentum")
def test_at_rest_the_oscillator_is_displaced_and_the_ball_amid_its_box():
    """With X and Z for the oscillator and the ball the contact's coordinate X - Z is 0."""
    modes = Modes((0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, -2.0), pull=0.0)
    y = modes.at_rest(np.array([0.3, -0.7]))
    assert y[0] == pytest.approx([0.3, -0.7])
    assert np.dot(modes.contact, y) == pytest.approx([0.0, 0.0], abs=1e-15)
    alone = replace(modes, pull=None).at_rest(0.3)
    assert alone == pytest.approx([0.3, 0.0])


def test_bounces_on_a_heavy_mass():
    """A light ball in an upright box falls, bounces ever lower at times in closed form, and comes to rest."""
    ball = hv.Ball(mass=1e-9, room="1 mm", restitution=0.6, tilt=90.0)
    scene = BEAM.replace(mode=(), ball=ball, excitation=None)
    problem = Problem(scene)
    h = 0.002
    w0 = problem.scales.frequency
    path = trace(problem.equations, np.zeros(30000), h, 100)
    speed = math.sqrt(G * ball.room)
    times = math.sqrt(ball.room / G) + 2.0 * speed / G * np.cumsum(
        [0.0, *(0.6**k for k in range(1, 6))]
    )
    assert path.impacts[:6, 0] / w0 == pytest.approx(times, rel=2e-4)
    place = path.coordinates[-1, 0] @ problem.equations.modes.contact
    # on the floor of its box
    assert place * problem.scales.length == pytest.approx(0.5 * ball.room, rel=1e-6)
    assert 8 < len(path.impacts) < 40


@pytest.mark.thorough("test_energy_and_momentum")
def test_weakly_shaken_it_lies_still():
    """Shaken far below gravity, a ball moves with its box as one mass does, and however long, no
    impact dissipates energy."""
    ball = hv.Ball(mass="2 g", room="0.4 mm", restitution=0.7, tilt=90.0)
    white = hv.Excitation(acceleration_psd=1e-6)
    alone = BEAM.replace(mode=(), excitation=white)
    heavier = math.sqrt(1.2)
    first = alone.oscillator.replace(
        mass=0.012, frequency=50.0 / heavier, damping_ratio=0.03 / heavier
    )
    both = [Problem(one) for one in (alone.replace(ball=ball), alone.replace(oscillator=first))]
    eqs = both[0].equations
    root = math.sqrt(0.2)
    pressed = -root * eqs.modes.pull
    noise = np.random.default_rng(1).standard_normal(30000)
    start = np.array([pressed, root * (pressed - eqs.gap), 0.0, 0.0, 0.0])
    path = trace(eqs, noise, 0.02, 10, start)
    joined = trace(both[1].equations, noise, 0.02 / heavier, 10, start=(0.0, 0.0, 0.0))
    assert len(path.impacts) == 0 and eqs.gap > 1000.0  # so that rounding of places counts
    found, expected = (
        one.V * problem.units.volts for one, problem in zip((path, joined), both, strict=True)
    )
    assert np.abs(found - expected).max() < 5e-4 * np.abs(expected).max()


@pytest.mark.thorough("test_energy_and_momentum")
def test_what_lies_still_is_of_second_order():
    """On its floor a ball is carried in balance with the spring, and the excitation's amplitude is
    that of a joined mass."""
    drive = hv.Excitation(acceleration_amplitude="0.02 g", frequency="45.6 Hz")
    heavier = math.sqrt(1.2)
    root = 0.2**0.5
    alone = BEAM.replace(mode=(), excitation=drive)
    joined = alone.oscillator.replace(
        mass=0.012, frequency=50.0 / heavier, damping_ratio=0.03 / heavier
    )
    problem = Problem(alone.replace(ball=BALL.replace(tilt=90.0)))
    one = Problem(alone.replace(oscillator=joined))
    expected = (
        abs(amplitudes(one.equations, one.equations.drive_frequency)[1])
        * one.equations.drive
        * one.units.volts
    )
    eqs = problem.equations
    errors = []
    pressed = -root * eqs.modes.pull
    for n in (32, 64, 128):
        start = np.array([pressed, root * (pressed - eqs.gap), 0.0, 0.0, 0.0])
        path = trace(eqs, np.zeros(n * 160), eqs.shaking_period / n, 1, start)
        last = path.V[-n:] * problem.units.volts
        errors.append(
            abs(2.0 * np.mean(last * np.exp(-1j * TURN * np.arange(n) / n))) / expected - 1.0
        )
        assert len(path.impacts) == 0
        assert path.coordinates[-n:, 0, 0].mean() == pytest.approx(pressed, rel=1e-5)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05) and errors[1] / errors[
        2
    ] == pytest.approx(4.0, rel=0.05)
    assert abs(errors[2]) < 1.5e-3


def _located(scene, end, h):
    """X_1 and v (SI units) of a scene with modes and a ball at times k h up to ``end``, and how many impacts it had.

    The state is (X_1, ..., Z, their speeds, v, cos, sin, 1); its flow is a matrix exponential, and
    impacts are zeros of the distance to an end, found to rounding.
    """
    first = scene.oscillator
    piezo = scene.piezo
    ball = scene.ball
    drive = scene.excitation
    rows = [(first.mass, first.frequency, first.damping_ratio, piezo.coupling, 1.0)]
    rows += [(m.mass, m.frequency, m.damping_ratio, m.coupling, m.base) for m in scene.mode]
    mass, f, ratio, theta, base = np.array([*rows, (ball.mass, 0.0, 0.0, 0.0, 1.0)]).T
    n = len(mass)
    w = TURN * f
    a = np.zeros((2 * n + 4, 2 * n + 4))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -np.diag(w * w)
    a[n : 2 * n, n : 2 * n] = -np.diag(2.0 * ratio * w)
    a[n : 2 * n, 2 * n] = -theta / mass
    a[n : 2 * n, 2 * n + 1] = base * drive.acceleration_amplitude
    a[2 * n - 1, -1] = -G * math.sin(math.radians(ball.tilt))
    a[2 * n, n : 2 * n] = theta / piezo.capacitance
    a[2 * n, 2 * n] = -1.0 / (scene.load.resistance * piezo.capacitance)
    a[2 * n + 1, 2 * n + 2] = -TURN * drive.frequency
    a[2 * n + 2, 2 * n + 1] = TURN * drive.frequency
    phi = np.array([*np.ones(n - 1), -1.0])
    z = np.zeros(2 * n + 4)
    found = []
    impacts = 0
    z[2 * n + 1] = z[-1] = 1.0
    step = expm(a * h)
    for _ in range(round(end / h)):
        left, flow = h, step
        while True:
            after = flow @ z
            side = math.copysign(1.0, phi @ after[:n])
            if abs(phi @ after[:n]) <= 0.5 * ball.room:
                break
            at = brentq(
                lambda t, z=z, s=side: 0.5 * ball.room - s * (phi @ (expm(a * t) @ z)[:n]),
                0.0,
                left,
                xtol=1e-18,
            )
            z = expm(a * at) @ z
            left = left - at
            impacts = impacts + 1
            change = phi / mass
            z[n : 2 * n] -= (
                (1.0 + ball.restitution) * (phi @ z[n : 2 * n]) / (phi @ change) * change
            )
            # off the end, so that it is not found again
            z[:n] -= 1e-15 * side * change / (phi @ change)
            flow = expm(a * left)
        z = after
        found.append([z[0], z[2 * n]])
    return np.array(found), impacts


@pytest.mark.parametrize(
    "modes, ball",
    [
        pytest.param((), BALL, marks=pytest.mark.thorough("test_energy_and_momentum")),
        pytest.param(
            (SECOND,),
            BALL.replace(restitution=0.9),
            marks=pytest.mark.thorough("test_energy_and_momentum"),
        ),
    ],
)
def test_located_impacts(modes, ball):
    """A ball shaken in a tilted box moves as by exact flow between located impacts, to second order in the step."""
    scene = BEAM.replace(mode=modes, ball=ball, excitation=DRIVE)
    problem = Problem(scene)
    seconds = 0.05
    w0 = problem.scales.frequency
    s = problem.units
    expected, impacts = _located(scene, seconds, seconds / 200)
    errors = []
    for fine in (8, 16, 32):
        path = trace(problem.equations, np.zeros(200 * fine), w0 * seconds / (200 * fine), fine)
        assert len(path.impacts) == impacts > 5
        found = path.samples[:, :2] * [s.length, s.volts]
        errors.append(np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0))
    assert errors[2].max() < 1e-3
    assert (errors[2] < 0.35 * errors[0]).all()
