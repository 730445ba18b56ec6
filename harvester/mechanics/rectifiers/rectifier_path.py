"""One recorded trajectory with a load circuit of `harvester.mechanics.rectifiers.circuit`, on a noise path."""

import dataclasses
import math

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.compiled import kernel
from harvester.mechanics.kernels.moments import Moments, from_path
from harvester.mechanics.kernels.offset_stops import kick_at_stops
from harvester.mechanics.kernels.path import COLUMNS, Path, between_kicks, check_start, coefficients, room_for_impacts
from harvester.mechanics.kernels.shaking import forcing
from harvester.mechanics.rectifiers.circuit import IdealCircuit, advance_to_last_event, conducted


@dataclasses.dataclass(frozen=True)
class IdealPath(Path):
    """A `Path` with the capacitor's voltage ``U`` at its readings, shape (n, 2): at the kick and in mid-drift."""

    U: Floats


@kernel
def _trace(
    noise, shaking, x, v, V, U, h, stride, readings, charge, impacts,
    mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
    r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops,
):  # fmt: skip
    m, count = x, 0
    # From a start other than rest half a kick comes first: the force of the first half step.
    _, a = between_kicks(shaking, 0)
    v = kick_at_stops(x, v, V, 0.0, 0.5 * h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a)
    for k in range(1, len(readings) * stride + 1):
        mean, a = between_kicks(shaking, k)
        x, v, V, U, m, w, left, first, speed, _, _ = advance_to_last_event(
            x, v, V, U, m, h, h, r, beta, n1, stops, mean,
            mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
        )  # fmt: skip
        V, U = conducted(V, U, w, left, mu, kappa, n, leak, loss, bridge, doubler)
        if speed != 0.0:
            impacts[count, 0], impacts[count, 1] = (k - 1) * h + first, speed
            count += 1
        xi = 0.0
        if n1 is not None or n2 is not None:
            xi = noise[k - 1]
        v = kick_at_stops(x, v, V, xi, h, r, alpha, beta, c1, c2, c3, n1, n2, n12, linear, alpha2, stops, a)
        if k % stride == 0:
            row = readings[k // stride - 1]
            xm, vm, Vm, Um, _m, w, left, _, _, _, _ = advance_to_last_event(
                x, v, V, U, m, h, 0.5 * h, r, beta, n1, stops, a,
                mu, kappa, n, leak, loss, bridge, doubler, play, parallel, series, sece,
            )  # fmt: skip
            Vm, Um = conducted(Vm, Um, w, left, mu, kappa, n, leak, loss, bridge, doubler)
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
    shaking: Floats | None = None,
) -> IdealPath:
    """The trajectory of Eq. 2 with a load circuit from ``start`` = (x, x', V, voltage of its capacitor).

    ``noise``, ``h``, ``stride`` and ``shaking`` as of `harvester.mechanics.kernels.path.trace`.

    Raises InputError for a start behind a stop, and random shaking without ``shaking``.
    """
    check_start(eqs.rigid_stops, start[0], start[0])
    readings = np.empty((len(noise) // stride, len(COLUMNS)))
    charge = np.empty((len(readings), 2))
    impacts = room_for_impacts(eqs, len(noise))
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    found = readings, charge, impacts
    count = _trace(noise, shaking, *start, h, stride, *found, *circuit.arguments, *coefficients(eqs)[1:])
    return IdealPath(h, stride, readings, impacts[:count].copy(), shaking, charge)


def ideal_moments(
    eqs: Equations,
    circuit: IdealCircuit,
    noise: Floats,
    h: float,
    stride: int,
    discard: float,
    batches: int = 1,
    start: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    shaking: Floats | None = None,
) -> Moments:
    """Moments of the trajectory from ``start`` after the time ``discard``, one entry a batch; see `from_path`."""
    path = trace_ideal(eqs, circuit, noise, h, stride, start, shaking)
    first = math.ceil(discard / (h * stride) - 1e-6)
    rows = (len(path.U) - first) // batches
    power = circuit.mu * path.U[first : first + rows * batches] ** 2
    moments = from_path(eqs, path, discard, batches)
    return dataclasses.replace(moments, load=power.reshape(batches, -1).mean(axis=1))
