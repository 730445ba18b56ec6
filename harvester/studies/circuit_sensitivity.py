"""Normalised sensitivities of a netlist's power: its compiled circuit at two values of each key on the same noise.

All ensembles continue from one burn-in on the noise that follows it, so that powers differ by the
key alone.  White noise is the same in any unit of time: a step is the same part of an ensemble's
own period, since otherwise a key that moves the resonance would turn the phase of the response
against the noise.  Other excitation has steps of as many seconds.  With ln P a mean over half of
the trajectories, those with more of the key in E+, the others with less in E-,

    E+ = (ln P(1 + d) - ln P)/ln(1 + d),   E- = (ln P(1 - d) - ln P)/ln(1 - d),

the normalised sensitivity at the key's value is between E- and E+ if it only grows or only falls
from 1 - d to 1 + d.  The value is the mean of both, exact for any power law, and half of |E+ - E-|
its step error, plus that of the power at the ensembles' time step, relative.
"""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

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
HALF = BATCH // 2  # trajectories of each block with more of a key; the others have less
# part of the burn-in's time: an ensemble whose key has changed by 5 % settles again in
SETTLING = 0.5
# parts of the burn-in's time: the windows of a mean, until its error is small
WINDOWS = (0.125, 0.125, 0.25, 0.25, 0.25, 0.5, 0.5, 1.0, 1.0, 2.0, 2.0)
SMALL = 0.01  # sampling error of a sensitivity (95 %) that is sought, of the larger of it and 1


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

    def continued(self, problem: Problem, half: int) -> "_Continued":
        """Half 0 or 1 of the trajectories of each block, with one key changed."""
        if self.problem.equations.is_shaken_otherwise:
            ratio = problem.scales.frequency / self.problem.scales.frequency
        else:
            before, after = (each.equations.beta or 0.0 for each in (self.problem, problem))
            stiffer = (1.0 + after * self._stiffening) / (1.0 + before * self._stiffening)
            ratio = 1.0 / math.sqrt(stiffer)
        return self._continued(problem, ratio, half * HALF, HALF)

    def _continued(self, problem: Problem, ratio: float, first: int, moving: int) -> "_Continued":
        """So many trajectories of each block from the ``first`` on.

        ``ratio`` is that of the step to the burn-in's, both nondimensional.
        """
        model = Compiled().model(problem)
        ensemble = Trajectories(
            problem.equations,
            self.count,
            ROOT,
            self.h * ratio,
            circuit=model.circuit,
            controlled=True,
            origin=tuple(
                np.roll(array, -first, axis=-1) for array in self._origin_of(problem.equations)
            ),
        )
        ensemble.moving = moving
        settling = ensemble.run(SETTLING * self.time * ratio)
        watts = problem.units.watts * (problem.equations.beta or 0.0)
        return _Continued(ensemble, self.time * ratio, watts, settling)

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
        return self._continued(self.problem, 1.0, 0, BATCH)

    @cached_property
    def _stiffening(self) -> float:
        """The part of beta, the stiffness of an open piezo, in the mean squared frequency."""
        settling = self.unchanged.settling
        spread = settling.x2.mean() - settling.x.mean() ** 2
        stiffening = (settling.v2.mean() / spread - 1.0) / (self.problem.equations.beta or 1.0)
        return float(np.clip(stiffening, 0.0, 1.0))


@dataclass
class _Continued:
    """The means of an ensemble over the first one, two and more `WINDOWS`.

    ``burn_in`` is the nondimensional time of a burn-in, ``watts`` the unit of the load's power,
    ``settling`` the means before the first window.
    """

    ensemble: Trajectories
    burn_in: float
    watts: float
    settling: Moments
    means: list[Moments] = field(default_factory=list)

    def log_power(self, windows: int, half: int) -> Floats:
        """Entries of a half with the mean ln P, to first order in their spread, and controls.

        Shape (blocks, HALF, 1 + controls).
        """
        while len(self.means) < windows:
            k = len(self.means)
            moments = self.ensemble.run(WINDOWS[k] * self.burn_in)
            if k:
                moments = self.means[-1].mixed(moments, WINDOWS[k] / sum(WINDOWS[: k + 1]))
            self.means.append(moments)
        moments = self.means[windows - 1]
        controls = [] if moments.controls is None else [moments.controls]
        table = np.column_stack([moments.load, *controls])
        table = table.reshape(-1, 2, HALF, table.shape[1])[:, half]
        load = table[..., 0].ravel()
        mean = float(controlled_entries(load, table.reshape(len(load), -1)[:, 1:]).mean())
        check_power(mean)
        table[..., 0] = math.log(mean * self.watts) + (table[..., 0] - mean) / mean
        return table


class _Pair:
    """Half of the trajectories at more of a key, half at less, by the part ``change``."""

    def __init__(self, settled: _Settled, key: str, value: float, change: float) -> None:
        self.settled = settled
        self.begin = time.monotonic()
        factors = 1.0 + change, 1.0 - change
        self.widths = np.log(factors)[:, None, None]
        self.halves = [
            settled.continued(Problem(settled.problem.scene.vary(key, factor * value)), half)
            for half, factor in enumerate(factors)
        ]
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
        low = [self.settled.unchanged.log_power(windows, half) for half in (0, 1)]
        high = [each.log_power(windows, 0) for each in self.halves]
        lows = np.stack(low, axis=1)
        highs = np.stack(high, axis=1)
        origin = lows[..., 0].mean()
        lows[..., 0] -= origin
        highs[..., 0] -= origin
        lows /= self.widths
        highs /= self.widths
        slope = self._difference(highs, lows)
        highs[..., 0] -= slope.value
        sign = np.sign(self.widths)
        return replace(slope, bias=abs(self._difference(highs * sign, lows * sign).value))

    def _difference(self, highs: Floats, lows: Floats) -> Value:
        """The mean of ``highs`` less that of ``lows``, entries of both halves of each block."""
        high = highs.reshape(-1, highs.shape[-1])
        low = lows.reshape(high.shape)
        controls = high[:, 1:], low[:, 1:]
        return difference95(high[:, 0], low[:, 0], controls, self.settled.together)
