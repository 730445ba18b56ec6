"""One recorded trajectory: displacement, velocity, voltage and impacts on a noise path, with any load."""

from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.errors import invalid
from harvester.mechanics.kernels.coefficients import State, coefficients
from harvester.mechanics.kernels.compiled import inlined, kernel
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit, Store, fly
from harvester.mechanics.kernels.intervals import EXACT, drifts, update_of
from harvester.mechanics.kernels.offset_stops import kick_at_stops

# Columns of a record: at a kick x and V, half a step later x, x' and V.
COLUMNS = ("x_kick", "V_kick", "x", "v", "V")


@dataclass(frozen=True)
class Path:
    """A recorded trajectory, nondimensional, sampled after every ``stride``-th kick.

    Kick k happens at the time k h; its sample holds x and V at the kick and x, v, V half a
    step later, at ``t`` (shape (n,)).  ``impacts`` has one row an impact: its time and the
    speed just before, negative at the opposite stop, shape (m, 2); of several within one drift only the first.
    ``shaking`` has the accelerations at the times 0, h, ... of what else than white noise shook the mass; ``U``, shape
    (n, 2), the voltage of a load circuit's capacitor at the kick and half a step later.
    """

    h: float
    stride: int
    samples: Floats
    impacts: Floats
    shaking: Floats | None
    U: Floats | None = None

    @property
    def t(self) -> Floats:
        """Times of the samples x, v and V in mid-drift; those at the kicks are h/2 earlier."""
        return np.asarray(
            (np.arange(1, len(self.samples) + 1) * self.stride + 0.5) * self.h, dtype=np.float64
        )

    @property
    def x(self) -> Floats:
        """Displacement in mid-drift."""
        return self.samples[:, 2]

    @property
    def v(self) -> Floats:
        """Velocity in mid-drift."""
        return self.samples[:, 3]

    @property
    def V(self) -> Floats:  # noqa: N802 - the paper's symbol
        """Voltage in mid-drift."""
        return self.samples[:, 4]


@inlined
def between_kicks(shaking, k):
    """The shaking's acceleration: its mean over the drift before kick k, and at that kick; None if there is none."""
    if shaking is None:
        return None, None
    return 0.5 * (shaking[max(k - 1, 0)] + shaking[k]), shaking[k]


@kernel
def _trace(noise, shaking, s, store, h, stride, samples, charge, impacts, update, c, circuit):
    """Fill samples, the charge of a circuit and impacts, whose number is returned."""
    whole, half = drifts(h, c.mu, update)
    count = 0
    landed = 0.0
    if (
        update.weight is None
    ):  # from a start other than rest half a kick comes first: the force of the first half step
        _, a = between_kicks(shaking, 0)
        s = State(s.x, kick_at_stops(s, 0.0, 0.5 * h, c, a), s.V)
    for k in range(1, len(samples) * stride + 1):
        mean, a = between_kicks(shaking, k)
        if update.weight is None:
            s, store, did = fly(s, store, whole, c, circuit, mean)
        else:
            s, store, did = fly(s, store, half if landed > 0.0 else whole, c, circuit, mean)
        count = _note(impacts, count, (k - 1) * h + landed, did)
        landed = 0.0
        s = State(s.x, kick_at_stops(s, noise[k - 1], h, c, a), s.V)
        if k % stride == 0:
            row = samples[k // stride - 1]
            row[0], row[1] = s.x, s.V
            mid, store_mid, did = fly(s, store, half, c, circuit, a)
            row[2], row[3], row[4] = mid
            if circuit is not None:
                charge[k // stride - 1, 0], charge[k // stride - 1, 1] = store.U, store_mid.U
            if update.weight is not None:  # ngspice lands there, and goes on
                s = mid
                landed = half.t
                count = _note(impacts, count, k * h, did)
    return count


@inlined
def _note(impacts, count, begin, did):
    """Note the first impact of a drift from ``begin``, if there is one, and how many have been noted."""
    if did.speed == 0.0:
        return count
    impacts[count, 0] = begin + did.time
    impacts[count, 1] = did.speed
    return count + 1


def trace(
    eqs: Equations,
    noise: Floats,
    h: float,
    stride: int = 1,
    start: tuple[float, ...] | None = None,
    shaking: Floats | None = None,
    circuit: IdealCircuit | None = None,
    ngspice_rule: bool = False,
) -> Path:
    """The trajectory of Eq. 2 from ``start`` on a noise path, with the exact RC update.

    ``noise`` has one standard normal variate a kick (`harvester.mechanics.kernels.noise.gaussian_grid`); its length,
    rounded down to the stride, is the number of steps of length ``h``.  All nondimensional.  ``start`` is (x, x', V),
    with a ``circuit`` also the voltage of its capacitor; None is at rest in the first of `resting_places`.
    ``shaking``, shape (len(noise) + 1,), has the accelerations at the times 0, h, ... of what else shakes the mass;
    None: `harvester.mechanics.kernels.forcing.forcing`.  With ``ngspice_rule`` the resistor follows ngspice's
    integration rule, from rest (`harvester.mechanics.kernels.ngspice_rule`).

    Without noise the path is of second order in h (against a compliant stop only where h resolves the contact: else
    of first).  With noise, variate k belongs to the time from
    (k - 1) h to k h while its kick comes at k h, half a step late: paths of different steps on one
    refined noise are compared at equal k h, and a start other than rest is half a step early.

    Raises InputError for a start behind a stop, and coloured noise without ``shaking``.
    """
    x, v, V, U = ((*start, 0.0) if start is not None else (eqs.resting_places[0], 0.0, 0.0, 0.0))[
        :4
    ]
    check_start(eqs.rigid_stops, x, x)
    samples = np.empty((len(noise) // stride, len(COLUMNS)))
    charge = None if circuit is None else np.empty((len(samples), 2))
    impacts = room_for_impacts(eqs, len(noise))
    shaking = forcing(eqs, h, len(noise)) if shaking is None else shaking
    store = None if circuit is None else Store(float(U), float(x))
    begin = State(float(x), float(v), float(V))
    update = update_of(eqs, h, ngspice_rule) if ngspice_rule else EXACT
    records = samples, charge, impacts
    count = _trace(
        noise, shaking, begin, store, h, stride, *records, update, coefficients(eqs), circuit
    )
    return Path(h, stride, samples, impacts[:count].copy(), shaking, charge)


def check_start(stops: tuple[float, float], least: float, most: float) -> None:
    """Raise InputError unless all starts, x from ``least`` to ``most``, are between the rigid ``stops``."""
    low, high = stops
    if least < low:
        raise invalid("start", f"have x of at least {low:g}, where the stop is", least)
    if most > high:
        raise invalid("start", f"have x of at most {high:g}, where the opposite stop is", most)


def room_for_impacts(eqs: Equations, steps: int) -> Floats:
    """An empty table of impacts, large enough for two a step."""
    stop = eqs.restitution is not None or eqs.stop_stiffness is not None
    return np.empty((2 * steps + 2 if stop else 0, 2))
