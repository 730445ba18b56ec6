"""How much later mass and circuit from rest charge a storage capacitor than the mean current does: `charge_delay`.

The mean current flows from the beginning, and follows the voltage at once.  The current of a mass
that rings up comes later, lags behind the rising voltage, and fluctuates.  Each of these changes the
time by an amount that does not depend on the capacitance to first order in the ratio of the time
scales, so that a smaller storage capacitor shows it soon.

A held storage capacitor on the same noise, with a mass that is burnt in, is the control variate: its
voltage follows the charge at twice the speed, and back, so that its lag cancels.  The difference
between its charge and the table's has the table's error, which cancels to first order.

Three model errors are stated.  A smaller capacitor, charged in T, has a relative error of tau/T of
second order, with tau the time constant of the mass.  Beyond the highest voltage V that is
compared, up to V', the lag changes the time by up to tau log(net(V)/net(V')).  A charge that has
not arrived is extrapolated, and counts with the time by which it is.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.noise import child
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_stores import StoresOfMany, enough_runs
from harvester.storage.measured_current import FADED, RUNS, Rectifier, time_constant
from harvester.storage.rectified_current import LONGER, RectifiedCurrent, random_paths, reached
from harvester.uncertainty.value import Value, mean_and_error

DIRECT = 25.0  # time constants of the mass that a charge takes, at most
FEWER = 128  # runs of a netlist's own elements
LOOK = 0.25  # time constants of the mass between two looks
SLICES = 16  # steps up, and as many back
FAINT = 0.1  # least net current of a compared time, over the largest
PATHS = 2048  # random ones


class ChargeDelay(NamedTuple):
    """The delay (s) of a charge, in the ``seconds`` of a direct run, with the steps of all runs.

    ``late`` has the sampling error and a model error.
    """

    late: Value
    seconds: float
    steps: int


def charge_delay(
    problem: Problem,
    table: RectifiedCurrent,
    top: float,
    load: tuple[float, float],
    seed: int,
    h: float | None = None,
) -> ChargeDelay:
    """The delay of first passages of ``top`` (V) from rest behind those by a ``table``, on average.

    It is 0, without a direct run, if the mean current does not charge a storage capacitor at all.

        late = E[T + sum (Q_k - I(v_k) t_k)/(I(v_k) - v_k/R)] - E[S]

    T is when the storage capacitor of a direct run reaches V, S when a random course that begins at
    once does (`harvester.storage.rectified_current.random_paths`), and Q_k the charge that the held
    one gains at v_k in the time t_k.  V is ``top``, or the highest voltage below it with more than
    `FAINT` of the largest net current.  The ``load`` is a capacitance (F), which is reduced until V
    is reached in `DIRECT` time constants, and a resistance (ohm).
    """
    eqs, scales = problem.equations, problem.scales
    farads, ohm = load
    rectifier = Rectifier(problem)
    table = replace(table, ring_up=0.0)
    volts, times = reached(table, top, farads, ohm)
    net = table.at(volts) - volts / ohm
    last = int(np.flatnonzero(net > FAINT * net.max(initial=0.0)).max(initial=0))
    if not times[: last + 1].any():
        return ChargeDelay(Value(0.0, 0.0, model=0.0), 0.0, 0)
    unit = time_constant(eqs) / scales.frequency
    factor = min(1.0, DIRECT * unit / float(times[last]))
    expected = factor * float(times[last])
    step = step_from_rest(eqs) if h is None else h
    count = enough_runs(eqs, RUNS if rectifier.ideal else FEWER)
    root = np.random.SeedSequence([seed, 17])
    highest = float(volts[last])

    free = rectifier.fast(factor * farads, ohm)
    direct = Trajectories(eqs, count, root, step, circuit=free)
    stores = StoresOfMany(direct, free, factor * farads, scales)
    took, extrapolated = _passages(stores, highest, (expected, unit))
    circuit = rectifier.fast(rectifier.held)
    burnt = Trajectories(eqs, count, child(root, 1), step, circuit=circuit)
    StoresOfMany(burnt, circuit, rectifier.held, scales).advance(
        0.0, FADED * unit * scales.frequency
    )
    runs = Trajectories(eqs, count, root, step, circuit=circuit)
    runs.state[:] = burnt.state
    held = StoresOfMany(runs, circuit, rectifier.held, scales)
    up = np.interp((np.arange(SLICES) + 0.5) / SLICES * float(times[last]), times, volts)
    for v in map(float, [*up, *up[::-1]]):
        gained = held.advance(v, expected * scales.frequency / (2 * SLICES))
        current = float(table.at(np.array(v)))
        took = took + (gained.charges - current * gained.seconds) / (current - v / ohm)
    mean, error = mean_and_error(took.reshape(-1, runs.together).mean(axis=1))
    courses, of_courses = _of_paths(table, highest, (factor * farads, ohm), expected, seed)
    of_paths, error_of_paths = mean_and_error(courses)
    seconds = mean - of_paths
    model = extrapolated + of_courses + (abs(seconds) * unit / expected if factor < 1.0 else 0.0)
    model += unit * math.log(float(net[last] / net[net > 0.0][-1]))
    dof = runs.count / runs.together - 1.0
    late = Value(seconds, math.hypot(error, error_of_paths), model=model, dof=dof)
    return ChargeDelay(late, expected, direct.steps + burnt.steps + runs.steps)


def _passages(
    stores: StoresOfMany, volts: float, times: tuple[float, float]
) -> tuple[Floats, float]:
    """When each of the ``stores`` first reaches so many ``volts`` (s), by a straight line between two looks.

    ``times`` are the expected one, `LONGER` times which it is extrapolated, and the mass's time
    constant.  The second answer is as that of `_extrapolated`.
    """
    expected, unit = times
    passages = np.full(stores.runs.count, math.inf)
    now = 0.0
    before = stores.volts
    while now < LONGER * expected and np.isinf(passages).any():
        seconds = stores.advance(
            None, min(LOOK * unit, expected / SLICES) * stores.scales.frequency
        ).seconds
        after = stores.volts
        new = np.isinf(passages) & (after >= volts)
        passages[new] = now + seconds * (volts - before[new]) / (after[new] - before[new])
        now = now + seconds
        before = after
    return _extrapolated(passages, before / volts, now)


def _of_paths(
    table: RectifiedCurrent, volts: float, load: tuple[float, float], expected: float, seed: int
) -> tuple[Floats, float]:
    """First passages of random courses (s), extrapolated as those of direct runs."""
    from harvester.cosimulation.charging import first_passages

    farads, ohm = load
    t, paths = random_paths(
        table, farads, ohm, top=volts, end=LONGER * expected, count=PATHS, seed=seed, coarse=False
    )
    times = np.array([first_passages(t, path, np.array([volts])) for path in paths])
    return _extrapolated(times.ravel(), paths[:, -1] / volts, float(t[-1]))


def _extrapolated(passages: Floats, shares: Floats, end: float) -> tuple[Floats, float]:
    """Infinite ``passages`` on a line from rest to ``shares`` of the voltage at the ``end`` (s).

    They are at `LONGER` times the end at most.  The second answer is the mean time (s) that this
    adds behind the end.
    """
    line = end / np.clip(shares, 1.0 / LONGER, 1.0)
    whole = np.where(np.isinf(passages), line, passages)
    return whole, float(np.where(np.isinf(passages), line - end, 0.0).mean())
