"""The mean power of a chip's load, from the rectifier's current: hours of the slow circuit, and some of both together.

The slow circuit runs from empty until its mean power changes no more.  Its errors are measured: by the rectifier's
current at twice the step and at half of the voltages, by slow steps of twice the length and a larger tolerance, and by
a direct run of mass and circuit from rest, on the same shaking, of `DIRECT` time constants of the mass.  What that
differs by is added to the mean (two levels), and is the error of the separation of time scales.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.measured_current import HELD, measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import STORE, Cut
from harvester.storage.slow_circuit import TOLERANCE, SlowCircuit, SlowPath

FINER = 256.0  # slow steps to a time constant of the mass
FIRST, CHARGES = 500.0, 8.0  # time constants of the mass, and times to charge the store, of the first slow run
SETTLED, MOST = 3e-3, 4e6  # relative change of the mean power from a part of the run to the next; slow steps
DIRECT = 150.0
ROUGHER = 4.0  # times the tolerance, beside slow steps of twice the length


@dataclass(frozen=True)
class SlowPower:
    """Mean power (W) and the piezo's mean square voltage, with what each error of the power is.

    ``changed`` is by how much the mean power changes from one part of the slow run to the next, ``separation`` what the
    direct run differs by over ``direct`` seconds, which is added to the mean already.
    """

    power: float
    square: float
    step: float
    interpolation: float
    changed: float
    separation: float
    direct: float
    duration: float
    slow_step: float
    steps: int
    current: RectifiedCurrent


def slow_power(problem: Problem, cut: Cut) -> SlowPower:
    """The stationary mean power of the load behind a cut, under a harmonic drive.

    Raises as `harvester.circuits.compiled_circuit.CompiledCircuit`, UnboundedResponseError where the motion grows.
    """
    assert problem.circuit is not None
    scales = problem.scales
    table, rough, measuring, _ = measured(problem, cut.held(HELD * scales.capacitance))
    circuit = SlowCircuit(problem.circuit, cut, scales)
    unit = time_constant(problem.equations) / scales.frequency
    h = unit / FINER
    farads = sum(1.0 / volts for name, _, _, volts in circuit.circuit.system.charges if name == STORE)
    duration = max(FIRST * unit, CHARGES * farads * table.voltages[-1] / max(table.current[0], 1e-30))
    duration = min(duration, MOST * h)
    while True:
        path = circuit.run(table, duration, h, stride=4)
        first, last = (_power(path.t, path.square, *part) for part in _parts(duration))
        if abs(first - last) <= SETTLED * last or 2.0 * duration > MOST * h:
            break
        duration *= 2.0
    ends = duration / 4.0, duration
    rougher = SlowCircuit(problem.circuit, cut, scales, ROUGHER * TOLERANCE)
    base = rougher.run(table, duration, 2.0 * h, stride=2)
    others = [rougher.run(one, duration, 2.0 * h, stride=2) for one in (rough, table.halved())]
    mean, twice = (_power(one.t, one.square, *ends) for one in (path, base))
    by_step, by_voltages = (_power(one.t, one.square, *ends) - twice for one in others)
    separation, direct, steps = _direct(problem, path, min(DIRECT * unit, duration), mean)
    ohm = circuit.circuit.resistance
    runs = (path, base, *others)
    return SlowPower(
        power=(mean + separation) / ohm,
        square=_power(path.t, path.piezo, *ends),
        step=(abs(by_step) + abs(twice - mean)) / ohm,
        interpolation=abs(by_voltages) / ohm,
        changed=abs(first - last) / ohm,
        separation=abs(separation) / ohm,
        direct=direct,
        duration=duration,
        slow_step=h,
        steps=measuring + steps + sum(one.steps for one in runs),
        current=table,
    )


def _parts(duration: float) -> tuple[tuple[float, float], tuple[float, float]]:
    return (duration / 4.0, 0.625 * duration), (0.625 * duration, duration)


def _power(t: Floats, integral: Floats, begin: float, end: float) -> float:
    """The mean rate of an integral between two times, weighted by Hann's window: whole cycles need not fit."""
    middle, rates = 0.5 * (t[1:] + t[:-1]), np.diff(integral) / np.diff(t)
    weights = np.where((middle > begin) & (middle < end), np.sin(np.pi * (middle - begin) / (end - begin)) ** 2, 0.0)
    return float((weights * rates).sum() / weights.sum())


def _direct(problem: Problem, slow: SlowPath, seconds: float, mean: float) -> tuple[float, float, int]:
    """What a direct run differs by in the mean square of the load's voltage, its seconds, and its steps.

    Where nothing has reached the load by then, the difference is that of the energies in the store, as a part of the
    ``mean``.
    """
    assert problem.circuit is not None
    eqs, w0, h = problem.equations, problem.scales.frequency, step_from_rest(problem.equations)
    kicks = math.ceil(seconds * w0 / h / 16) * 16
    path = compiled_circuit(problem.circuit, problem.scales).trace(eqs, np.zeros(kicks), h, 16)
    t = path.h * path.stride * np.arange(1.0, len(path.square) + 1.0) / w0
    part = seconds / 4.0, seconds
    load, its = _power(t, path.square, *part), _power(slow.t, slow.square, *part)
    if max(load, its) > 1e-3 * mean:
        return load - its, seconds, path.steps
    full, slowly = (float(np.interp(seconds, *one)) for one in ((t, path.told[:, 1]), (slow.t, slow.store)))
    return mean * (full**2 - slowly**2) / max(full**2, slowly**2, 1e-30), seconds, path.steps
