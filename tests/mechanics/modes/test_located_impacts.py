"""Modes with stops under a harmonic excitation against codes that share nothing with the package:
exact flow, and DOP853."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import harvester as hv
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.located_impacts import Device
from tests.support.systems import BEAM

pytestmark = [pytest.mark.thorough("test_modes.py"), pytest.mark.slow]
TURN = 2.0 * math.pi
DRIVE = hv.Excitation(acceleration_amplitude="0.5 g", frequency="45 Hz")


def device(scene):
    """The same device for the independent code."""
    first = scene.oscillator
    piezo = scene.piezo
    drive = scene.excitation
    modes = [(first.mass, first.frequency, first.damping_ratio, piezo.coupling, 1.0, 1.0)]
    modes += [
        (
            m.mass,
            m.frequency,
            m.damping_ratio,
            m.coupling,
            m.base,
            1.0 if m.at_stop is None else m.at_stop,
        )
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
    """E[V^2] of trajectories from rest under a harmonic excitation, in V^2, and their moments."""
    problem = Problem(scene)
    many = Trajectories(
        problem.equations, 64, np.random.SeedSequence(1), h, start=np.zeros((3, 64))
    )
    many.run(settle * problem.equations.shaking_period)
    moments = many.run(periods * problem.equations.shaking_period)
    return moments.V2.mean() * problem.units.volts**2, moments


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


@pytest.mark.parametrize("kind", STOPS)
def test_located_impacts(kind):
    """Two modes with stops against exact flow and impacts located to rounding, under a harmonic
    excitation: within 0.3 %."""
    tables, stops, compliant = STOPS[kind]
    scene = BEAM.replace(excitation=DRIVE, **tables)
    independent = device(scene).mean_square_voltage(stops, 30, 60, compliant)
    found, moments = steady(scene, 0.015)
    assert moments.impacts.min() > 0.0
    assert found == pytest.approx(independent, rel=3e-3)
    assert np.abs(moments.balance(Problem(scene).equations)).max() < 5e-3


UNDER = hv.Magnifier(
    mass="30 g", stiffness="4 N/mm", damping="0.5 N s/m", restitution=0.4, gap="0.1 mm"
)


def test_magnifier_with_a_stop_under_it():
    """A magnifier on a stop against DOP853 with events, in the displacements Z and X as the documents write them."""
    scene = BEAM.replace(mode=(), excitation=DRIVE, magnifier=UNDER)
    m = 0.01
    k = scene.modal.stiffness
    c = scene.modal.damping
    theta = scene.modal.coupling
    cp = scene.modal.capacitance
    w = TURN * 45.0
    amplitude, resistance = scene.excitation.acceleration_amplitude, scene.load.resistance

    def motion(t, s):
        z, x, dz, dx, v, _ = s
        force = k * x + c * dx + theta * v  # of the device on the magnifier
        ddz = (
            -amplitude * math.cos(w * t)
            + (force - UNDER.stiffness * z - UNDER.damping * dz) / UNDER.mass
        )
        ddx = -amplitude * math.cos(w * t) - ddz - force / m
        return [dz, dx, ddz, ddx, theta / cp * dx - v / (resistance * cp), v * v]

    def touches(t, s):
        return s[0] + UNDER.gap

    touches.terminal = True
    touches.direction = -1.0
    begin = 40 * TURN / w
    end = 60 * TURN / w
    s = np.zeros(6)
    time = 0.0
    hits = 0
    square = None
    for until in (begin, end):
        square = s[5]
        while time < until:
            run = solve_ivp(
                motion, (time, until), s, "DOP853", events=touches, rtol=1e-9, atol=1e-14
            )
            s = run.y[:, -1].copy()
            time = run.t[-1]
            if run.status == 1:  # the device keeps its speed Z' + X'
                jump = -(1.0 + UNDER.restitution) * s[2]
                s[2], s[3], s[0], hits = s[2] + jump, s[3] - jump, -UNDER.gap, hits + 1
    assert hits > 20
    assert steady(scene, 0.01, 40, 20)[0] == pytest.approx(
        (s[5] - square) / (end - begin), rel=3e-3
    )
