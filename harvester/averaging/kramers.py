"""How often white noise carries the mass out of a well: Kramers' rate, from weak to strong damping.

The mass in a well of the depth U, under the damping g and white noise 2 N, has the "temperature" T
= N/g, and leaves at

    k = A K w/(2 pi) exp(-U/T),   K = (sqrt(g^2/4 + wb^2) - g/2)/wb

with the frequencies w of the well's bottom and wb of the barrier's top.  K is Kramers' factor of
strong damping; for weak damping it is the energy lost in a cycle at the barrier's height, g S,
over T, that decides:

    A(d) = exp[1/pi integral_0^inf ln(1 - exp(-d (z^2 + 1/4)))/(z^2 + 1/4) dz],   d = g S/T,   S = contour of x' dx

which is d if that is small (Kramers' rate of weak damping) and 1 if it is large; for two wells
next to each other it is A(d1) A(d2)/A(d1 + d2), as a mass that leaves one may come back from the
other.  For U above some T. (Kramers, Physica 7, 284, 1940; Mel'nikov and Meshkov, J. Chem. Phys.
85, 1018, 1986.)
"""

import math
from typing import Any

import numpy as np

from harvester.equations.bounds import barriers, flow
from harvester.equations.coefficients import Equations
from harvester.equations.effects import HOPPING, unknown_to

WEAK = 0.1  # of the coupling beta
NODES = 20_000  # of the integrals: A(d) has a layer of the width sqrt(d)


def hopping_rates(eqs: Equations) -> tuple[float, float] | None:
    """The rates, in w0, at which the mass leaves the left of two wells, and the right one.

    None if not known.

    The damping is that of small motions in a well, the load's included.  That its voltage raises the barrier is left
    out, so that rates come out up to three times too high at a coupling of `WEAK`, beyond which they are not given.
    """
    rests = eqs.resting_places
    tops = barriers(eqs)
    simple = unknown_to(HOPPING).isdisjoint(eqs.effects)
    if (
        len(rests) != 2
        or eqs.n1 is None
        or not simple
        or (eqs.beta or 0.0) > WEAK
        or (eqs.beta and eqs.mu is None)
    ):
        return None
    top = float(tops[0])
    barrier = math.sqrt(-_stiffness(eqs, top))
    losses = []
    temperatures = []
    damping = []
    frequencies = []
    for rest in rests:
        frequency, taken = _small_motion(eqs, rest)
        if taken <= 0.0:
            return None
        damping.append(taken)
        frequencies.append(frequency)
        temperatures.append(eqs.n1 / taken)
        losses.append(taken * _action(eqs, rest, top) / temperatures[-1])
    both = taken_up(losses[0]) * taken_up(losses[1]) / taken_up(losses[0] + losses[1])
    left, right = (
        both
        * (math.sqrt(0.25 * g * g + barrier**2) - 0.5 * g)
        / barrier
        * w
        / (2.0 * math.pi)
        * math.exp(-(_energy(eqs, top) - _energy(eqs, rest)) / temperature)
        for rest, g, w, temperature in zip(rests, damping, frequencies, temperatures, strict=True)
    )
    return left, right


def taken_up(d: float) -> float:
    """A(d) of the module, by z = tan(t)/2.

    >>> round(taken_up(1e-3) / 1e-3, 2), round(taken_up(50.0), 3)
    (0.97, 1.0)
    """
    angle = (np.arange(NODES) + 0.5) * (0.5 * math.pi / NODES)
    return math.exp(float(np.log(-np.expm1(-d / (4.0 * np.cos(angle) ** 2))).mean()))


def _energy(eqs: Equations, x: Any) -> Any:
    """The spring's energy at x."""
    linear, alpha2, alpha = eqs.spring
    return x * x * (linear / 2.0 + x * (alpha2 / 3.0 + x * alpha / 4.0))


def _stiffness(eqs: Equations, x: float) -> float:
    """The slope of the spring's force at x."""
    linear, alpha2, alpha = eqs.spring
    return linear + x * (2.0 * alpha2 + 3.0 * alpha * x)


def _small_motion(eqs: Equations, x: float) -> tuple[float, float]:
    """Frequency and damping of small motions about a place, (w, g) of exp(-g t/2) cos(w t); g of 0 if none turns."""
    matrix = flow(eqs)
    matrix[1, 0] = -_stiffness(eqs, x)
    values = np.linalg.eigvals(matrix)
    turning = values[np.argmax(values.imag)]
    return abs(float(turning.imag)), -2.0 * float(turning.real) if turning.imag else 0.0


def _action(eqs: Equations, rest: float, top: float) -> float:
    """S, the contour of x' dx in a well, at the energy of the barrier's ``top``."""
    linear, alpha2, alpha = eqs.spring
    roots = np.roots([alpha / 4.0, alpha2 / 3.0, linear / 2.0, 0.0, -_energy(eqs, top)])
    beyond = [
        float(root.real)
        for root in roots
        if abs(root.imag) < 1e-9 and (root.real - rest) * (rest - top) > 0.0
    ]
    end = min(beyond, key=lambda x: abs(x - rest))
    angle = (np.arange(NODES) + 0.5) * (math.pi / NODES)
    x = 0.5 * (top + end) + 0.5 * (end - top) * np.cos(angle)
    speed = np.sqrt(np.maximum(2.0 * (_energy(eqs, top) - _energy(eqs, x)), 0.0))
    return float(2.0 * (speed * np.sin(angle)).sum() * 0.5 * abs(end - top) * math.pi / NODES)
