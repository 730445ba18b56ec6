"""The functionals of a density: means of squares and products, impact rate and impact loss."""

import numpy as np

from harvester.arrays import Floats
from harvester.density.moment_weights import MomentWeights
from harvester.density.weak_form import WeakForm
from harvester.equations.coefficients import Equations

NAMES = (
    "voltage_squared",
    "displacement",
    "displacement_squared",
    "velocity_squared",
    "displacement_voltage",
    "velocity_voltage",
    "impact_rate",
    "opposite_impact_rate",
    "impact_loss",
)


def functionals(eqs: Equations, form: WeakForm) -> Floats:
    """The weights of all `NAMES` on a density: shape (names, values of the density).

    ``impact_rate`` counts the impacts at the stop in unit time, or the contacts with a compliant
    one, and ``impact_loss`` is the energy that rigid stops dissipate in unit time.
    """
    m = MomentWeights(form)
    if form.modes == 1:
        products = [m.of(2, 0), m.of(1, 1)]
    else:
        products = [m.of(2, 0) - m.mean(1, 0, 1), m.of(1, 1) - m.mean(0, 1, 1)]
    low, high = (np.zeros(form.shape) for _ in range(2))
    loss = np.zeros(form.shape)
    down, up = (form.over_v(half) for half in (-form.v_down, form.v_up))
    if eqs.restitution is not None:
        low[0, 0, 0] = down
        loss[0, 0, 0] = 0.5 * (1.0 - eqs.restitution**2) * m.speed_cubed(-1.0)
    elif eqs.stop_stiffness is not None:
        edge = int(np.argmin(np.abs(form.mesh.x_breaks + (eqs.gap or 0.0))))
        low[0, edge, 0] = down
    if eqs.opposite_restitution is not None:
        high[0, -1, -1] = up
        loss[0, -1, -1] += 0.5 * (1.0 - eqs.opposite_restitution**2) * m.speed_cubed(1.0)
    weights = [m.voltage_squared(), m.of(1, 0), m.of(2, 0), m.of(0, 2), *products, low, high, loss]
    return np.array([weight.ravel() for weight in weights])
