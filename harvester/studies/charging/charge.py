"""The charging time of a storage capacitor from empty to a voltage: a mean, a distribution, and a curve.

The mass begins at rest and all capacitors empty; then the excitation begins.  A run that has not
reached the voltage when the time is over is counted, and reported: a mean without it would be too
short.

Long because the public function explains its arguments to users.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from harvester.engines.protocol import AnyScene, Progress
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.machine.automatic import reporting
from harvester.machine.execution import DEFAULT, Execution
from harvester.netlists.probes import STORE, Probe, read_probes
from harvester.presentation.diagnostic import Diagnostic, has, note, warning
from harvester.studies.charging.answer import FEW, ChargingResult, Level
from harvester.studies.charging.by_slow import charge_slowly
from harvester.studies.charging.by_spice import charge_in_ngspice
from harvester.studies.charging.passages import HIGH, LEVELS, LOW, ChargeRuns, Passages
from harvester.studies.charging.request import (
    ENGINES,
    check_anywhere,
    choose_engine,
    count_of_runs,
    read_runs,
    read_step,
    read_target,
    time_watched,
)
from harvester.studies.charging.side_by_side import charge_side_by_side
from harvester.studies.output_folder import OutputFolder, provenance

# times the time that a slow charge takes: how long a direct one is watched if it is not slow
LONGER = 2.0
LEAST = 0.5  # of a budget, that a direct charge has at least after a slow one


@names_arguments
def charge(
    scene: AnyScene,
    to: str | float,
    probe: str = STORE,
    engine: str | None = None,
    duration: str | float | None = None,
    trajectories: int | str | None = None,
    seed: int = 0,
    dt: str | float | None = None,
    anywhere: bool = False,
    progress: Progress | bool | None = None,
    notice: Callable[[str], None] | None = None,
    execution: Execution = DEFAULT,
) -> ChargingResult:
    """The time from empty until ``probe`` reaches ``to``, over many runs or, if nothing is random, of one.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    to : float or str
        a number in the unit of the probe, or a text such as "3.3 V"; for a nondimensional scene a
        number, in units of theta l/Cp.
    probe : str, default "store"
        the storage capacitor Csmooth ("store"), or a quantity of the circuit such as
        "v(a,b)".
    engine : str, optional
        "slow", "ideal", "compiled" or "spice"; None: "slow" for a storage capacitor of 1000 times
        the piezo's capacitance or more, unless its charge is not slow compared with the vibration,
        else "ideal" if that supports it, else "spice".
    duration : float or str, optional
        how long a run is watched, in seconds or as a text (nondimensional scene: 1/w0); None: until
        all have arrived, but at most five time constants of storage and load.  With it, "spice"
        also states for how much of the time the probe is at or above ``to`` once it has been there.
    trajectories : int or str, optional
        the number of runs; None: chosen by the engine.  Also the time of all runs, such as "30s",
        compilation not included: the engine's number, or as many and as long ones as fit into it;
        "slow" bounds its comparison with ngspice.
    seed : int, default 0
        the same seed, the same noise.
    dt : float or str, optional
        the step, in seconds or as a text (nondimensional scene: 1/w0).
    anywhere : bool, default False
        a recording, or a harmonic excitation, begins at a random place, not at its beginning.
    progress : callable or bool, optional
        is called with the fraction done; by default a bar on a terminal or in a notebook, False:
        none.
    notice : callable, optional
        is called before many runs of ngspice that nobody chose, with the reason.
    execution : Execution, optional
        has the folder for charge.csv, levels.csv, charge.png and provenance.json; ``out`` and
        ``formats`` alone.

    Returns
    -------
    ChargingResult
        the mean time and its quantiles (s, or 1/w0), and the levels on the way.

    Raises
    ------
    InputError
        for a scene without storage capacitor, an unknown probe or engine, options that are out of
        range or would do nothing, and a folder that cannot be written.
    CannotServeError
        for a scene that the engine does not support.
    MissingProgramError
        if ngspice is not installed.
    SimulationError
        of the engine.

    Examples
    --------
    >>> import harvester as hv
    >>> found = hv.charge("examples/plate_bridge.toml", "2 V", engine="ideal", trajectories=256)
    >>> found.engine, len(found.levels), found.levels[-1].voltage
    ('ideal', 20, 2.0)
    """
    execution.only("charge", "out", "formats")
    problem = Problem.of(scene)
    given, budget = read_runs(trajectories)
    folder = OutputFolder.of(execution)
    if problem.circuit is None:
        raise InputError(
            "charging must have a [load] with a storage capacitor, but the circuit is open"
        )
    if problem.netlist is None and probe == STORE:
        raise InputError(
            "charging must have a circuit with a storage capacitor, but this scene has a resistor alone: set "
            "load.netlist, for instance to 'bridge'"
        )
    seen = read_probes([probe], problem.circuit)[0]
    name, reason = choose_engine(problem, seen, engine)
    unit = problem.units.frequency
    target = read_target(to, seen, problem)
    steady = problem.equations.is_steady and not anywhere
    count = count_of_runs(given, name, steady)
    check_anywhere(anywhere, problem)
    if notice is not None and ENGINES[name].runs_ngspice and reason and count > 1:
        notice(str(note("many_ngspice_runs", why=str(reason), runs=count)))
    watched, chosen = time_watched(duration, problem, ENGINES[name].by_mean_current)
    h = read_step(dt, problem)
    levels = target * problem.in_circuit(seen.unit) * np.arange(1, LEVELS + 1) / LEVELS
    real = watched * unit / problem.scales.frequency  # in seconds of the device that runs
    looked = None if seen.name == STORE else seen
    with reporting(progress, "charge") as report:
        runs = ChargeRuns(
            problem=problem,
            levels=levels,
            duration=real,
            count=count,
            seed=seed,
            h=h,
            probe=looked,
            anywhere=anywhere,
            whole=duration is not None,
            progress=report,
            budget=budget,
        )
        passages = _passages(name, runs)
        if engine is None and has(passages.notes, "charge_not_slow"):
            reason = dataclasses.replace(passages.notes[-1], severity="note")
            name = choose_engine(problem, seen, None, slowly=False)[0]
            again = count_of_runs(given, name, steady)
            direct = min(real, LONGER * passages.at[-1])
            left = max(runs.budget - passages.seconds, LEAST * runs.budget)
            again_runs = dataclasses.replace(runs, count=again, duration=direct, budget=left)
            passages = _passages(name, again_runs)
    charging = _answer(
        problem,
        passages,
        engine=name,
        probe=seen,
        target=target,
        reason=reason,
        by_default=not chosen,
    )
    if folder is not None:
        arguments = {
            "trajectories": trajectories,
            "seed": seed,
            "probe": probe,
            "engine": engine,
            "duration": duration,
        }
        arguments |= {"anywhere": anywhere, "dt": dt}
        about = provenance(
            problem, to=to, runs=charging.runs, chosen_engine=charging.engine, **arguments
        )
        folder.table("levels", charging.ladder.csv())
        folder.save("charge", charging.table.csv(), charging.plot(problem.scene.name), about)
    return charging


def _passages(engine: str, runs: ChargeRuns) -> Passages:
    """The passages by an engine."""
    if ENGINES[engine].by_mean_current:
        return charge_slowly(runs)
    return (
        charge_in_ngspice(runs)
        if ENGINES[engine].runs_ngspice
        else charge_side_by_side(runs, engine)
    )


def _answer(
    problem: Problem,
    passages: Passages,
    engine: str,
    probe: Probe,
    target: float,
    reason: Diagnostic | None,
    by_default: bool,
) -> ChargingResult:
    """The answer in the scene's units.

    Arguments as of `ChargingResult`, ``by_default``: nobody chose the duration.
    """
    clock = problem.scales.frequency / problem.units.frequency
    levels = [_level(problem, passages, k, probe) for k in range(len(passages.levels))]
    curves = passages.curves / problem.in_circuit(probe.unit)
    runs = len(curves)
    entries = passages.independent(curves)
    stderr = None if runs == 1 else entries.std(axis=0, ddof=1) / math.sqrt(len(entries))
    low_curve, high_curve = np.quantile(curves, [LOW, HIGH], axis=0)
    last = levels[-1]
    return ChargingResult(
        engine=engine,
        probe=probe.name,
        unit=probe.unit if problem.physical else "",
        target=target,
        duration=passages.end * clock,
        runs=runs,
        reached=passages.reached,
        reached_between=passages.reached_between(),
        time=last.time,
        at_least=passages.at_least().scaled(clock),
        low=last.low,
        high=last.high,
        t=passages.at * clock,
        voltage=curves.mean(axis=0),
        stderr=stderr,
        quantiles=(low_curve, high_curve),
        arrived=passages.arrived(),
        afterwards=passages.share_afterwards(),
        rises=passages.rises(),
        levels=tuple(levels),
        physical=problem.physical,
        seconds=passages.seconds,
        steps=passages.steps,
        diagnostics=(
            *problem.value_warnings,
            *_diagnostics(problem, passages, clock, by_default, runs),
            *([] if reason is None else [reason]),
            *passages.notes,
            *_known(engine, runs),
        ),
    )


def _level(problem: Problem, passages: Passages, k: int, probe: Probe) -> Level:
    """A level on the way in the scene's units, with its time, and a storage capacitor's energy and power."""
    clock = problem.scales.frequency / problem.units.frequency
    watts = problem.units.watts / problem.scales.watts
    time = passages.time_to(k)
    low = passages.quantile(LOW, k)
    high = passages.quantile(HIGH, k)
    energy = power = None
    if probe.name == STORE and passages.capacitance > 0.0:
        joules = 0.5 * passages.capacitance * passages.levels**2
        energy = float(joules[k]) * watts * clock
        power = passages.power_between(k, float(joules[k] - (joules[k - 1] if k else 0.0)))
    return Level(
        voltage=float(passages.levels[k]) / problem.in_circuit(probe.unit),
        energy=energy,
        reached=float(np.isfinite(passages.times[:, k]).mean()),
        time=None if time is None else time.scaled(clock),
        low=None if low is None else low * clock,
        high=None if high is None else high * clock,
        power=None if power is None else power.scaled(watts),
    )


def _known(engine: str, runs: int) -> list[Diagnostic]:
    """The known part of the error."""
    if ENGINES[engine].by_mean_current:
        return []
    if not ENGINES[engine].runs_ngspice:
        return [note("error_of_charging_side_by_side")]
    return [*([note("one_run_is_all")] if runs == 1 else []), note("error_of_charging")]


def _diagnostics(
    problem: Problem, passages: Passages, clock: float, by_default: bool, runs: int
) -> list[Diagnostic]:
    """The warnings."""
    diagnostics = []
    unit = " s" if problem.physical else ""
    if passages.reached < 1.0:
        height = float(passages.curves[:, -1].mean()) / float(passages.levels[-1])
        known: dict[str, Any] = {
            "runs": runs,
            "time": passages.end * clock,
            "unit": unit,
            "by_default": by_default,
        }
        diagnostics.append(
            warning("target_not_reached", share=1.0 - passages.reached, height=height, **known)
        )
    record = problem.equations.record
    if record is not None and passages.end * problem.scales.frequency > record.period * (
        1.0 + 1e-6
    ):
        diagnostics.append(
            warning("record_repeats", period=record.period / problem.units.frequency, unit=unit)
        )
    records = runs // passages.together
    if records < runs and records < FEW:
        diagnostics.append(warning("few_records", records=records, together=passages.together))
    elif 1 < runs < FEW:
        diagnostics.append(warning("few_runs", runs=runs))
    return diagnostics
