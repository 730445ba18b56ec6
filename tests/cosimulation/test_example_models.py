"""The three examples of `hv.cosimulate`: each against a closed form or ngspice alone, with its order of convergence."""

import math
import re
import subprocess

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from harvester.netlists.load_circuit import load_circuit
from tests.support.models import example, orders

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]


def flow_of_beam(b, farads, ohms):
    """The beam of examples/beam_with_stop.py without its stop: the state (q, v, V) after a time, exactly."""
    theta, w = np.array([b.theta1, b.theta2]), np.array([b.w1, b.w2])
    a = np.zeros((5, 5))
    a[:2, 2:4] = np.eye(2)
    a[2:4, :2] = -np.diag(w**2)
    a[2:4, 2:4] = -2.0 * b.zeta * np.diag(w)
    a[2:4, 4] = -theta
    a[4, 2:4] = theta / farads
    a[4, 4] = -1.0 / (ohms * farads)
    rates, modes = np.linalg.eig(a)
    back = np.linalg.inv(modes)
    return lambda y, t: (modes @ (np.exp(np.multiply.outer(rates, t)).T * (back @ y)).T).real


def beam_by_impacts(b, flow, start, times):
    """Its states at the times, shape (5, n), by the flow between impacts found to rounding, and the impacts' times."""
    phi, y, begin, hits = np.array([b.phi1, b.phi2]), np.array([*start, 0.0]), 0.0, []
    states = np.empty((5, len(times)))
    grid = np.arange(1, 20_000) * 2e-6

    def place(y):
        return b.gap + phi @ y[:2]

    while begin <= times[-1]:
        inside = np.flatnonzero(place(flow(y, grid)) < 0.0)
        later = times >= begin
        states[:, later] = flow(y, times[later] - begin)
        if len(inside) == 0:
            assert grid[-1] > times[-1] - begin
            break
        here = y
        before = grid[inside[0] - 1] if inside[0] else 1e-9
        wait = brentq(lambda t, y=here: place(flow(y, t)), before, grid[inside[0]], xtol=1e-16)
        y = flow(here, wait)
        begin = begin + wait
        y[2:4] -= (1.0 + b.r) * (phi @ y[2:4]) * phi / (phi @ phi)
        hits.append(begin)
    return states, np.array([one for one in hits if one <= times[-1]])


@pytest.mark.thorough("test_the_answer_is_data")
def test_beam_with_a_stop():
    """Second order in displacement, voltage and the times of five impacts, against exact flow and located impacts."""
    beam = example("beam_with_stop")
    flow = flow_of_beam(beam.Beam(), beam.PIEZO.capacitance, beam.LOAD.resistance)
    errors = []
    when = []
    residuals = []
    for step in ("100 us", "50 us", "25 us"):
        found = beam.run(step)
        exact, hits = beam_by_impacts(beam.Beam(), flow, beam.START, found.time)
        assert len(found.events) == len(hits) == 5
        errors.append(np.abs(found.voltage - exact[4]).max() / np.abs(exact[4]).max())
        when.append(np.abs(found.events - hits).max())
        residuals.append(abs(found.ledger_residual))
    assert min(orders(errors)) > 1.9 and min(orders(when)) > 1.9 and min(orders(residuals)) > 1.9
    assert errors[-1] < 1e-3 and when[-1] < 4e-6 and residuals[-1] < 2e-4


@pytest.mark.thorough("test_the_answer_is_data")
def test_pendulum_without_friction():
    """Second order against Jacobi's elliptic function, on four seconds from 115 degrees."""
    module = example("pendulum")
    model = module.Pendulum(friction=0.0)
    errors = []
    w = math.sqrt(model.gravity / model.inertia)
    k = math.sin(0.5 * module.START.angle)
    for step in ("10 ms", "5 ms", "2.5 ms"):
        found = module.run(step, "4 s", load="1 Tohm", model=model)
        exact = 2.0 * np.arcsin(k * ellipj(ellipk(k * k) - w * found.time, k * k)[0])
        errors.append(np.abs(found.state["angle"] - exact).max())
    assert min(orders(errors)) > 1.95 and errors[-1] < 4e-4


@pytest.mark.thorough("test_the_answer_is_data")
def test_pendulum_with_friction():
    """Its six first turning angles satisfy g (cos b - cos a) = M (a + b), of second order; and it comes to rest."""
    module = example("pendulum")
    errors = []
    d = module.Pendulum()
    exact = [module.START.angle]
    for _ in range(6):
        a = exact[-1]
        exact.append(
            brentq(
                lambda b, a=a: d.gravity * (math.cos(b) - math.cos(a)) - d.friction * (a + b),
                0.0,
                a,
                xtol=1e-14,
            )
        )
    for step in ("10 ms", "5 ms", "2.5 ms"):
        found = module.run(step, "4 s", load="1 Tohm")
        angle = np.abs(found.state["angle"])
        speed = found.state["speed"]
        turns = []
        for i in np.flatnonzero(speed[1:-1] * speed[2:] < 0.0)[:6] + 1:
            left, mid, right = angle[(j := i if angle[i] > angle[i + 1] else i + 1) - 1 : j + 2]
            turns.append(mid - (right - left) ** 2 / 8.0 / (right - 2.0 * mid + left))
        errors.append(np.abs(np.array(turns) - exact[1:]).max())
    assert (
        min(orders(errors)) > 1.5 and math.log2(errors[0] / errors[-1]) > 3.6 and errors[-1] < 5e-6
    )
    rest = module.run()
    assert (
        rest.state["speed"][-1] == 0.0
        and abs(math.sin(rest.state["angle"][-1])) * d.gravity <= d.friction
    )
    assert abs(rest.ledger_residual) < 2e-4


def magnet_in_ngspice(module, end):
    """Voltage of the store and displacement at the ``end`` by ngspice alone: a mass is a capacitor, a spring a coil."""
    d = module.Harvester()
    coil = module.COIL
    circuit = load_circuit(module.BRIDGE)
    deck = f"""the whole device
Bforce 0 u I={d.m * d.a!r}*cos({d.w!r}*time)
Cmass u 0 {d.m!r} ic=0
Lspring u 0 {1.0 / d.k!r} ic=0
Rdamping u 0 {1.0 / d.c!r}
Eemf drive 0 u 0 {coil.coupling!r}
Vsense drive c1 0
Freaction u 0 Vsense {coil.coupling!r}
Rcoil c1 c2 {coil.resistance!r}
Lcoil c2 p {coil.inductance!r} ic=0
{circuit.text}
.options method=gear maxord=2 reltol=1e-6 abstol=1e-10 vntol=1e-8 chgtol=1e-12
.tran 2e-5 {end!r} 0 2e-5 uic
.control
run
set wr_singlescale
set numdgt=12
let store=v(xload.a)-v(xload.b)
let x=i(lspring)/{d.k!r}
wrdata /dev/stderr store x
.endc
.end
"""
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input=deck,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    rows = re.findall(r"^ *(\S+e[+-]\d+) +(\S+e[+-]\d+) +(\S+e[+-]\d+) *$", done.stderr, re.M)
    assert len(rows) > 1000, done.stdout + done.stderr[:2000]
    return np.array(rows, float).T


@pytest.mark.thorough("test_the_answer_is_data")
def test_electromagnetic_harvester_with_a_bridge():
    """Second order in displacement and the store's voltage, against the whole device as one netlist."""
    module = example("electromagnetic_bridge")
    errors = []
    t, store, x = magnet_in_ngspice(module, 0.5)
    for step in ("1 ms", "0.5 ms", "0.25 ms"):
        found = module.run(step, "0.5 s", tolerance=1e-6)
        a = np.abs(found.state["x"] - np.interp(found.time, t, x)).max() / np.abs(x).max()
        b = (
            np.abs(found.probes["store"] - np.interp(found.time, t, store)).max()
            / np.abs(store).max()
        )
        errors.append(max(a, b))
        last = abs(found.ledger_residual)
    assert min(orders(errors)) > 1.7 and errors[-1] < 3e-3
    assert last < 3e-4
