"""A chip's mean power at once, a few per cent off: for a page until the whole answer is there."""

import numpy as np

from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.presentation.messages.unknown_parts import (
    COMPILED_CIRCUIT,
    OWN_CLOCK,
    QUICK_UNDER_NOISE,
)
from harvester.storage.checked_mean import (
    CYCLES,
    FINER,
    MOST,
    READ,
    first_duration,
    halves,
    mean_rate,
    settled_part,
)
from harvester.storage.held_stores import StoreOnPath
from harvester.storage.measured_current import (
    Rectifier,
    measured,
    measured_current,
    open_voltage,
    time_constant,
)
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import Cut
from harvester.storage.slow_circuit import TOLERANCE, SlowCircuit, SlowPath
from harvester.uncertainty.value import Value

# of the current: voltages, times the step, its last change (differences of answers hold its noise)
VOLTAGES = 7
LONGER = 2.0
ROUGH = 7e-4
STEP, COARSER = 8.0, 30.0  # times the slow step and the tolerance of a whole answer
PART, SETTLED = 0.2, 0.05  # of the first slow run there; a change of the mean power that ends it
OFF = 0.06  # of the power: the total error


def quick_power(problem: Problem, cut: Cut) -> tuple[Value, Value, SlowPath]:
    """Mean power (W), mean square of the piezo's voltage, and the trajectory; soon.

    The rectifier's current is measured at few voltages and at a step of twice the length, until it
    changes little; the slow run is short if its parts agree, and its steps are coarse.  All that is
    off by less than `OFF`, as 47 designs with two chips were, by 4 % at most.  The current is kept
    for other circuits behind the same rectifier.

    Raises as `harvester.storage.steady_power.steady_power`.
    """
    scales = problem.scales
    table = _quick_current(problem)
    circuit = SlowCircuit(problem.load_circuit, cut, scales, COARSER * TOLERANCE)
    unit = time_constant(problem.equations) / scales.frequency
    slow = unit / FINER * STEP
    longest = min(first_duration(circuit, table, unit), MOST / STEP * slow)
    duration = PART * longest
    while True:
        path = circuit.run(table, duration, slow)
        first, last = (mean_rate(path, "square", part) for part in halves(duration))
        if duration >= longest or abs(first - last) < SETTLED * last:
            break
        duration = min(2.0 * duration, longest)
    settled = settled_part(duration)
    unknown = QUICK_UNDER_NOISE if problem.equations.is_random else COMPILED_CIRCUIT
    if duration < CYCLES * circuit.slowest_clock(table, path.end, READ * duration, slow):
        unknown = f"{unknown} and {OWN_CLOCK}"
    power, square = (
        Value(mean_rate(path, name, settled), unknown=unknown) for name in ("square", "piezo")
    )
    if not problem.equations.is_random:
        power, square = power.with_model(OFF), square.with_model(OFF)
    return power.scaled(1.0 / circuit.circuit.resistance), square, path


def _quick_current(problem: Problem) -> RectifiedCurrent:
    """The rectifier's current for `quick_power`.

    Under a sinusoid it is measured once for each rectifier and device.
    """
    if problem.equations.is_random:
        return measured(problem, count=VOLTAGES).best
    rectifier = Rectifier(problem)
    eqs = problem.equations
    h = LONGER * step_from_rest(problem.equations)
    circuit = rectifier.compiled(rectifier.held)
    key = repr((vars(circuit.system), eqs, problem.scales))
    current = MEASURED.get(key)  # once: another thread may put its own in this place
    if current is None:
        volts = np.linspace(0.0, open_voltage(problem, h), VOLTAGES)
        path = StoreOnPath(problem, circuit, rectifier.held, h)
        current = measured_current(path, eqs, volts, ROUGH)
        MEASURED.clear()
        MEASURED[key] = current
    return current


MEASURED: dict[str, RectifiedCurrent] = {}  # the last one
