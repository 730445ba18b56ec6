"""Several modes and a magnifier: against the Lyapunov equation, the Gibbs law, and codes that share nothing with them."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import norm

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.modes.path import trace_modes
from tests.support.located_impacts import Device

TURN = 2.0 * math.pi
SECOND = hv.Mode(frequency="310 Hz", mass="12 g", damping_ratio=0.03, coupling="-5e-3 N/V", base=-0.4)
THIRD = hv.Mode(frequency="880 Hz", mass="9 g", damping_ratio=0.02, coupling="7e-3 N/V", base=0.2, at_stop=-1.0)
BEAM = hv.Scene(
    oscillator=hv.Oscillator(mass="10 g", frequency="50 Hz", damping_ratio=0.03),
    piezo=hv.Piezo(coupling="2e-3 N/V", capacitance="50 nF"),
    mode=(SECOND,),
    excitation=hv.Excitation(acceleration_psd="1e-4 g^2/Hz"),
    load=hv.Load(resistance="100 kohm"),
)
DRIVE = hv.Excitation(acceleration_amplitude="0.5 g", frequency="45 Hz")


def device(scene):
    """The same device for the independent code."""
    first, piezo, drive = scene.oscillator, scene.piezo, scene.excitation
    modes = [(first.mass, first.frequency, first.damping_ratio, piezo.coupling, 1.0, 1.0)]
    modes += [
        (m.mass, m.frequency, m.damping_ratio, m.coupling, m.base, 1.0 if m.at_stop is None else m.at_stop)
        for m in scene.mode
    ]
    mass, f, ratio, coupling, base, at_stop = np.array(modes).T
    w = TURN * f
    return Device(
        np.diag(mass),
        np.diag(2.0 * ratio * w * mass),
        np.diag(mass * w * w),
        coupling,
        mass * base,
        at_stop,
        capacitance=piezo.capacitance,
        resistance=scene.load.resistance,
        amplitude=drive.acceleration_amplitude,
        frequency=TURN * drive.frequency,
    )


def steady(scene, h, settle=60, periods=30):
    """E[V^2] of trajectories from rest under a drive, in V^2, and their moments."""
    problem = Problem(scene)
    many = Trajectories(problem.equations, 64, np.random.SeedSequence(1), h, start=np.zeros((3, 64)))
    many.run(settle * problem.equations.shaking_period)
    moments = many.run(periods * problem.equations.shaking_period)
    return moments.V2.mean() * problem.units.volts**2, moments


@pytest.mark.parametrize("modes", [(SECOND,), (SECOND, THIRD)], ids=["two", "three"])
@pytest.mark.parametrize("noise", ["white", "coloured", "tabulated"])
def test_linear_means(modes, noise):
    """Trajectories agree with the closed form, which is a Lyapunov equation or an integral of transfer functions."""
    shaking = {
        "white": BEAM.excitation,
        "coloured": BEAM.excitation.replace(correlation_time="1 ms"),
        "tabulated": hv.Excitation(profile="mil-std-810-truck-vertical"),
    }[noise]
    scene = BEAM.replace(mode=modes, excitation=shaking)
    exact = hv.run(scene, "exact").mean_power.value
    found = hv.run(scene, "ensemble", seed=2, trajectories=512, **({"duration": 1.0} if noise != "white" else {}))
    power = found.mean_power
    assert abs(power.value - exact) < 4.0 * power.stderr + 1.5 * power.bias + 1e-3 * exact
    assert power.stderr < (3e-3 if noise == "white" else 0.03) * exact


def test_lyapunov_and_transfer_function():
    """White noise as a tabulated density far beyond all modes gives what the Lyapunov equation gives."""
    scene = BEAM.replace(mode=(SECOND, THIRD))
    white = hv.run(scene, "exact").mean_square_voltage.value
    slow = BEAM.excitation.replace(correlation_time=1e-9)
    assert hv.run(scene.replace(excitation=slow), "exact").mean_square_voltage.value == pytest.approx(white, rel=1e-6)


STOPS = {
    "rigid": ({"stop": hv.Stop(restitution=0.3, gap="0.05 mm")}, [(1, -5e-5, 0.3)], None),
    "opposite": (
        {
            "stop": hv.Stop(restitution=0.3, gap="0.08 mm"),
            "opposite_stop": hv.OppositeStop(restitution=0.4, gap="0.1 mm"),
        },
        [(1, -8e-5, 0.3), (-1, 1e-4, 0.4)],
        None,
    ),
    "compliant": (
        {"stop": hv.Stop(stiffness="2e4 N/m", damping="5 N s/m", gap="0.05 mm")},
        [(1, -5e-5, None)],
        (2e4, 5.0, 5e-5),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", STOPS)
def test_located_impacts(kind):
    """Two modes with stops against exact flow and impacts located to rounding, under a drive: within .3 %."""
    tables, stops, compliant = STOPS[kind]
    scene = BEAM.replace(excitation=DRIVE, **tables)
    independent = device(scene).mean_square_voltage(stops, 30, 60, compliant)
    found, moments = steady(scene, 0.015)
    assert moments.impacts.min() > 0.0
    assert found == pytest.approx(independent, rel=3e-3)
    assert np.abs(moments.balance(Problem(scene).equations)).max() < 5e-3


def test_gibbs_law_at_a_stop():
    """Noise and damping along one direction and an elastic stop along another: energy has the Gibbs law.

    x = sum e_j y_j has the speed's variance N1 e.e/c, w = phi.y is a Gaussian cut off at the stop, which is hit at the
    rate of w' < 0 there, and what of x is independent of w keeps its own variance.
    """
    e, phi, n1, c, beta, gap = np.array([1.0, -0.6]), np.array([1.0, 0.8]), 0.02, 0.1, 0.3, 0.2
    modes = Modes((0.0, 6.0), (0.0, 0.0), tuple(e), tuple(e), tuple(phi), tuple(e))
    eqs = Equations(c1=-c, beta=beta, n1=n1, restitution=1.0, gap=gap, modes=modes)
    stiffness = np.diag([0.0, 6.0]) + (1.0 + beta) * np.outer(e, e)
    covariance, heat = n1 / c * np.linalg.inv(stiffness), n1 / c
    many = Trajectories(eqs, 512, np.random.SeedSequence(3), 0.05)
    many.run(100.0)
    moments = many.run(400.0)
    size = math.sqrt(phi @ covariance @ phi)
    cut = -gap / size
    density = norm.pdf(cut) / norm.sf(cut)
    second = size**2 * (1.0 + cut * density)  # E[w^2 | w > -gap]
    slope = e @ covariance @ phi / size**2
    expected = {
        "v2": heat * e @ e,
        "x2": slope**2 * second + e @ covariance @ e - slope**2 * size**2,
        "impacts": density / size * math.sqrt(heat * phi @ phi / TURN),
    }
    for name, value in expected.items():
        mean, error = moments.mean(name)
        assert abs(mean - value) < 4.0 * error + 2e-3 * value, name
        assert error < 0.02 * value


@pytest.mark.parametrize("opposite", [None, 0.8])
def test_impacts_take_what_the_ledger_says(opposite):
    """Without springs the kinetic energy lost is that taken by impacts, to rounding, however many there are."""
    modes = Modes((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, -0.5, 0.3), (1.0, 1.0, 1.0), (1.0, 0.7, -0.4))
    ends = {} if opposite is None else {"opposite_restitution": opposite, "opposite_gap": 0.5}
    eqs = Equations(linear=1e-30, restitution=0.7, gap=0.3, modes=modes, **ends)
    start = np.array([0.0, 0.0, 0.0, -1.0, 0.4, 0.2, 0.0])
    path = trace_modes(eqs, np.zeros(400), 0.02, 100, start)
    kinetic = 0.5 * (path.coordinates[-1, 1] ** 2).sum()
    assert len(path.impacts) > (0 if opposite is None else 3)
    assert kinetic + path.lost == pytest.approx(0.5 * (start[3:6] ** 2).sum(), rel=1e-9)
    assert path.V[-1] == pytest.approx(float(np.dot(modes.coupling, path.coordinates[-1, 0])), abs=1e-12)


def test_energy_closes_with_the_step():
    """With springs and an open circuit the whole energy, and what impacts took, closes to second order in the step."""
    tables, _, _ = STOPS["compliant"]
    lossless = BEAM.replace(oscillator=BEAM.oscillator.replace(damping_ratio=None), load=None, excitation=None, **tables)
    eqs = Problem(lossless.replace(mode=(SECOND.replace(damping_ratio=None),))).equations
    s, start = np.array(eqs.modes.coupling), np.array([0.0, 0.0, 0.5, -0.3, 0.0]) * 4.0 * eqs.gap
    k = eqs.modes.matrices(1.0, 0.0)[0] + eqs.beta * np.outer(s, s)
    errors = []
    for h in (4e-3, 1e-3, 2.5e-4):
        steps = round(20.0 / h)
        path = trace_modes(eqs, np.zeros(steps), h, steps, start)
        (y, v), before = path.coordinates[-1], 0.5 * (start[2:4] ** 2).sum()
        assert path.lost > 0.1 * before and len(path.impacts) > 2
        errors.append(abs((0.5 * (v @ v + y @ k @ y) + path.lost) / before - 1.0))
    assert errors[0] < 1e-3 and errors[2] < 2e-5


UNDER = hv.Magnifier(mass="30 g", stiffness="4 N/mm", damping="0.5 N s/m", restitution=0.4, gap="0.1 mm")


@pytest.mark.slow
def test_magnifier_with_a_stop_under_it():
    """A magnifier on a stop against DOP853 with events, in the displacements Z and X as the documents write them."""
    scene = BEAM.replace(mode=(), excitation=DRIVE, magnifier=UNDER)
    m, k, c = 0.01, scene.modal.stiffness, scene.modal.damping
    theta, cp, w = scene.modal.coupling, scene.modal.capacitance, TURN * 45.0
    amplitude, resistance = scene.excitation.acceleration_amplitude, scene.load.resistance

    def motion(t, s):
        z, x, dz, dx, v, _ = s
        force = k * x + c * dx + theta * v  # of the device on the magnifier
        ddz = -amplitude * math.cos(w * t) + (force - UNDER.stiffness * z - UNDER.damping * dz) / UNDER.mass
        ddx = -amplitude * math.cos(w * t) - ddz - force / m
        return [dz, dx, ddz, ddx, theta / cp * dx - v / (resistance * cp), v * v]

    def touches(t, s):
        return s[0] + UNDER.gap

    touches.terminal, touches.direction = True, -1.0
    begin, end, s, time = 40 * TURN / w, 60 * TURN / w, np.zeros(6), 0.0
    hits, square = 0, None
    for until in (begin, end):
        square = s[5]
        while time < until:
            run = solve_ivp(motion, (time, until), s, "DOP853", events=touches, rtol=1e-9, atol=1e-14)
            s, time = run.y[:, -1].copy(), run.t[-1]
            if run.status == 1:  # the device keeps its speed Z' + X'
                jump = -(1.0 + UNDER.restitution) * s[2]
                s[2], s[3], s[0], hits = s[2] + jump, s[3] - jump, -UNDER.gap, hits + 1
    assert hits > 20
    assert steady(scene, 0.01, 40, 20)[0] == pytest.approx((s[5] - square) / (end - begin), rel=3e-3)


def test_magnifier_is_what_it_is_in_the_limit():
    """On a spring that is far too stiff a magnifier changes nothing."""
    alone = BEAM.replace(mode=())
    stiff = alone.replace(magnifier=hv.Magnifier(mass="20 g", stiffness="1e9 N/m", damping="1e3 N s/m"))
    powers = [hv.run(scene, "exact").mean_power.value for scene in (alone, stiff)]
    assert powers[1] == pytest.approx(powers[0], rel=1e-3)
