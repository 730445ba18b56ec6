"""Scenes with exact answers, and the paper's parameters."""

import dataclasses

import numpy as np

from harvester.equations.coefficients import Equations

# The paper's Figures 1 and 2.
PAPER = Equations(alpha=0.5, beta=0.05, mu=0.05, c1=0.01, c2=0.05, c3=0.1, restitution=0.96, n1=0.01, n2=0.01)
# Its E[V^2] by event-driven Monte Carlo, independent of this package: value and standard error.
PAPER_V2 = (0.08814, 6e-5)
# Linear scenes under other shaking than white noise.
DRIVEN = Equations(beta=0.3, mu=0.8, c1=-0.05, drive=0.7, drive_frequency=1.1)
COLOURED = Equations(beta=0.6, mu=0.5, c1=-0.1, coloured=0.02, correlation_time=0.7)
BAND = Equations(beta=0.6, mu=0.5, c1=-0.1, coloured=0.02, centre=1.4, bandwidth=0.5)
# The paper's Figure 7.
FIGURE7 = Equations(c1=0.01, beta=0.04, mu=0.1, n2=0.06, restitution=0.96)


def linear(beta, mu, c=0.05, n1=0.01):
    """A linear scene without a stop."""
    return Equations(beta=beta, mu=mu, c1=-c, n1=n1)


def linear_v2(eqs):
    """E[V^2] of a linear scene: S = N1/[c (1 + beta + mu^2 + c mu) + beta mu] (Lyapunov equation)."""
    c = -eqs.c1
    return eqs.n1 / (c * (1 + eqs.beta + eqs.mu**2 + c * eqs.mu) + eqs.beta * eqs.mu)


def lyapunov(eqs):
    """Stationary covariance of (x, x', V) of a linear scene, from its Lyapunov equation."""
    from scipy.linalg import solve_continuous_lyapunov

    a = np.array([[0.0, 1.0, 0.0], [-1.0, eqs.c1, -eqs.beta], [0.0, 1.0, -eqs.mu]])
    q = np.diag([0.0, 2.0 * eqs.n1, 0.0])
    return solve_continuous_lyapunov(a, -q)


def changed(eqs, **changes):
    """The same equations with some coefficients changed."""
    return dataclasses.replace(eqs, **changes)


def scene(eqs):
    """A nondimensional scene of these equations."""
    import harvester as hv

    names = {"n1": "D11", "n2": "D22", "n12": "D12", "coloured": "D11", "centre": "centre_frequency"}
    table = {names.get(k, k): v for k, v in vars(eqs).items() if v is not None}
    return hv.Scene(nondimensional=hv.Nondimensional(**table))


def z(estimate, exact, exact_error=0.0):
    """z-score of a (value, standard error) against an exact value."""
    value, error = estimate
    return (value - exact) / np.hypot(error, exact_error)


def continuum(eqs):
    """Amplitudes of x and V of the linear scene under F cos(Omega t)."""
    s = 1j * eqs.drive_frequency
    voltage = s / (s + eqs.mu)
    x = eqs.drive / (1.0 + s * s - s * eqs.c1 + eqs.beta * voltage)
    return x, voltage * x
