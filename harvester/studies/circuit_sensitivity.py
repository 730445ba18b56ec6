"""Normalised sensitivities of a netlist's power: its compiled circuit at two values of each key on the same noise.

All ensembles continue from one burn-in, at a step of as many seconds, on the noise that follows it,
so that the two powers of a key differ by the key alone.  With ln P a mean over trajectories,

    E+ = (ln P(1 + d) - ln P)/ln(1 + d),   E- = (ln P(1 - d) - ln P)/ln(1 - d),

the normalised sensitivity at the key's value is between E- and E+ if it only grows or only falls from
1 - d to 1 + d.  The value is the difference of the outer two, exact for any power law, and half of
|E+ - E-| its step error, plus that of the power at the ensembles' time step, relative.
"""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from harvester.arrays import Floats
from harvester.engines.compiled import Compiled
from harvester.engines.power_slopes import quantities, value_of
from harvester.equations.coefficients import Equations
from harvester.equations.impact_order import STRONG, step_order
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.mechanics.ensemble.burn_in import burn_in
from harvester.mechanics.ensemble.compiled_pair import compile_pair
from harvester.mechanics.ensemble.richardson import LEFT
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.moments import Moments
from harvester.presentation.messages.unknown_parts import WELLS
from harvester.storage.held_stores import enough_runs
from harvester.studies.power_differences import PowerDifferences, check_power, largest_change
from harvester.uncertainty.controls import controlled_entries
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value

ROOT = np.random.SeedSequence(11)
# part of the burn-in's time: an ensemble whose key has changed by 5 % settles again in
SETTLING = 0.5
# parts of the burn-in's time: the windows of a mean, until its error is small
WINDOWS = (0.25, 0.25, 0.25, 0.25, 0.5, 0.5, 1.0, 1.0)
SMALL = 0.01  # sampling error of a sensitivity (95 %) that is sought, of the larger of it and 1


_Entries: TypeAlias = tuple[Floats, Floats | None]  # of trajectories, and their controls


def keys_with_elements(problem: Problem) -> Iterator[tuple[str, float]]:
    """The keys of a scene and its netlist's parameters and elements that are numbers other than 0, with values."""
    circuit = problem.load_circuit
    load = problem.scene.load
    assert load is not None, "asked for a netlist"
    for key in quantities(problem.scene):
        if not key.startswith("load."):
            yield key, value_of(problem.scene, key)
    for name, value in (circuit.elements | circuit.values).items():
        if value != 0.0 and (name != "Cp" or name in load.parameters):  # else that of the piezo
            yield f"load.parameters.{name}", value


def by_ensembles(
    problem: Problem, power: Value, report: Callable[[float], None], deadline: float = math.inf
) -> PowerDifferences:
    """The normalised sensitivity d ln P/d ln key in each key, from ensembles on the same noise.

    ``power`` is the scene's mean power, for its relative time-step error (`_step_error`).  A key that cannot be
    larger, such as a restitution of 1, is not varied.  Keys for which there is no time until
    ``deadline`` (s, of `time.monotonic`) are left, and one without an answer has its error.

    Raises InputError and SimulationError as engine `compiled`, and the latter for a load without
    power.
    """
    check_power(power.value)
    known = [
        (key, value, change)
        for key, value in keys_with_elements(problem)
        if (change := largest_change(problem, key, value))
    ]
    settled = _Settled(problem, deadline)
    step_error = _step_error(problem.equations, power)
    done = PowerDifferences()
    seconds = 2.0 * (SETTLING + WINDOWS[0]) * settled.seconds  # that a key needs at least
    for k, (key, value, change) in enumerate(known):
        begin = time.monotonic()
        if begin + seconds > deadline:
            done.left = [key for key, *_ in known[k:]]
            done.seconds = seconds * len(done.left)
            break
        own_deadline = begin + (deadline - begin) / (len(known) - k)
        try:
            pair = _Pair(settled, key, value, change)
            slope = pair.elasticity(own_deadline)
        except HarvesterError as error:
            done.failed[key] = error
        else:
            slope = replace(slope, bias=(slope.bias or 0.0) + step_error)
            slope = slope.with_unknown(settled.unknown).with_unknown(Compiled.UNKNOWN)
            done.by_key[key] = value, slope
            seconds = max(seconds, pair.least_seconds)
        report((k + 1) / len(known))
    return done


def _step_error(eqs: Equations, power: Value) -> float:
    """The relative step error of the ensembles: the ``power`` of a `RichardsonPair` is extrapolated."""
    is_extrapolated = step_order(eqs) >= STRONG and not eqs.is_shaken_otherwise
    return abs((power.bias or 0.0) / power.value) / (LEFT if is_extrapolated else 1.0)


@dataclass
class _Settled:
    """An ensemble after its burn-in, from which others continue with one key changed."""

    problem: Problem
    deadline: float

    def __post_init__(self) -> None:
        budget = None if math.isinf(self.deadline) else self.deadline - time.monotonic()
        count = enough_runs(self.problem.equations, BATCH)
        model = Compiled().model(self.problem)
        first = Trajectories(
            self.problem.equations, count, ROOT, circuit=model.circuit, controlled=True
        )
        compile_pair(first, budget)
        begin = time.monotonic()
        burn_in(first, budget)
        self.seconds = time.monotonic() - begin
        self.unknown = "" if first.hopping is None else WELLS
        self.together = first.together
        self.count = count
        self.h = first.h
        self.time = first.time
        self.origin: Any = (first.state.copy(), first.filter.copy(), first.words.copy())

    def continued(self, problem: Problem) -> "_Continued":
        """The ensemble of a problem, from here on."""
        ratio = problem.scales.frequency / self.problem.scales.frequency
        model = Compiled().model(problem)
        ensemble = Trajectories(
            problem.equations,
            self.count,
            ROOT,
            self.h * ratio,
            circuit=model.circuit,
            controlled=True,
            origin=self._origin_of(problem.equations),
        )
        ensemble.run(SETTLING * self.time * ratio)
        watts = problem.units.watts * (problem.equations.beta or 0.0)
        return _Continued(ensemble, self.time * ratio, watts)

    def _origin_of(self, eqs: Equations) -> tuple[Any, Any, Any]:
        """The states at the end of the burn-in, with a sinusoid of the amplitude in ``eqs``."""
        state, shaking, words = self.origin
        before = self.problem.equations.drive
        if before is not None and eqs.drive is not None:
            shaking = shaking.copy()
            shaking[:, -2:] *= eqs.drive / before
        return state, shaking, words

    @cached_property
    def unchanged(self) -> "_Continued":
        """The ensemble of the scene itself."""
        return self.continued(self.problem)


@dataclass
class _Continued:
    """The means of an ensemble over the first one, two and more `WINDOWS`.

    ``burn_in`` is the nondimensional time of a burn-in, ``watts`` the unit of the load's power.
    """

    ensemble: Trajectories
    burn_in: float
    watts: float
    means: list[Moments] = field(default_factory=list)

    def log_power(self, windows: int) -> _Entries:
        """Entries with the mean ln P, to first order in their spread, and their controls."""
        while len(self.means) < windows:
            k = len(self.means)
            moments = self.ensemble.run(WINDOWS[k] * self.burn_in)
            if k:
                moments = self.means[-1].mixed(moments, WINDOWS[k] / sum(WINDOWS[: k + 1]))
            self.means.append(moments)
        moments = self.means[windows - 1]
        mean = float(controlled_entries(moments.load, moments.controls).mean())
        check_power(mean)
        return math.log(mean * self.watts) + (moments.load - mean) / mean, moments.controls


class _Pair:
    """The ensembles of a key at more and less than its value, by the part ``change``."""

    def __init__(self, settled: _Settled, key: str, value: float, change: float) -> None:
        self.settled = settled
        self.change = change
        self.begin = time.monotonic()
        self.more, self.less = (
            settled.continued(
                Problem(settled.problem.scene.vary(key, (1.0 + sign * change) * value))
            )
            for sign in (1, -1)
        )
        self.least_seconds = 0.0  # that one such key needs

    def elasticity(self, deadline: float) -> Value:
        """The sensitivity over the shortest window with a small error, or the last in time."""
        for windows in range(1, len(WINDOWS) + 1):
            begin = time.monotonic()
            slope = self._over(windows)
            now = time.monotonic()
            self.least_seconds = self.least_seconds or now - self.begin
            if slope.sampling95 <= SMALL * max(abs(slope.value), 1.0):
                break
            if now + 2.0 * (now - begin) > deadline:
                break
        return slope

    def _over(self, windows: int) -> Value:
        """The sensitivity over so many windows, with the error of the finite change as its bias."""
        up = math.log1p(self.change)
        down = math.log1p(-self.change)
        more, less, unchanged = (
            each.log_power(windows) for each in (self.more, self.less, self.settled.unchanged)
        )
        slope = self._difference(more, less).scaled(1.0 / (up - down))
        bent = self._difference(_slope(more, unchanged, up), _slope(less, unchanged, down))
        return replace(slope, bias=0.5 * abs(bent.value))

    def _difference(self, high: _Entries, low: _Entries) -> Value:
        """The mean of ``high`` less that of ``low``."""
        return difference95(high[0], low[0], (high[1], low[1]), self.settled.together)


def _slope(changed: _Entries, unchanged: _Entries, width: float) -> _Entries:
    """Entries of (ln P(1 + d) - ln P)/ln(1 + d) and their controls, with ``width`` = ln(1 + d)."""
    values = (changed[0] - unchanged[0]) / width
    if changed[1] is None or unchanged[1] is None:
        return values, None
    return values, (changed[1] - unchanged[1]) / width
