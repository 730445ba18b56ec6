"""The second-order terms of averaging with a stop: a correction of E[V^2], and the remaining error.

Averaging is of first order in the change over one cycle.  Three small numbers state how much that
is: the fraction i of the energy that impacts dissipate in a cycle, the fraction q that the piezo
holds, and the
load m = mu T/pi over a cycle of T. The next order was measured, not derived.  On 300 random scenes
(`benchmarks/accuracy.py`; r from 0.3 to 1, beta from 0.02 to 10, mu from 0.02 to 10) the logarithm
of the true E[V^2] over the averaged one is

    k = (0.056 + 0.077/(1 + m)) i^2 - 0.11 q (1 + 3 i)/(1 + (q/0.2)^4)

Its first part is that of weak coupling: an impact that dissipates much of the energy makes
each cycle lopsided and spreads the energies of the cycles, both of which the voltage squared feels.
E[V^2] is multiplied by exp(k).
"""

import numpy as np

from harvester.arrays import Floats

_LARGEST = 1.7  # impact loss up to which the correction was measured: r = 0.3 without friction


def correction(impact_loss: Floats, stored: Floats, load: Floats) -> Floats:
    """The factor exp(k) on E[V^2]; all arrays of one shape, ``load`` is m."""
    i = np.minimum(impact_loss, _LARGEST)
    q = stored
    k = (0.056 + 0.077 / (1.0 + load)) * i**2 - 0.11 * q * (1.0 + 3.0 * i) / (1.0 + (q / 0.2) ** 4)
    return np.asarray(np.exp(k))


def stated_error(impact_loss: Floats, stored: Floats, friction: Floats) -> Floats:
    """Relative error left in E[V^2].

    ``friction`` is the fraction o of the energy that friction dissipates in a cycle.

        0.005 + 0.03 i + 0.02 i^2 + 0.01 o^2 + 0.2 q (1 + i) + min(8 (q - 0.22) (i + 0.1), 1)

    the last term if q is above 0.22: a piezo that holds so much changes the motion.  Not exceeded
    in the 600 scenes by which it was chosen, nor in 215 others.
    """
    i = np.minimum(impact_loss, _LARGEST)
    q = stored
    o = np.minimum(friction, 1.5)
    # where the piezo holds too much
    beyond = np.minimum(8.0 * np.maximum(q - 0.22, 0.0) * (i + 0.1), 1.0)
    return np.asarray(0.005 + 0.03 * i + 0.02 * i**2 + 0.01 * o**2 + 0.2 * q * (1.0 + i) + beyond)


def amplified(friction: Floats, exchange: Floats) -> Floats:
    """The factor on a stated error if the damping is negative and ``friction``, its fraction of the energy, feeds.

    Impacts and load then dissipate the energy of friction and noise.  The noise alone balances an
    error of the dissipated energy, and gives the fraction ``exchange`` in a cycle, so that the
    relative error is 1 + max(-friction, 0)/exchange times as large.
    """
    return np.asarray(1.0 + np.maximum(-friction, 0.0) / exchange)


def stated_error_distant(
    impact_loss: Floats,
    stored: Floats,
    friction: Floats,
    load: Floats,
    exchange: Floats,
    touching: Floats,
) -> Floats:
    """Relative error that is left in E[V^2] with a stop at a distance.

    ``touching`` is the probability of an impact.

    Orbits that meet the stop and free ones have an error each; if both are likely, there is that of
    a voltage which remembers the other kind.  ``load`` and ``exchange`` are the energies that the
    load dissipates and the noise brings
    in a cycle.  The constants are the least, by a linear program, that cover 131 random scenes of
    engine `density` 1.6 times, and a quarter more (`benchmarks/averaged_error.py`): a slow load
    with strong coupling is a spring that relaxes slowly, of which averaging knows the mean only, 19
    % too high at worst.
    """
    i = np.minimum(impact_loss, _LARGEST)
    q = stored
    o = np.minimum(friction, 1.5)
    taken = np.minimum(load, 1.5)
    beyond = np.maximum(q - 0.22, 0.0)
    impacting = 0.003 + 0.051 * i + 0.034 * i**2 + 1.4 * q * i + np.minimum(15.0 * beyond * i, 1.0)
    free = 0.002 + 0.01 * np.minimum(exchange, 1.0) + 0.01 * q + 0.2 * beyond
    mixed = 4.0 * touching * (1.0 - touching) * (0.003 + 0.05 * taken + 0.145 * o**2)
    return np.asarray(touching * impacting + (1.0 - touching) * free + mixed)


def stated_error_preloaded(
    impact_loss: Floats,
    stored: Floats,
    friction: Floats,
    load: Floats,
    slowness: Floats,
    pressed: Floats,
) -> Floats:
    """Relative error that is left in E[V^2] with a preload.

    ``slowness`` is m, the load over a cycle.

    ``pressed`` is the fraction of the energy that the spring holds at the stop.  With a strong
    preload E[V^2] varies as the square of the energy; and a strong coupling with a slow load lifts
    the mass off its stop, by small free orbits
    that are left out: E[V^2] is more than twice too high at worst.  Constants as in
    `stated_error_distant`, of 69 scenes, with the quarter, without which 2 of 38 others were
    outside, by up to 5 % of the bound.
    """
    i = np.minimum(impact_loss, _LARGEST)
    q = stored
    o = np.minimum(friction, 1.5)
    taken = np.minimum(load, 1.5)
    lifted = (3.0 + 15.0 / (1.0 + slowness)) * q**2
    spring = pressed * (0.43 * i + 0.36 * i**2)
    impacting = 0.029 * i**2 + 0.18 * o**2 + 0.08 * taken**2 + spring
    return np.asarray(1.25 * (0.003 + impacting + lifted))
