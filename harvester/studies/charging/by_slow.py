"""Charging by the rectifier's mean current: hours of a storage capacitor in the time for measuring the current."""

import math
import time
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.engines import Slow
from harvester.equations.coefficients import Equations
from harvester.equations.power_bound import power_bound
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError
from harvester.machine.progress import listening, report_share, stage
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.mechanics.trace import at_rest
from harvester.netlists.part import CircuitPart
from harvester.netlists.probes import STORE, Probe
from harvester.presentation.diagnostic import Diagnostic, note, refusal, warning
from harvester.presentation.messages.unknown_parts import MEASURED_CURRENT
from harvester.storage.held_in_ngspice import error_of_circuit
from harvester.storage.measured_current import JUDGE, Rectifier, measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent, reached, times_to
from harvester.storage.rectifier_cut import STORE as CSMOOTH
from harvester.storage.rectifier_cut import cut_behind_rectifier, is_plain_store
from harvester.storage.time_limit import TimeLimit, limited
from harvester.studies.charging.afterwards import afterwards
from harvester.studies.charging.passages import SAMPLES, ChargeRuns, Passages
from harvester.uncertainty.value import half95

MEASURING = 0.4  # fraction of the time under noise: until the currents are known
JUDGING = 0.75  # until ngspice judges the circuit
SLOW_FROM = 30.0  # time constants of the mass: a charge that takes less is not slow
AT_REST = 200  # steps of a mass at rest, in which the board's own draw is measured
MOST_BESIDE = 0.1  # charge of other capacitors per charge stored, unknown under noise
# times the piezo's capacitance: a storage capacitor that is charged slowly without being asked for
LARGE = 1000.0


def refusal_of_slow(problem: Problem, probe: Probe, records: bool = False) -> Diagnostic | None:
    """Why a charge cannot be computed from the rectifier's mean current, also of ``records``; None if it can."""
    from harvester.circuits.idealised import ideal_circuit

    eqs = problem.equations
    if problem.load.store is None or probe.name != STORE:
        return refusal("slow_probe", probe=probe.name)
    circuit = problem.load_circuit
    if not _serves_shaking(eqs, records):
        return refusal("slow_shaking")
    if eqs.record is not None and ideal_circuit(circuit, problem.scales):
        return None
    try:
        compiled_circuit(circuit, problem.scales)
    except InputError as error:
        return refusal("needs_compiled_circuit", Slow.NAME, engine=Slow.NAME, why=str(error))
    if is_plain_store(circuit):
        charged = [
            part.name for part in circuit.parts if part.kind == "c" and part.options.get("ic")
        ]
        return refusal("slow_from_rest", names=", ".join(charged)) if charged else None
    return refusal("slow_shaking") if eqs.is_random else Slow.refusal(problem)


def _serves_shaking(eqs: Equations, records: bool) -> bool:
    if eqs.record is not None:
        return records and eqs.is_steady
    return eqs.is_shaken and not (eqs.drive is not None and eqs.is_random)


def charges_slowly(problem: Problem) -> bool:
    """Whether its storage capacitor is so large that a direct run would take long."""
    store = problem.load.store
    return store is not None and store >= LARGE * problem.scales.capacitance


def charge_slowly(runs: ChargeRuns) -> Passages:
    """The passages of the storage capacitor.

    Raises UnboundedResponseError if the motion grows without bound, and TooLittleTimeError if the
    mean current is not measured within the budget of the ``runs``.
    """
    from harvester.mechanics.kernels.compiled import compilation

    problem = runs.problem
    begin = time.perf_counter()
    deadline = None if math.isinf(runs.budget) else begin + runs.budget
    limit = nullcontext() if math.isinf(runs.budget) else limited(TimeLimit(runs.budget))
    with compilation(), limit, listening(runs.progress):
        _check_draw(problem, float(runs.levels[-1]), runs.h)
        if not is_plain_store(problem.load_circuit):
            fields = _behind_a_rectifier(runs, deadline)
        elif problem.equations.is_steady:
            fields = _steady(runs, deadline)
        else:
            fields = _random(runs, deadline)
    _check_times(fields)
    runs.tell(1.0)
    fields["seconds"] = time.perf_counter() - begin
    return Passages(
        levels=runs.levels,
        end=runs.duration,
        capacitance=problem.load_circuit.smoothing or 0.0,
        **fields,
    )


def _check_draw(problem: Problem, top: float, h: float | None) -> None:
    """Raise SimulationError if the board draws more power at the target voltage than the mass can give.

    A device of ideal elements alone draws none but for the load's.  If that power may still load
    other capacitors, as through a resistor, the error is that this engine does not follow them.
    """
    bound = power_bound(problem)
    rectifier = Rectifier(problem)
    if bound is None or rectifier.ideal is not None or not is_plain_store(rectifier.load):
        return
    step = step_from_rest(problem.equations) if h is None else h
    circuit = rectifier.compiled(rectifier.held)
    charge = circuit.charge_at(CSMOOTH)
    state = circuit.rest.copy()
    state[charge] = rectifier.held * top
    eqs = problem.equations
    start = at_rest(eqs)[:-1]
    charges = [state[charge]]
    for _ in range(2):  # the first loads the other capacitors
        path = circuit.trace(eqs, np.zeros(AT_REST), step, 1, start, state)
        start = path.last[:-1]
        charges.append(float(path.state[charge]))
        state = path.state
    watts = (charges[1] - charges[2]) * top * problem.scales.frequency / (AT_REST * step)
    most = bound.value / problem.units.watts * problem.scales.watts
    if watts <= most:
        return
    others = _other_capacitors(rectifier)
    if charges[0] - charges[1] < top * sum(part.effective_value or math.inf for part in others):
        names = ", ".join(part.name for part in others)
        raise SimulationError(
            "engine slow follows no capacitor that is slow next to the storage capacitor, but "
            f"{names} may still be loading at {top:.3g} V, with {watts:.3g} W: use engine 'compiled' or 'spice'"
        )
    raise SimulationError(
        f"the storage capacitor does not reach {top:.3g} V: at this voltage the board itself draws {watts:.3g} W, "
        f"and the mass can give {most:.3g} W at most: is an element across it intended?"
    )


def _other_capacitors(rectifier: Rectifier) -> list[CircuitPart]:
    """The capacitors of a rectifier but for the storage capacitor."""
    return [part for part in rectifier.parts if part.kind == "c" and part.name != CSMOOTH]


def _charge_of_others(problem: Problem, farads: float, top: float) -> float:
    """The largest charge of other capacitors, per charge of a storage capacitor of ``farads``, up to a voltage.

    Raises SimulationError if it is above `MOST_BESIDE`.
    """
    others = _other_capacitors(Rectifier(problem))
    share = sum(part.effective_value or math.inf for part in others) / farads
    if share <= MOST_BESIDE:
        return share
    names = ", ".join(part.name for part in others)
    raise SimulationError(
        "engine slow follows no capacitor next to the storage capacitor under noise, but the charge of "
        f"{names} is up to {100.0 * share:.3g} % of that of the storage capacitor at {top:.3g} V: "
        "use engine 'compiled' or 'spice'"
    )


def _check_times(fields: dict[str, Any]) -> None:
    """Raise SimulationError if the time of the storage capacitor is less than its own model error."""
    times = fields["times"]
    reached = np.isfinite(times).all(axis=0)
    means = np.where(reached, np.where(np.isfinite(times), times, 0.0).mean(axis=0), math.inf)
    # Levels on the way may be passed at once; that of the question must not be.
    if not means[-1] > _finite(fields["model"])[-1]:
        raise SimulationError(
            "engine 'slow' does not know this charge: the storage capacitor fills within the transients of the mass "
            f"(mean time {means[-1]:.3g} s, model error {fields['model'][-1]:.2g} s): "
            "use engine 'compiled'"
        )


def _steady(runs: ChargeRuns, deadline: float | None) -> dict[str, Any]:
    """One run under a harmonic excitation."""
    from harvester.storage.slow_circuit import direct_check

    problem = runs.problem
    levels = runs.levels
    duration = runs.duration
    circuit = problem.load_circuit
    top = float(levels[-1])
    assert circuit.smoothing is not None, "the refusal checks this"
    table, rough, steps, _ = measured(problem, top, runs.h)
    both = compiled_circuit(circuit, problem.scales)
    farads, ohm = circuit.smoothing, both.resistance
    volts, curve = reached(table, top, farads, ohm)
    check = direct_check(problem, both, volts, curve, duration, runs.h)
    judge, unknown = error_of_circuit(problem, float(volts[-1]), deadline=deadline)

    def at(current: RectifiedCurrent) -> Floats:
        times_at = times_to(levels, current, farads, ohm) + check.late
        return np.where(times_at > duration, math.inf, times_at)

    times = at(table)
    at_times = np.linspace(0.0, min(duration, 1.05 * float(curve[-1])), SAMPLES)
    unit = time_constant(problem.equations) / problem.scales.frequency
    return {
        "times": times[None],
        "coarse": at(rough)[None],
        "at": at_times,
        "curves": np.interp(at_times, curve + check.late, volts, left=0.0)[None],
        "steps": steps + check.steps,
        "notes": (
            note("slow_charge", direct=check.seconds, change=check.late),
            *_not_apart(float(times[-1]), unit),
        ),
        "model": _finite(at(table.halved()), times) + check.error + judge * _finite(times),
        "unknown": unknown,
    }


def _random(runs: ChargeRuns, deadline: float | None) -> dict[str, Any]:
    """Many runs under noise."""
    from harvester.circuits.idealised import ideal_circuit
    from harvester.cosimulation.charging import first_passages
    from harvester.storage.charge_delay import charge_delay
    from harvester.storage.rectified_current import LONGER, error_of_times, random_paths
    from harvester.storage.slow_circuit import noise_check

    problem, levels = runs.problem, runs.levels
    scales, circuit = problem.scales, problem.load_circuit
    assert circuit.smoothing is not None, "the refusal checks this"
    top = float(levels[-1])
    farads = circuit.smoothing
    ohm = compiled_circuit(circuit, scales).resistance
    is_packaged = ideal_circuit(circuit, scales) is not None
    beside = 0.0 if is_packaged else _charge_of_others(problem, farads, top)
    with stage(0.0, MEASURING):
        table, _, steps, _ = measured(problem, top, runs.h, runs.seed)
    table = replace(table, ring_up=0.0)  # a part of the delay
    mean = times_to(levels, table, farads, ohm)
    delay = charge_delay(problem, table, top, (farads, ohm), runs.seed, runs.h)
    end = min(runs.duration, LONGER * float(mean[-1]))
    paths_by_step = [
        random_paths(
            table, farads, ohm, top=top, end=end, count=runs.count, seed=runs.seed, coarse=coarse
        )
        for coarse in (False, True)
    ]
    times, coarse = (
        np.array([first_passages(t, v, levels) for v in paths]) for t, paths in paths_by_step
    )
    at = np.linspace(0.0, end, SAMPLES)
    path = reached(table, top, farads, ohm)
    elements, _, more = noise_check(problem, table, path, None, runs.seed)
    report_share(JUDGING)
    judge, unknown = error_of_circuit(problem, top, runs.seed, deadline=deadline)
    sampling = error_of_times(levels, table, farads, ohm)
    if not np.isfinite(sampling).all():
        unknown = " and ".join(filter(None, (unknown, MEASURED_CURRENT)))
    model = half95(_finite(sampling))
    late = delay.late.value
    model += delay.late.sampling95 + (delay.late.model or 0.0)
    model[:-1] += abs(late)  # of the way to the last level, and not known of the others
    model += _finite(times_to(levels, table.halved(), farads, ohm), mean)
    model += (judge + elements + beside) * _finite(mean)
    t, paths = paths_by_step[0]
    waits = note("slow_charge_under_noise", direct=delay.seconds, change=late)
    return {
        "times": times + late,
        "coarse": coarse + late,
        "at": at,
        "curves": np.array([np.interp(at, t + late, v, left=0.0) for v in paths]),
        "steps": steps + delay.steps + more,
        "counted": 1.0 / (math.sqrt(2.0) - 1.0),
        "notes": (
            *([waits] if delay.seconds else []),
            *_not_apart(float(mean[-1]), time_constant(problem.equations) / scales.frequency),
        ),
        "model": model,
        "unknown": unknown,
    }


def _behind_a_rectifier(runs: ChargeRuns, deadline: float | None) -> dict[str, Any]:
    """One run of a chip under a harmonic excitation."""
    from harvester.cosimulation.charging import first_passages
    from harvester.storage.checked_mean import FINER
    from harvester.storage.slow_circuit import SlowCircuit, direct_check

    problem, levels = runs.problem, runs.levels
    scales, circuit = problem.scales, problem.load_circuit
    cut = cut_behind_rectifier(circuit)
    assert cut is not None, "the refusal checks this"
    table, rough, steps, _ = measured(problem)
    slow = SlowCircuit(circuit, cut, scales)
    unit = time_constant(problem.equations) / scales.frequency
    paths = [
        slow.run(current, runs.duration, unit / FINER, stride=4)
        for current in (table, rough, table.halved())
    ]
    end = int(paths[0].store.argmax()) + 1
    check = direct_check(
        problem,
        compiled_circuit(circuit, scales),
        volts=np.maximum.accumulate(paths[0].store[:end]),
        times=paths[0].t[:end],
        longest=runs.duration,
        h=runs.h,
    )
    times, coarse, other = (
        first_passages(path.t, path.store, levels) + check.late for path in paths
    )
    parts_after = [afterwards(path.t, path.store, float(levels[-1])) for path in paths[:2]]
    at = np.linspace(0.0, runs.duration, SAMPLES)
    separation = abs(check.late) + check.error
    judge, unknown = error_of_circuit(problem, float(paths[0].rails.max()), deadline=deadline)
    alone = note("slow_charge_of_chip", direct=check.seconds, change=check.late)
    return {
        "times": times[None],
        "coarse": coarse[None],
        "at": at,
        "curves": np.interp(at, paths[0].t + check.late, paths[0].store, left=0.0)[None],
        "steps": steps + check.steps + sum(path.steps for path in paths),
        "notes": (alone, *_not_apart(float(times[-1]), unit)),
        "model": _finite(other, times)
        + (max(judge, JUDGE) + separation / check.seconds) * _finite(times),
        "unknown": unknown,
        "after": ([parts_after[0]], [parts_after[1]]) if runs.whole else None,
    }


def _finite(times: Floats, others: Floats | float = 0.0) -> Floats:
    """Sizes of differences of times, 0 if a level is not reached."""
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.abs(times - others), nan=0.0, posinf=0.0)


def _not_apart(seconds: float, unit: float) -> list[Diagnostic]:
    """A warning if charging does not take long next to the mass' own transients."""
    return (
        [warning("charge_not_slow", seconds=seconds, transients=unit)]
        if seconds < SLOW_FROM * unit
        else []
    )
