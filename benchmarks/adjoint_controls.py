"""Control variates from the adjoint of the density: what they take of the variance, and what a step costs with them.

    python benchmarks/adjoint_controls.py [--scene "r = 0.96"]

The adjoint q solves the Poisson equation L q = V^2 - E[V^2], so that the mean over a path, less its
sums of noise times q_v and its difference of q between end and beginning, has no error but that of
the step and of the table of q.  Plain kernels of `ensemble`'s scheme, in three ways: without, with
the table linear in a cell, with that of the nearest place.
"""

import argparse
import time

import numba
import numpy as np

from harvester.density.adjoint import adjoint
from harvester.density.box import settled
from harvester.density.coupled_modes import integrals
from harvester.density.elements import evaluated
from harvester.density.functionals import functionals
from harvester.density.marginals import Marginals
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.refine import solution
from harvester.equations.coefficients import Equations
from harvester.machine.cores import one_blas_thread

PAPER = {
    "c1": 0.01,
    "c2": 0.05,
    "c3": 0.1,
    "alpha": 0.5,
    "beta": 0.05,
    "mu": 0.05,
    "n1": 0.01,
    "n2": 0.01,
}
SCENES = {
    "r = 0.96": Equations(**PAPER, restitution=0.96),
    "r = 0.7": Equations(**PAPER, restitution=0.7),
    "two stops": Equations(
        **PAPER, restitution=0.7, gap=0.3, opposite_restitution=0.9, opposite_gap=0.3
    ),
    "no stop": Equations(**PAPER),
}
PLACES = (161, 321)
MODES = 6
TABLED = 3
WAYS = ("none", "linear", "nearest")
NONE, LINEAR, NEAREST = range(3)
# of a path in 1/w0; steps and how many paths
DURATION = 400.0
STEPS = {0.1: 400, 0.025: 200}


@one_blas_thread
def tables(eqs):
    """E[V^2], its adjoint and the derivative in v at places of x and v and by mode, and where they are."""
    setting = settled(eqs, 20.0)
    found = solution(eqs, setting, mesh(eqs, setting.box, RESOLUTIONS[1]), MODES)
    form = found.form
    mean = float(found.means[0])
    masses = np.zeros(form.shape)
    masses[0] = integrals(form)
    q = adjoint(found.factors, functionals(eqs, form)[0].reshape(form.shape) - mean * masses)
    box = setting.box
    x = np.linspace(box.low, box.high, PLACES[0])
    v = np.linspace(-box.speed, box.speed, PLACES[1])
    across = evaluated(form.mesh.v_breaks, form.mesh.degree, v)
    of = Marginals(form, found.p)
    roots = np.sqrt([1.0, 1.0, 2.0])
    by_mode = np.stack([of._at(q[k], x) @ across.T / roots[k] for k in range(TABLED)], axis=2)
    frame = np.array(
        [
            form.frame.slope,
            form.frame.offset,
            form.frame.scale,
            x[0],
            x[1] - x[0],
            v[0],
            v[1] - v[0],
        ]
    )
    return mean, by_mode, np.gradient(by_mode, v, axis=1).copy(), frame


@numba.njit(fastmath=True)
def looked_up(table, frame, way, x, v, voltage):
    """The value at a state: three modes of z, each from the table."""
    a = min(max((x - frame[3]) / frame[4], 0.0), table.shape[0] - 1.001)
    b = min(max((v - frame[5]) / frame[6], 0.0), table.shape[1] - 1.001)
    i, j = int(a), int(b)
    a, b = a - i, b - j
    z = (x - voltage - frame[0] * x - frame[1]) / frame[2]
    total = 0.0
    for k in range(3):
        if way == NEAREST:
            one = table[i + int(a + 0.5), j + int(b + 0.5), k]
        else:
            left = (1.0 - b) * table[i, j, k] + b * table[i, j + 1, k]
            one = (1.0 - a) * left + a * (
                (1.0 - b) * table[i + 1, j, k] + b * table[i + 1, j + 1, k]
            )
        total += one * (1.0 if k == 0 else z if k == 1 else z * z - 1.0)
    return total


@numba.njit(fastmath=True)
def three_points():
    u = np.random.random()
    return -1.7320508075688772 if u < 1.0 / 6.0 else 1.7320508075688772 if u > 5.0 / 6.0 else 0.0


@numba.njit(fastmath=True)
def drifted(x, v, voltage, time, mu, low, high, r_low, r_high):
    """A free drift with one impact at most; the voltage by a straight line of x."""
    after = x + v * time
    if after < low or after > high:
        wall, r = (low, r_low) if after < low else (high, r_high)
        first = (wall - x) / v
        voltage = voltage * np.exp(-mu * first) + v * first * (1.0 - 0.5 * mu * first)
        v = -r * v
        time = time - first
        x = wall
        after = min(max(x + v * time, low), high)
    return after, v, voltage * np.exp(-mu * time) + (after - x) * (1.0 - 0.5 * mu * time)


@numba.njit(fastmath=True)
def paths(count, steps, h, c, stops, q, slopes, frame, way):
    """Each path's mean of V^2, and the two sums of its control; half of the steps are burn-in."""
    np.random.seed(7)
    c1, c2, c3, alpha, beta, mu, n1, n2 = c
    low, high, r_low, r_high = stops
    out = np.zeros((count, 3))
    for path in range(count):
        x = max(0.05, low)
        v = 0.0
        voltage = 0.0
        begin = 0.0
        for step in range(2 * steps):
            counted = step >= steps
            if step == steps and way != NONE:
                begin = looked_up(q, frame, way, x, v, voltage)
            x, v, voltage = drifted(x, v, voltage, 0.5 * h, mu, low, high, r_low, r_high)
            kick = (
                np.sqrt(2.0 * n1 * h) * three_points() + np.sqrt(2.0 * n2 * h) * x * three_points()
            )
            force = -x - alpha * x**3 - beta * voltage
            friction = -c1 - c2 * x * x + c3 * x**4
            if counted:
                out[path, 0] += voltage * voltage / steps
                if way != NONE:
                    at = v + 0.5 * h * (force - friction * v)
                    out[path, 1] += (
                        kick * looked_up(slopes, frame, way, x, at, voltage) / (steps * h)
                    )
            decay = np.exp(-0.5 * h * friction)
            v = (v * decay + h * force + kick) * decay
            x, v, voltage = drifted(x, v, voltage, 0.5 * h, mu, low, high, r_low, r_high)
        if way != NONE:
            out[path, 2] = (looked_up(q, frame, way, x, v, voltage) - begin) / (steps * h)
    return out


def main(name):
    eqs = SCENES[name]
    mean, q, slopes, frame = tables(eqs)
    c = tuple(getattr(eqs, one) for one in PAPER)
    stops = (*eqs.rigid_stops, eqs.restitution or 1.0, eqs.opposite_restitution or 1.0)
    for h, count in STEPS.items():
        for way in (NONE, LINEAR, NEAREST):
            paths(1, 10, h, c, stops, q, slopes, frame, way)  # compiles
            begin = time.process_time()
            steps = round(DURATION / h)
            plain, sums, ends = paths(count, steps, h, c, stops, q, slopes, frame, way).T
            cost = (time.process_time() - begin) / (2 * count * steps) * 1e9
            better = plain + sums - ends
            off = better.mean() / mean - 1.0
            spread = better.std() / mean / np.sqrt(count)
            print(
                f"{name}, step {h}, {WAYS[way]}: variance over {plain.var() / better.var():.0f}, "
                f"off the density {off:+.1e} +- {spread:.0e}, {cost:.0f} ns a step (half of them without sums)",
                flush=True,
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", choices=SCENES)
    asked = parser.parse_args()
    for scene in [asked.scene] if asked.scene else SCENES:
        main(scene)
