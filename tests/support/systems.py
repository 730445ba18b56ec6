"""Scenes with exact answers, and the paper's parameters."""

import dataclasses
import itertools
from fractions import Fraction

import numpy as np

import harvester as hv
from harvester.equations.coefficients import Equations
from harvester.linear.solve import solve
from harvester.linear.transfer import amplitudes

# The paper's Figures 1 and 2.
PAPER = Equations(
    alpha=0.5, beta=0.05, mu=0.05, c1=0.01, c2=0.05, c3=0.1, restitution=0.96, n1=0.01, n2=0.01
)
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
    """E[V^2] of a linear scene under any shaking, by the formulas that tests/linear compares with independent ones."""
    return solve(eqs).value


def lyapunov(eqs):
    """Stationary covariance of (x, x', V), and of the filter's (a, b), of a linear scene from its Lyapunov equation.

    Solved in rational numbers, so that nothing is rounded but the result.
    """
    g = {name: Fraction(value) for name, value in vars(eqs).items() if isinstance(value, float)}
    m = [[0, 1, 0], [-1, g.get("c1", 0), -g.get("beta", 0)], [0, 1, -g["mu"]]]
    noise = {(1, 1): 2 * g.get("n1", 0)}
    if eqs.correlation_time is not None:
        m = [[*row, int(k == 1)] for k, row in enumerate(m)] + [
            [0, 0, 0, -1 / g["correlation_time"]]
        ]
        noise[3, 3] = 2 * g["coloured"] / g["correlation_time"] ** 2
    elif eqs.bandwidth is not None:
        filters = [[0, 0, 0, -g["bandwidth"], -g["centre"]], [0, 0, 0, g["centre"], 0]]
        m = [[*row, int(k == 1), 0] for k, row in enumerate(m)] + filters
        noise[3, 3] = 2 * g["coloured"] * g["bandwidth"] ** 2
    pairs = list(itertools.combinations_with_replacement(range(len(m)), 2))
    place = {pair: k for k, (i, j) in enumerate(pairs) for pair in ((i, j), (j, i))}
    rows = [[Fraction(0)] * len(pairs) + [Fraction(-noise.get(pair, 0))] for pair in pairs]
    for row, (i, j) in zip(rows, pairs, strict=True):
        for k in range(len(m)):
            row[place[k, j]] += m[i][k]
            row[place[i, k]] += m[j][k]
    rows[place[1, 1]][0] += 2 * g.get("n2", 0)  # N2 E[x^2] is noise, too
    for k in range(len(rows)):
        pivot = next(row for row in rows[k:] if row[k])
        rows.remove(pivot)
        rows = [
            [a - row[k] / pivot[k] * b for a, b in zip(row, pivot, strict=True)] if row[k] else row
            for row in rows
        ]
        rows.insert(k, [a / pivot[k] for a in pivot])
    return np.array([[float(rows[place[i, j]][-1]) for j in range(len(m))] for i in range(len(m))])


def changed(eqs, **changes):
    """The same equations with some coefficients changed."""
    return dataclasses.replace(eqs, **changes)


def padded(eqs, **more):
    """The same with absent effects at strength zero, and a load where none acts back: they share a compiled kernel.

    test_hard_scenes.py holds that this changes nothing but the last digits.  Left as they were: stop, external noise,
    an open circuit, a stop that nothing presses the mass on, and what ``more`` does not name.
    """
    zeros = dict.fromkeys(("alpha", "c1", "c2", "c3", "n2"), 0.0) | (
        {"mu": 1.0} if eqs.beta is None else {}
    )
    if eqs.restitution is None or eqs.n1 is not None:
        zeros["beta"] = 0.0
    return changed(
        eqs, **{name: value for name, value in (zeros | more).items() if getattr(eqs, name) is None}
    )


def scene(eqs):
    """A nondimensional scene of these equations."""
    import harvester as hv

    names = {
        "n1": "D11",
        "n2": "D22",
        "n12": "D12",
        "coloured": "D11",
        "centre": "centre_frequency",
    }
    table = {names.get(k, k): v for k, v in vars(eqs).items() if v is not None}
    return hv.Scene(nondimensional=hv.Nondimensional(**table))


def z(estimate, exact, exact_error=0.0):
    """z-score of a (value, standard error) against an exact value."""
    value, error = estimate
    return (value - exact) / np.hypot(error, exact_error)


def continuum(eqs):
    """Amplitudes of x and V of the linear scene under F cos(Omega t)."""
    return eqs.drive * amplitudes(eqs, eqs.drive_frequency)


# A beam of two or three modes, each normalised to the tip.
SECOND = hv.Mode(
    frequency="310 Hz", mass="12 g", damping_ratio=0.03, coupling="-5e-3 N/V", base=-0.4
)
THIRD = hv.Mode(
    frequency="880 Hz", mass="9 g", damping_ratio=0.02, coupling="7e-3 N/V", base=0.2, at_stop=-1.0
)
BEAM = hv.Scene(
    oscillator=hv.Oscillator(mass="10 g", frequency="50 Hz", damping_ratio=0.03),
    piezo=hv.Piezo(coupling="2e-3 N/V", capacitance="50 nF"),
    mode=(SECOND,),
    excitation=hv.Excitation(acceleration_psd="1e-4 g^2/Hz"),
    load=hv.Load(resistance="100 kohm"),
)

# A beam of two modes under a sinusoid, whose second is shaken nearly as much as its first.
TWO_MODES = """
[oscillator]
mass = "10 g"
frequency = "50 Hz"
damping_ratio = 0.02
[piezo]
coupling = "2e-3 N/V"
capacitance = "50 nF"
[[mode]]
frequency = "130 Hz"
mass = "12 g"
damping_ratio = 0.02
coupling = "-5e-3 N/V"
base = -0.8
[excitation]
acceleration_amplitude = "0.3 g"
frequency = "50 Hz"
[load]
resistance = "50 kohm"
"""
