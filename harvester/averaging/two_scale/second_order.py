"""What averaging leaves out with a stop, to second order: a correction of E[V^2], and the error that is left.

Averaging is of first order in what one cycle changes.  Three small numbers say how much that is: the share i of the
energy that impacts take in a cycle, the share q that the piezo holds, and the load m = mu T/pi over a cycle of T.
The next order was measured, not derived.  On 300 random scenes (`benchmarks/accuracy.py`; r from 0.3 to 1, beta
from 0.02 to 10, mu from 0.02 to 10) the logarithm of the true E[V^2] over the averaged one is

    k = (0.056 + 0.077/(1 + m)) i^2 - 0.11 q (1 + 3 i)/(1 + (q/0.2)^4)

of which the first part is that of weak coupling: an impact that takes much of the energy makes each cycle lopsided and
spreads the energies of the cycles, both of which the voltage squared feels.  E[V^2] is multiplied by exp(k).
"""

import numpy as np

from harvester.arrays import Floats

_LARGEST = 1.7  # impact loss up to which the correction was measured: r = .3 without friction


def correction(impact_loss: Floats, stored: Floats, load: Floats) -> Floats:
    """The factor exp(k) on E[V^2]; all arrays of one shape, ``load`` is m."""
    i, q = np.minimum(impact_loss, _LARGEST), stored
    k = (0.056 + 0.077 / (1.0 + load)) * i**2 - 0.11 * q * (1.0 + 3.0 * i) / (1.0 + (q / 0.2) ** 4)
    return np.asarray(np.exp(k))


def stated_error(impact_loss: Floats, stored: Floats, friction: Floats) -> Floats:
    """Relative error that is left in E[V^2]; ``friction`` is the share o of the energy that friction takes in a cycle.

        .005 + .03 i + .02 i^2 + .01 o^2 + .2 q (1 + i) + min(8 (q - .22) (i + .1), 1)

    the last term where q is above .22: a piezo that holds so much makes the motion another one.  Not exceeded in the
    600 scenes by which it was chosen, nor in 215 others.
    """
    i, q, own = np.minimum(impact_loss, _LARGEST), stored, np.minimum(friction, 1.5)
    beyond = np.minimum(8.0 * np.maximum(q - 0.22, 0.0) * (i + 0.1), 1.0)  # where the piezo holds too much
    return np.asarray(0.005 + 0.03 * i + 0.02 * i**2 + 0.01 * own**2 + 0.2 * q * (1.0 + i) + beyond)
