"""One recorded trajectory with a load circuit of `harvester.mechanics.rectifiers.circuit`, on a noise path."""

import dataclasses
import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import invalid
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.moments import Moments, from_path
from harvester.mechanics.kernels.path import COLUMNS, Path, coefficients, room_for_impacts
from harvester.mechanics.rectifiers.circuit import IdealCircuit, conducted, until_free


@dataclasses.dataclass(frozen=True)
class IdealPath(Path):
    """A `Path` with the capacitor's voltage ``U`` at its readings, shape (n, 2): at the kick and in mid-drift."""

    U: Floats


@kernel
def _trace(
    noise, x, v, V, U, h, stride, readings, charge, impacts,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
    r, alpha, beta, c1, c2, c3, n1, n2, n12,
):  # fmt: skip
    m, count = x, 0
    # From a start other than rest half a kick comes first: the force of the first half step.
    v = kick(x, v, V, 0.0, 0.5 * h, alpha, beta, c1, c2, c3, n1, n2, n12)
    for k in range(1, len(readings) * stride + 1):
        before = x, v
        x, v, V, U, m, left, hit = until_free(
            x, v, V, U, m, h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
        )
        V, U = conducted(V, U, v, left, mu, kappa, n, leak, loss, bridge, doubler)
        if hit > 0.0:
            impacts[count, 0] = (k - 1) * h - before[0] / before[1]
            impacts[count, 1] = hit
            count += 1
        v = kick(x, v, V, noise[k - 1], h, alpha, beta, c1, c2, c3, n1, n2, n12)
        if k % stride == 0:
            row = readings[k // stride - 1]
            xm, vm, Vm, Um, _m, left, _hit = until_free(
                x, v, V, U, m, 0.5 * h, r, mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece
            )
            Vm, Um = conducted(Vm, Um, vm, left, mu, kappa, n, leak, loss, bridge, doubler)
            row[0], row[1], row[2], row[3], row[4] = x, V, xm, vm, Vm
            charge[k // stride - 1, 0], charge[k // stride - 1, 1] = U, Um
    return count


def trace_ideal(
    eqs: Equations,
    circuit: IdealCircuit,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> IdealPath:
    """The trajectory of Eq. 2 with a load circuit from ``start`` = (x, x', V, voltage of its capacitor).

    ``noise``, ``h`` and ``stride`` as of `harvester.mechanics.kernels.path.trace`.

    Raises InputError for a start behind the stop.
    """
    if eqs.restitution is not None and start[0] < 0.0:
        raise invalid("start", "have x of at least 0, where the stop is", start[0])
    readings = np.empty((len(noise) // stride, len(COLUMNS)))
    charge = np.empty((len(readings), 2))
    impacts = room_for_impacts(eqs, len(noise))
    count = _trace(noise, *start, h, stride, readings, charge, impacts, *circuit.arguments, *coefficients(eqs)[1:10])
    return IdealPath(h, stride, readings, impacts[:count].copy(), None, charge)


def ideal_moments(
    eqs: Equations,
    circuit: IdealCircuit,
    noise: Floats,
    h: float,
    stride: int,
    discard: float,
    batches: int = 1,
    start: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> Moments:
    """Moments of the trajectory from ``start`` after the time ``discard``, one entry a batch; see `from_path`."""
    path = trace_ideal(eqs, circuit, noise, h, stride, start)
    first = math.ceil(discard / (h * stride) - 1e-6)
    rows = (len(path.U) - first) // batches
    power = circuit.mu * path.U[first : first + rows * batches] ** 2
    moments = from_path(eqs, path, discard, batches)
    return dataclasses.replace(moments, load=power.reshape(batches, -1).mean(axis=1))
