"""The mean power of a chip's load, from the rectifier's current: hours of the slow circuit, and some of both together.

The slow circuit runs from empty until its mean power changes no more.  Its errors are measured: by
the rectifier's current at twice the step and at half of the voltages, by slow steps of twice the
length and a larger tolerance, and by a direct run of mass and circuit from rest, on the same
shaking, of `DIRECT` time constants of the mass.  The difference of the latter is added to the mean
(two levels), and is the error of the separation of time scales.  If it differs by more than
`LARGEST_SEPARATION` a longer direct run replaces the slow one.  The difference of compiled circuits
from ngspice (`error_of_circuit`) is applied to the rectifier's current, with its effect in the
slow circuit, and to the power again.
"""

import math
import time
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.storage.held_in_ngspice import error_of_circuit
from harvester.storage.measured_current import measured, time_constant
from harvester.storage.rectified_current import RectifiedCurrent
from harvester.storage.rectifier_cut import STORE, Cut
from harvester.storage.slow_circuit import TOLERANCE, SlowCircuit, SlowPath
from harvester.uncertainty.value import Value

FINER = 256.0  # slow steps to a time constant of the mass
# time constants of the mass, and times to charge the store, of the first slow run
FIRST, CHARGES = 500.0, 8.0
# relative change of the mean power from a part of the run to the next; slow steps
SETTLED, MOST = 3e-3, 4e6
# time constants of the direct run; times that, where it takes the slow one's place
DIRECT, LONGER = 150.0, 4.0
# of the mean power: a difference from the direct run above which the scales are not apart
LARGEST_SEPARATION = 0.05
ROUGHER = 4.0  # times the tolerance, beside slow steps of twice the length
# slow runs for errors in addition to the first one, at twice its step; most times the step in a
# short budget
OTHERS, COARSEST = 5, 8.0
PILOT = 0.02  # part of a run by which its duration is predicted


@dataclass(frozen=True)
class SlowPower:
    """Mean ``power`` (W) and the piezo's mean ``square`` voltage (V^2), with their errors.

    ``changed`` is the relative change of the mean power from one part of the run to the next,
    ``separation`` the difference of the direct run over ``direct`` seconds from the slow one, which
    is added to the mean already, unless ``scales_apart`` is False.  ``load`` is that of `of_load`.
    ``pace`` is the cost of mass and circuit together, s per simulated second of a trajectory (0: not
    measured).
    """

    power: Value
    square: Value
    changed: float
    separation: float
    scales_apart: bool
    direct: float
    duration: float
    slow_step: float
    steps: int
    current: RectifiedCurrent
    load: dict[str, float]
    pace: float = 0.0


@dataclass(frozen=True)
class SlowPace:
    """The cost of the slow circuit, ``whole`` and, in proportion to the steps, ``stepped``: s per simulated second.

    The ``deadline`` is one of `time.perf_counter`.
    """

    deadline: float
    whole: float
    stepped: float

    @classmethod
    def of(
        cls,
        circuit: SlowCircuit,
        table: RectifiedCurrent,
        duration: float,
        h: float,
        deadline: float,
    ) -> "SlowPace":
        """By a part of a run at steps of h, and at `COARSEST` of them."""
        took = []
        for factor in (1.0, COARSEST):
            begin = time.perf_counter()
            circuit.run(table, PILOT * duration, factor * h)
            took.append((time.perf_counter() - begin) / (PILOT * duration))
        stepped = max((took[0] - took[1]) / (1.0 - 1.0 / COARSEST), 0.0)
        return cls(deadline, max(took[0] - stepped, 0.0), stepped)

    def coarser(self, duration: float) -> float:
        """How many times longer steps let the first run and the `OTHERS` end in time: 1 at least, or inf."""
        room = self.left - (1.0 + OTHERS) * self.whole * duration
        needed = (1.0 + 0.5 * OTHERS) * self.stepped * duration
        return max(needed / room, 1.0) if room > 0.0 else math.inf

    @property
    def left(self) -> float:
        """The seconds that are left."""
        return self.deadline - time.perf_counter()


def slow_power(problem: Problem, cut: Cut, deadline: float | None = None) -> SlowPower | None:
    """The load's stationary mean power behind a cut, under a harmonic drive.

    A ``deadline`` of `time.perf_counter` makes slow steps longer, which their part of the error
    states as always; None if they would be more than `COARSEST` times as long.

    Raises as `harvester.circuits.compiled_circuit.CompiledCircuit`, UnboundedResponseError if
    the motion grows.
    """
    assert problem.circuit is not None
    scales = problem.scales
    table, rough, measuring, _ = measured(problem)
    circuit = SlowCircuit(problem.circuit, cut, scales)
    unit = time_constant(problem.equations) / scales.frequency
    h = unit / FINER
    begin = time.perf_counter()
    direct = _direct(problem, DIRECT * unit)
    took = time.perf_counter() - begin
    pace = None
    if deadline is not None:
        first = min(first_duration(circuit, table, unit), MOST * h)
        pace = SlowPace.of(circuit, table, first, h, deadline)
        coarser = pace.coarser(first)
        if coarser > COARSEST:
            return None
        h *= coarser
    path, duration, changed = settled_path(circuit, table, h, unit, pace)
    whole = settled_part(duration)
    rougher = SlowCircuit(problem.circuit, cut, scales, ROUGHER * TOLERANCE)
    judge, unknown = error_of_circuit(problem, float(path.rails.max()))
    less = table.scaled(1.0 - judge)
    base, *others = (
        rougher.run(current, duration, 2.0 * h, 2)
        for current in (table, rough, table.halved(), less)
    )

    def known(name: str) -> tuple[Value, float]:
        """The mean of an integral of the path, corrected, and by how much."""
        mean, twice, *changed = (mean_rate(run, name, whole) for run in (path, base, *others))
        by_step, by_voltages, by_judge = (abs(mean_of_other - twice) for mean_of_other in changed)
        off = _off(direct, path, mean, name)
        model = by_voltages + by_judge + judge * mean + abs(off)
        return Value(
            mean + off, bias=by_step + abs(twice - mean), model=model, unknown=unknown
        ), off

    (power, separation), (square, _) = known("square"), known("piezo")
    steps = measuring + direct.steps
    if not (scales_apart := abs(separation) <= LARGEST_SEPARATION * power.value):
        longer = LONGER if pace is None else min(max(pace.left / (2.0 * took), 1.0), LONGER)
        direct, twice = (_direct(problem, longer * direct.seconds, factor) for factor in (1.0, 2.0))
        power, square = (
            _of_direct(direct, twice, name, judge).with_unknown(unknown)
            for name in ("square", "piezo")
        )
        changed = 0.0
        steps = steps + direct.steps + twice.steps
    return SlowPower(
        power=replace(power, model=(power.model or 0.0) + changed).scaled(
            1.0 / circuit.circuit.resistance
        ),
        square=square,
        changed=changed / max(power.value, 1e-300),
        separation=abs(separation) / max(power.value, 1e-300),
        scales_apart=scales_apart,
        direct=direct.seconds,
        duration=duration,
        slow_step=h,
        steps=steps + sum(run.steps for run in (path, base, *others)),
        current=table,
        load=of_load(path),
    )


def settled_path(
    circuit: SlowCircuit,
    table: RectifiedCurrent,
    h: float,
    unit: float,
    pace: SlowPace | None = None,
) -> tuple[SlowPath, float, float]:
    """The slow circuit until its mean power changes no more, how long that is (s), and its last change (V^2).

    Steps are of ``h``, and the ``unit`` is the mass's time constant (s).  With a ``pace`` it ends
    if twice the time would be too much.
    """
    longest = MOST * unit / FINER
    duration = min(first_duration(circuit, table, unit), longest)
    while True:
        path = circuit.run(table, duration, h, stride=4)
        first, last = (mean_rate(path, "square", part) for part in halves(duration))
        settled = abs(first - last) <= SETTLED * last or 2.0 * duration > longest
        if settled or (pace is not None and pace.coarser(2.0 * duration) * unit / FINER > h):
            return path, duration, abs(first - last)
        duration *= 2.0


def of_load(path: SlowPath) -> dict[str, float]:
    """The share of the time that the load is on, when it is first (s), and the voltages between which the store varies.

    On is above half of the load's largest voltage.  Share and voltages are those of the run but for its first quarter.
    """
    on = path.load > 0.5 * path.load.max()
    late = path.t > 0.25 * path.t[-1]
    if not path.load.max() > 0.0:
        return {"load_on": 0.0, "store_highest": float(path.store.max())}
    return {
        "load_on": float(on[late].mean()),
        "load_on_after": float(path.t[on.argmax()]),
        "store_lowest": float(path.store[late].min()),
        "store_highest": float(path.store[late].max()),
    }


def first_duration(circuit: SlowCircuit, table: RectifiedCurrent, unit: float) -> float:
    """How long (s) the first slow run is, with a ``unit`` of the mass's time constant: some charges of the store."""
    farads = sum(
        1.0 / volts for name, _, _, volts in circuit.circuit.system.charges if name == STORE
    )
    return max(
        FIRST * unit,
        CHARGES * farads * float(table.voltages[-1]) / max(float(table.current[0]), 1e-30),
    )


class Span(NamedTuple):
    """A part of a run, from ``begin`` to ``end`` (s)."""

    begin: float
    end: float


def settled_part(duration: float) -> Span:
    """A run without its first quarter."""
    return Span(duration / 4.0, duration)


def halves(duration: float) -> tuple[Span, Span]:
    """Both halves of the `settled_part`, which are compared."""
    return Span(duration / 4.0, 0.625 * duration), Span(0.625 * duration, duration)


def mean_rate(run: "SlowPath | _Direct", name: str, span: Span) -> float:
    """The mean rate of an integral of a run, weighted by Hann's window: whole cycles need not fit.

    The integral is "square" or "piezo", as of `SlowPath`.
    """
    middle = 0.5 * (run.t[1:] + run.t[:-1])
    rates = np.diff(getattr(run, name)) / np.diff(run.t)
    phase = np.pi * (middle - span.begin) / (span.end - span.begin)
    inside = (middle > span.begin) & (middle < span.end)
    weights = np.where(inside, np.sin(phase) ** 2, 0.0)
    return float((weights * rates).sum() / weights.sum())


class _Direct(NamedTuple):
    """Mass and circuit together from rest: as of `SlowPath`, with the ``seconds`` of computation."""

    t: Floats
    store: Floats
    square: Floats
    piezo: Floats
    seconds: float
    steps: int


def _direct(problem: Problem, seconds: float, factor: float = 1.0) -> _Direct:
    """The direct run of so many seconds, at a ``factor`` times the usual step."""
    assert problem.circuit is not None
    eqs = problem.equations
    w0 = problem.scales.frequency
    h = factor * step_from_rest(problem.equations)
    n_steps = math.ceil(seconds * w0 / h / 16) * 16
    path = compiled_circuit(problem.circuit, problem.scales).trace(eqs, np.zeros(n_steps), h, 16)
    each = path.h * path.stride / w0
    t = each * np.arange(1.0, len(path.square) + 1.0)
    return _Direct(
        t,
        path.voltages[:, 1],
        path.square,
        np.cumsum(path.voltages[:, 0] ** 2) * each,
        seconds,
        path.steps,
    )


def _of_direct(direct: _Direct, coarse: _Direct, name: str, judge: float) -> Value:
    """The mean rate of an integral by a direct run, and by another of twice the step; ``judge``: with ngspice."""
    whole = settled_part(direct.seconds)
    mean, twice = (mean_rate(run, name, whole) for run in (direct, coarse))
    first, last = (mean_rate(direct, name, half) for half in halves(direct.seconds))
    return Value(mean, bias=abs(twice - mean), model=abs(first - last) + judge * mean)


def _off(direct: _Direct, slow: SlowPath, mean: float, name: str) -> float:
    """The difference of a direct run from the slow one in the mean rate of an integral.

    If nothing has reached the load by then, the difference is that of the energies in the store,
    as a part of the ``mean``.
    """
    part = settled_part(direct.seconds)
    slow_mean, direct_mean = (mean_rate(run, name, part) for run in (slow, direct))
    if max(direct_mean, slow_mean) > 1e-3 * mean:
        return direct_mean - slow_mean
    full, slowly = (float(np.interp(direct.seconds, run.t, run.store)) for run in (direct, slow))
    return mean * (full**2 - slowly**2) / max(full**2, slowly**2, 1e-30)
