"""How long a storage capacitor takes from empty to a voltage: a mean, a distribution, and a curve.

The mass begins at rest and all capacitors empty; then the shaking begins.  A run that has not reached the voltage when
the time is over is counted, and told: a mean without it would be too short.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from harvester import figures
from harvester.engines import Ideal, Spice
from harvester.engines.protocol import AnyScene, Progress
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.netlists.probes import STORE, Probe, read_probes
from harvester.scene.plausibility import unusual_values
from harvester.studies.charging.answer import FEW, ChargingResult, Level
from harvester.studies.charging.by_ideal import charge_ideal
from harvester.studies.charging.by_spice import charge_in_ngspice
from harvester.studies.charging.passages import HIGH, LEVELS, LOW, Passages
from harvester.studies.charging.request import (
    check_anywhere,
    choose_engine,
    count_of_runs,
    read_step,
    read_target,
    time_watched,
)
from harvester.studies.output_folder import OutputFolder, provenance


@names_arguments
def charge(
    scene: AnyScene,
    to: str | float,
    probe: str = STORE,
    engine: str | None = None,
    duration: str | float | None = None,
    trajectories: int | None = None,
    seed: int = 0,
    dt: str | float | None = None,
    anywhere: bool = False,
    progress: Progress | None = None,
    notice: Callable[[str], None] | None = None,
) -> ChargingResult:
    """The time from empty until ``probe`` reaches ``to``, over many runs or, where nothing is random, of one.

    ``to`` is a number or a text such as "3.3 V" (nondimensional scene: a number, in units of theta l/Cp); ``probe`` is
    the storage capacitor Csmooth, or as of `harvester.netlists.probes`.  ``engine`` None is `ideal` where that serves,
    else `spice`.  ``duration`` is how long a run is watched, in seconds or as a text (nondimensional scene: 1/w0);
    None: until all have arrived, but at most five time constants of store and load; with it, `spice` also says for how
    much of the time the probe is at or above ``to`` once it has been there.  ``dt`` is the step.  A record, or
    a harmonic drive, begins at its beginning, or with ``anywhere`` at a random place.  ``notice`` is called before many
    runs of ngspice that nobody chose, with the reason.

    >>> import harvester as hv
    >>> found = hv.charge("examples/plate_bridge.toml", "2 V", engine="ideal", trajectories=256)
    >>> found.engine, len(found.levels), found.levels[-1].voltage
    ('ideal', 20, 2.0)

    Raises
    ------
    InputError
        for a scene without storage capacitor, an unknown probe or engine, and options that are out of range or would do
        nothing.
    CannotServeError
        for a scene that the engine does not serve.
    MissingProgramError, CircuitError, UnboundedResponseError
        of the engine.
    """
    problem = Problem.of(scene)
    if problem.circuit is None:
        raise InputError("charging must have a [load] with a storage capacitor, but the circuit is open")
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
    count = count_of_runs(trajectories, name, steady)
    check_anywhere(anywhere, problem)
    if notice is not None and name == Spice.NAME and reason and count > 1:
        notice(f"{reason}; {count} runs, which may take minutes")
    watched, chosen = time_watched(duration, problem)
    h = read_step(dt, problem)
    levels = target * problem.in_circuit(seen.unit) * np.arange(1, LEVELS + 1) / LEVELS
    real = watched * unit / problem.scales.frequency  # in seconds of the device that runs
    if name == Ideal.NAME:
        passages = charge_ideal(problem, levels, real, count, seed, h, progress)
    else:
        looked = None if seen.name == STORE else seen
        whole = duration is not None
        passages = charge_in_ngspice(problem, looked, levels, real, count, seed, h, anywhere, whole, progress)
    return _answer(problem, passages, name, seen, target, reason, not chosen)


def _answer(
    problem: Problem, passages: Passages, engine: str, probe: Probe, target: float, reason: str, by_default: bool
) -> ChargingResult:
    """The answer in the scene's units; arguments as of `ChargingResult`, ``by_default``: nobody chose the duration."""
    s, units = problem.scales, problem.units
    clock, scale, watts = s.frequency / units.frequency, problem.in_circuit(probe.unit), units.watts / s.watts
    curves = passages.curves / scale
    runs = len(curves)
    stored = probe.name == STORE and passages.capacitance > 0.0
    levels = []
    below = 0.0
    for k, voltage in enumerate(passages.levels):
        energy = 0.5 * passages.capacitance * float(voltage) ** 2
        power = passages.power_between(k, energy - below) if stored else None
        mean, low, high = passages.time_to(k), passages.quantile(LOW, k), passages.quantile(HIGH, k)
        levels.append(
            Level(
                float(voltage) / scale,
                energy * watts * clock if stored else None,
                float(np.isfinite(passages.times[:, k]).mean()),
                None if mean is None else mean.scaled(clock),
                None if low is None else low * clock,
                None if high is None else high * clock,
                None if power is None else power.scaled(watts),
            )
        )
        below = energy
    entries = passages.independent(curves)
    stderr = None if runs == 1 else entries.std(axis=0, ddof=1) / math.sqrt(len(entries))
    low_curve, high_curve = np.quantile(curves, [LOW, HIGH], axis=0)
    found = levels[-1]
    return ChargingResult(
        engine=engine,
        probe=probe.name,
        unit=probe.unit if problem.physical else "",
        target=target,
        duration=passages.end * clock,
        runs=runs,
        reached=passages.reached,
        reached_between=passages.reached_between(),
        time=found.time,
        at_least=passages.at_least().scaled(clock),
        low=found.low,
        high=found.high,
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
        reason="; ".join(filter(None, (reason, passages.note, _known(engine, runs)))),
        warnings=(*unusual_values(problem.scene), *_doubts(problem, passages, clock, by_default, runs)),
    )


def _known(engine: str, runs: int) -> str:
    """What is known of the error."""
    if engine == Ideal.NAME:
        return (
            "the error of the step is 2.4 times the change at twice the step and half the looks, on the same noise; "
            "as runs are looked at now and then, a few that just reach the target may be missed, and the share that "
            "does is a lower bound; the error of ideal diodes and switches is not known from within: compare with "
            "engine 'spice'"
        )
    random = "" if runs > 1 else "nothing is random, so that one run is all; "
    change = "the error of the step is the change at twice the step and ten times ngspice's tolerance"
    return f"{random}{change}, on the same shaking"


def _doubts(problem: Problem, passages: Passages, clock: float, by_default: bool, runs: int) -> list[str]:
    """What to beware of."""
    said, unit = [], " s" if problem.physical else ""
    if passages.reached < 1.0:
        top = float(passages.curves[:, -1].mean())
        unit_of_time = f"{passages.end * clock:.4g}{unit}"
        limit = "what is watched by default" if by_default else "`duration`"
        share = f"{1.0 - passages.reached:.1%} of the runs do" if runs > 1 else "the run does"
        height = f"{top / passages.levels[-1]:.3g} times the target"
        said.append(
            f"{share} not get there within {unit_of_time} ({limit}), where it is at {height} on average: the "
            "mean time is not known; watch longer (`duration`), or take a larger load resistance or more shaking"
        )
    record = problem.equations.record
    if record is not None and passages.end * problem.scales.frequency > record.period * (1.0 + 1e-6):
        said.append(
            f"the record lasts {record.period / problem.units.frequency:.4g}{unit} and was played again and again: a "
            "single shock is a `duration` within the record"
        )
    records = runs // passages.together
    if records < runs and records < FEW:
        said.append(
            f"the runs are on {records} records of the tabulated density, {passages.together} on each, which say "
            "little of 5 and 95 %: take more `trajectories`"
        )
    elif 1 < runs < FEW:
        said.append(f"5 and 95 % of {runs} runs are near the first and the last: take more `trajectories`")
    return said


def draw(
    scene: AnyScene,
    out: str | Path | None,
    vector: Sequence[str] = (),
    to: str | float = "",
    progress: Progress | None = None,
    notice: Callable[[str], None] | None = None,
    **options: object,
) -> ChargingResult:
    """Compute a `charge`, and write charge.csv, levels.csv, charge.png and its ``vector`` forms, and provenance.json.

    ``options`` are those of `charge`; ``out`` None writes nothing.
    """
    problem = Problem.of(scene)
    folder = None if out is None else OutputFolder(out, vector)
    found = charge(problem, to, progress=progress, notice=notice, **options)  # type: ignore[arg-type]
    if folder is not None:
        about = provenance(problem, to=to, runs=found.runs, chosen_engine=found.engine, **options)
        folder.table("levels", found.levels_text())
        folder.save("charge", found.text(), figures.charging(found, problem.scene.title), about)
    return found
