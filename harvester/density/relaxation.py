"""How the density comes to rest: the slowest decay, inter-well transitions, first passages, and spectra.

A density that is not stationary changes by M dp/dt = A p, with the form A and the mass matrix M of
`weak_form`.

Inter-well transitions: the density p = p_s + c exp(-lambda t) p_1 of two wells has one decay that
is far slower than all others.  With the shares P of the time in them the mass leaves them at the
rates k_1 = lambda P_2 and k_2 = lambda P_1.

First passage: if the outflow at a level is lost, the mass decays as exp(-lambda t), and 1/lambda
is the mean time of the first passage, but for the time in which the motion forgets its beginning.

Spectrum: with the density u of (A - i w M) u = -M (g p_s) that of a quantity g without a mean is,
two-sided and over w,

    S(w) = 2 Re int_0^oo E[g(t) g(0)] exp(-i w t) dt = 2 Re int g u
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.density.coupled_modes import Factors, integrals, pinned
from harvester.density.elements import products
from harvester.density.moment_weights import MomentWeights, value
from harvester.density.refine import Solution
from harvester.density.weak_form import WeakForm
from harvester.errors import SimulationError
from harvester.machine.cores import one_blas_thread
from harvester.presentation.diagnostic import refusal

# of inverse iteration, and the relative change of the decay at which it ends
ROUNDS = 60
STILL = 1e-7


@one_blas_thread
def slowest_decay(solution: Solution) -> tuple[float, Any]:
    """The smallest rate lambda > 0 at which a density comes to rest, and that density, whose mass is 0.

    By inverse iteration from the sign of x - E[x].  Raises SimulationError if that does not end:
    the slowest is not a single, real rate.
    """
    form = solution.form
    factors = solution.factors
    stationary = solution.p
    masses = integrals(form)
    middle = value(MomentWeights(form).of(1, 0), stationary)
    centres = 0.5 * (form.mesh.x_breaks[1:] + form.mesh.x_breaks[:-1])
    q = stationary * np.sign(centres - middle)[:, None, None]
    before = np.inf
    for _ in range(ROUNDS):
        q = q - stationary * np.vdot(masses, q[0])
        q = q / np.abs(q).max()
        u = factors.solve(-form.mass(q))
        u = u - stationary * np.vdot(masses, u[0])
        rate = float(np.vdot(q, q) / np.vdot(q, u))
        if abs(rate - before) <= STILL * abs(rate):
            return rate, u
        before, q = rate, u
    raise SimulationError(refusal("density_without_slow_decay"))


def first_passage(form: WeakForm, x: float) -> float:
    """The rate at which mass is lost of a form that loses some, once the motion has forgotten its beginning.

    A u = -M q is solved by inverse iteration.  A is all but singular if passages are rare, A + c
    c^T with the integrals c of the element around ``x`` is not.  With its solutions s of c and t of
    -M q, and the losses F of both,

        u = t + s (1 - F(t))/F(s).
    """
    factors = Factors(form, pinned(form, x))
    masses = integrals(form)
    loss = form.loss()
    right = np.zeros(form.shape)
    right[0, factors.pin] = factors.chains[0][1].integrals(factors.pin or 0)
    s = factors.solve(right)
    q = s / np.vdot(masses, s[0])
    before = np.inf
    for _ in range(ROUNDS):
        t = factors.solve(-form.mass(q))
        u = t + s * (1.0 - np.vdot(loss, t[0])) / np.vdot(loss, s[0])
        rate = 1.0 / float(np.vdot(masses, u[0]))
        if abs(rate - before) <= STILL * abs(rate):
            return rate
        before = rate
        q = u * rate
    raise SimulationError(refusal("density_without_slow_decay"))


@one_blas_thread
def voltage_spectrum(solution: Solution, frequencies: Sequence[float] | Floats) -> Floats:
    """The two-sided voltage density over the angular frequency, shape (n,)."""
    form, p = solution.form, solution.p
    weights = voltage_weights(form)
    right = -(times_voltage(form, p) - float(np.vdot(weights, p)) * form.mass(p)).astype(complex)
    return np.array(
        [2.0 * np.vdot(weights, Factors(form, None, 1j * w).solve(right)).real for w in frequencies]
    )


def voltage_weights(form: WeakForm) -> Floats:
    """The weights of E[V]."""
    m = MomentWeights(form)
    return m.of(1, 0) if form.modes == 1 else m.of(1, 0) - m.mean(0, 0, 1)


def times_voltage(form: WeakForm, p: Floats) -> Floats:
    """The integrals of V p with every test function; V = x without a load, else x - y."""
    mesh, frame = form.mesh, form.frame
    in_x = mesh.in_x
    voltage = in_x.points if form.modes == 1 else (1.0 - frame.slope) * in_x.points - frame.offset
    made: Floats = products(in_x.weights * voltage, in_x.values, in_x.values) @ p @ form.v_mass.T
    if (
        form.modes > 1
    ):  # z He_k/sqrt(k!) = sqrt(k + 1) He_(k+1)/sqrt((k+1)!) + sqrt(k) He_(k-1)/sqrt((k-1)!)
        root = frame.scale * np.sqrt(np.arange(1.0, form.modes))[:, None, None, None]
        mass = form.mass(p)
        made[1:] -= root * mass[:-1]
        made[:-1] -= root * mass[1:]
    return made
