"""Trajectories of many scenes of the same effects, which run by the kernel of all ensembles.

The work that `harvester.mechanics.ensemble.trajectories`, `burn_in` and `richardson` do for a scene
alone is done here for n scenes at a time: their states, sums and controls are rows of the same
arrays, and means and weights are computed for all at once.  A scene's numbers depend on itself and
its seed alone, and not on the other scenes.

Rare cases are left to the run of a scene alone (`Designs.left`): numbers that leave the finite
ones, a response that dies out or is not stationary in time, and a step whose double is unstable.

Long because one set of arrays is run, burnt in and averaged.
"""

import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harvester.arrays import Bools, Floats, aligned
from harvester.equations.coefficients import Equations
from harvester.equations.impact_order import STRONG, step_order
from harvester.mechanics.ensemble.affordable_steps import COMPLIANT, FIRST_WINDOW, MOST_STEPS
from harvester.mechanics.ensemble.block_threads import each
from harvester.mechanics.ensemble.burn_in import CORRELATION_TIMES, GROWN, LONGEST
from harvester.mechanics.ensemble.loads import CHARGING_TIMES, LOAD_TIMES
from harvester.mechanics.ensemble.trajectories import start_of, stride_of
from harvester.mechanics.kernels.circuit_control_variates import circuit_boundary
from harvester.mechanics.kernels.coefficients import BATCH, Coefficients
from harvester.mechanics.kernels.control_variates import MARTINGALES, boundary
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.intervals import update_of
from harvester.mechanics.kernels.moments import Moments, from_sums
from harvester.mechanics.kernels.noise import child, random_words
from harvester.mechanics.kernels.offset_stops import loss_unit
from harvester.mechanics.kernels.step_size import STEP, chatter, shorter_step, typical_frequency
from harvester.mechanics.kernels.trajectory_batch import IDEAL_SUMS, SUMS, Batch, Schedule, advance
from harvester.mechanics.trace import mechanics_of

Indices = NDArray[np.intp]

UNSTABLE = 1e3  # times the fine step's E[x^2]: a coarse step that is unstable
MOST_RESTARTS = 8


@dataclass(frozen=True)
class Design:
    """One scene of a set: its equations, its circuit if it has one, and its seed."""

    eqs: Equations
    circuit: IdealCircuit | None
    seed: np.random.SeedSequence


def can_be_one_of_many(eqs: Equations) -> bool:
    """Whether scenes like this run side by side: those with one mode and one well, under white noise alone."""
    return (
        not eqs.modes
        and eqs.is_shaken_by_white_noise
        and eqs.is_shaken
        and not eqs.has_unlike_wells
    )


class Designs:
    """Scenes with the same effects, each with ``count`` trajectories at its step and longer ones.

    ``h`` is the step of each, ``burn_in`` and ``duration`` the nondimensional times before and of
    the averages, ``steps`` the trajectory-steps, ``left`` the scenes that are given up here.
    """

    def __init__(self, designs: Sequence[Design], count: int) -> None:
        n = len(designs)
        eqs = [design.eqs for design in designs]
        self.designs = [*designs]
        self.blocks = -(-count // BATCH)
        self.count = self.blocks * BATCH
        self.order = np.array([step_order(part) for part in eqs])
        self.levels = 2 if self.order[0] >= STRONG else 3
        self.is_circuit = bool(designs[0].circuit)
        self.coefficients = [mechanics_of(part).coefficients for part in eqs]
        self.seeds = [design.seed for design in designs]
        self.h = np.array(
            [
                STEP / typical_frequency(part, float(np.max(np.array(part.resting_places) ** 2)))
                for part in eqs
            ]
        )
        self.burn_in = np.zeros(n)
        self.duration = np.zeros(n)
        self.steps = np.zeros(n)
        self.left: Bools = np.zeros(n, dtype=bool)
        self.coarse_stopped: Bools = np.zeros(n, dtype=bool)
        self._samples = np.zeros((self.levels, n), dtype=int)  # of the sums
        self.elapsed = np.zeros(n)
        rows = 5 if self.is_circuit else 3
        shape = (self.levels, n, self.blocks)
        self._state = aligned((*shape, rows, BATCH))
        self._words = aligned((*shape, 2, BATCH), np.uint64)
        self._sums = aligned((*shape, len(IDEAL_SUMS if self.is_circuit else SUMS), BATCH))
        self._martingales = aligned((*shape, MARTINGALES, BATCH))
        self._begin = np.zeros(0)
        self._unit = np.array(
            [1.0 if self.is_circuit else loss_unit(part) for part in self.coefficients]
        )
        self._load = np.array([part.load or 0.0 for part in eqs])
        self._columns = [_column(values) for values in zip(*self.coefficients, strict=True)]

    def run_burn_in(self, which: Indices) -> None:
        """Run scenes from rest until their start is forgotten, at a step that is short enough."""
        for _ in range(MOST_RESTARTS):
            self._restart(which)
            moments = self._until_steady(which)
            too_long = []
            for row, d in enumerate(which):
                if self.left[d]:
                    continue
                eqs = self.designs[d].eqs
                x2, v2 = moments["x2"][0][row], moments["v2"][0][row]
                frequency = typical_frequency(eqs, x2, v2)
                shorter = shorter_step(self.h[d], frequency)
                if shorter is not None:
                    self.h[d] = shorter
                    too_long.append(d)
                elif self.h[d] * max(frequency, chatter(eqs.pressure, eqs.n1, v2)) > 5 * STEP:
                    self.left[d] = True
            which = np.array(too_long, dtype=np.intp)
            if not len(which):
                return
        self.left[which] = True

    def begin_pair(self, which: Indices, durations: Floats) -> None:
        """Let the longer steps follow through the burn-in, and average all for a first time."""
        which, durations = which[~self.left[which]], durations[~self.left[which]]
        self.burn_in[which] = np.maximum(self.elapsed[which], FIRST_WINDOW)
        self._run(which, self.elapsed[which], range(1, self.levels))
        for array in (self._sums, self._martingales):
            array[:, which] = 0.0
        self._samples[:, which] = 0
        self.elapsed[which] = self.duration[which] = 0.0
        self.coarse_stopped[which] = False
        begin = self._boundary(which)
        if not self._begin.size:
            self._begin = np.zeros((self.levels, len(self.designs), *begin.shape[2:]))
        self._begin[:, which] = begin
        self.extend(which, durations)

    def extend(self, which: Indices, durations: Floats) -> None:
        """Go on averaging; scenes whose bias is known, without their longer steps."""
        both = ~self.coarse_stopped[which]
        every = range(self.levels)
        for part, levels in ((which[both], every), (which[~both], range(1))):
            if len(part):
                times = durations[np.isin(which, part)]
                samples = self._run(part, times, levels)
                self._samples[: len(samples), part] += samples
                self.elapsed[part] += samples[0] * self._sample_time(part)
        self.duration[which] = self.elapsed[which]
        x2 = [self.moments(which, level).x2.mean(axis=1) for level in every]
        for level in every[1:]:
            unstable = both & ~(x2[level] < UNSTABLE * x2[0])
            self.left[which[unstable]] = True

    def begin_again(self, which: Indices, factors: Floats) -> None:
        """Run and average scenes anew at other steps on other noise, for as long as before."""
        durations = self.duration[which]
        self.h[which] *= factors
        for d in which:
            self.seeds[d] = child(self.seeds[d], 1)
        self.run_burn_in(which)
        self.begin_pair(which, durations)

    def moments(self, which: Indices, level: int = 0) -> Moments:
        """Time averages of scenes at a step, each of shape (scenes, count)."""
        samples = self._samples[level, which]
        return self._moments_of(which, level, samples, samples * self._sample_time(which, level))

    def _moments_of(
        self, which: Indices, level: int, samples: Floats | NDArray[np.int_], elapsed: Floats
    ) -> Moments:
        sums = self._sums[level, which].reshape(-1, self._sums.shape[-2], BATCH)
        moments = from_sums(
            sums,
            np.repeat(samples, self.count),
            np.repeat(elapsed, self.count),
            np.repeat(self._unit[which], self.count),
            np.repeat(self._load[which], self.count),
        )
        return Moments(
            **{
                name: values.reshape(-1, self.count)
                for name, values in vars(moments).items()
                if values is not None
            }
        )

    def controls(self, which: Indices, levels: range) -> Floats:
        """Sums of mean zero over the time: shape (levels, scenes, count, columns)."""
        some = slice(levels.stop)
        change = self._boundary(which, some) - self._begin[some, which]
        martingales = _by_lane(self._martingales[some, which])
        if self.is_circuit:
            pairs = np.stack([martingales, change], axis=-1)
            both = pairs.reshape(*pairs.shape[:-2], -1)
        else:
            both = np.concatenate([martingales, change], axis=-1)
        return np.asarray(both / self.elapsed[which][:, None, None])

    def stop_coarse(self, which: Indices | int) -> None:
        """Stop the longer steps of scenes."""
        self.coarse_stopped[which] = True

    def _restart(self, which: Indices) -> None:
        for d in which:
            design = self.designs[d]
            start = start_of(design.eqs, self.count)
            first = np.moveaxis(start.reshape(3, -1, BATCH), 1, 0)
            self._state[:, d] = 0.0
            self._state[:, d, :, :3] = first
            if self.is_circuit:
                self._state[:, d, :, 4] = first[:, 0]
            for k in range(self.blocks):
                self._words[:, d, k] = random_words(child(self.seeds[d], 0, k), BATCH)
        self.elapsed[which] = 0.0

    def _until_steady(self, which: Indices) -> dict[str, tuple[Floats, Floats]]:
        """The burn-in: mean and error of moments of each scene's last window."""
        memory = np.array([self._load_memory(d) for d in which])
        length = np.full(len(which), FIRST_WINDOW)
        last = {name: (np.zeros(len(which)), np.zeros(len(which))) for name in _WATCHED}
        before = {name: (np.full(len(which), np.nan), np.zeros(len(which))) for name in _WATCHED}
        first = np.full(len(which), np.nan)
        running = np.arange(len(which))
        while len(running):
            d = which[running]
            weight = np.array(
                [1.0 if self.designs[k].eqs.stop_stiffness is None else COMPLIANT for k in d]
            )
            more = length[running] / self.h[d] * self.count
            self.left[d] |= weight * (self.steps[d] + more) > MOST_STEPS
            running = running[~self.left[d]]
            d = which[running]
            self._sums[0, d] = 0.0
            (samples,) = self._run(d, length[running], range(1))
            times = samples * self._sample_time(d)
            self.elapsed[d] += times
            now, entries = self._window(d, samples)
            energy = now["x2"][0] + now["v2"][0]
            first[running] = np.where(np.isnan(first[running]), energy, first[running])
            same = np.ones(len(running), dtype=bool)
            for name in _WATCHED:
                same &= _agree(now[name], [part[running] for part in before[name]])
                for part, new in zip(last[name], now[name], strict=True):
                    part[running] = new
                for old, new in zip(before[name], now[name], strict=True):
                    old[running] = new
            response = CORRELATION_TIMES * self._memory(d, entries, times)
            odd = ~np.isfinite(energy) | (energy > GROWN * first[running])
            odd |= (energy <= first[running] / GROWN) | (self.elapsed[d] >= LONGEST)
            self.left[d] |= odd
            forgotten = same & (self.elapsed[d] >= np.maximum(memory[running], response))
            length[running] *= 2.0
            running = running[~forgotten & ~odd]
        return last

    def _load_memory(self, d: int) -> float:
        design = self.designs[d]
        if design.circuit:
            return CHARGING_TIMES * design.circuit.memory
        return 0.0 if design.eqs.mu is None else LOAD_TIMES / design.eqs.mu

    def _window(
        self, d: Indices, samples: NDArray[np.int_]
    ) -> tuple[dict[str, tuple[Floats, Floats]], dict[str, Floats]]:
        """Means with errors, and the entries, shape (scenes, count), that a burn-in checks."""
        moments = self._moments_of(d, 0, samples, np.ones(len(d)))
        entries = {name: getattr(moments, name) for name in _WATCHED}
        return {name: _mean_and_error(values) for name, values in entries.items()}, entries

    def _memory(self, d: Indices, window: dict[str, Floats], times: Floats) -> Floats:
        """The longest correlation time of energy, V^2 and load power, by states after a kick."""
        states = _by_lane(self._state[0, d])
        x, v, voltage = np.moveaxis(states[..., :3], -1, 0)
        pairs = [(window["x2"] + window["v2"], x * x + v * v), (window["V2"], voltage * voltage)]
        if self.is_circuit:
            pairs.append((window["load"], states[..., 3] ** 2 * self._load_mu(d)[:, None]))
        longest = np.zeros(len(d))
        for means, values in pairs:
            spread = values.var(axis=1)
            ratio = np.divide(
                means.var(axis=1), spread, out=np.zeros_like(spread), where=spread > 0.0
            )
            longest = np.maximum(longest, 0.5 * times * ratio)
        return longest

    def _load_mu(self, d: Indices) -> Floats:
        return np.array([self.designs[k].circuit.mu for k in d])

    def _strides(self, which: Indices, level: int = 0) -> NDArray[np.int_]:
        """Steps from one sample to the next: at a longer step half as many, rounded down."""
        return np.array([max(stride_of(h) >> level, 1) for h in self.h[which]], dtype=int)

    def _sample_time(self, which: Indices, level: int = 0) -> Floats:
        return np.asarray(self._strides(which, level) * self.h[which] * 2.0**level)

    def _run(self, which: Indices, durations: Floats, levels: range) -> NDArray[np.int_]:
        """Advance scenes at some of their steps by about ``durations``: numbers of samples at each.

        The longer steps follow the shortest, whose time is whole samples: half of an odd stride is
        not whole, so that theirs are others.
        """
        unit = self._sample_time(which)
        times = np.maximum(np.round(durations / unit), 1.0) * unit
        samples = np.array(
            [
                np.maximum(np.round(times / self._sample_time(which, level)), 1.0)
                for level in levels
            ],
            dtype=int,
        )
        tasks = [*self._tasks(which, samples, levels)]
        made = samples * np.array([self._strides(which, level) for level in levels])
        self.steps[which] += made.sum(axis=0) * self.count
        steps = int(made[0].mean()) if len(which) else 0
        each(lambda k: advance(*tasks[k]), len(tasks), steps, threading.Event())
        finite = np.isfinite(self._state[:, which]).all(axis=(0, 2, 3, 4))
        finite &= np.isfinite(self._sums[:, which]).all(axis=(0, 2, 3, 4))
        self.left[which[~finite]] = True
        return samples

    def _tasks(
        self, which: Indices, samples: NDArray[np.int_], levels: range
    ) -> Iterator[tuple[object, ...]]:
        """The arguments of the kernel, block by block."""
        for row, d in enumerate(which):
            design = self.designs[d]
            for level, numbers in zip(levels, samples, strict=True):
                h = float(self.h[d]) * 2.0**level
                (stride,) = self._strides(which[row : row + 1], level)
                schedule = Schedule(int(numbers[row]), int(stride), level)
                update = update_of(design.eqs, h)
                for k in range(self.blocks):
                    state = self._state[level, d, k]
                    words = self._words[level, d, k]
                    batch = Batch(
                        state,
                        words[0],
                        words[1],
                        self._sums[level, d, k],
                        self._martingales[level, d, k],
                    )
                    yield batch, schedule, h, design.circuit, self.coefficients[d], None, update

    def _boundary(self, which: Indices, some: slice = slice(None)) -> Floats:
        """The functions whose change is a control, now: shape (levels, scenes, count, rows)."""
        states = np.moveaxis(_by_lane(self._state[some, which]), -1, 0)
        columns: list[Any] = [
            None if column is None else column[which][:, None] for column in self._columns
        ]
        of_states = circuit_boundary if self.is_circuit else boundary
        known: Any = Coefficients._make(columns)
        functions = of_states(states, known)
        return np.moveaxis(functions, 0, -1)


_WATCHED = ("x2", "v2", "V2", "load")


def _column(values: Sequence[Any]) -> Floats | None:
    """A coefficient of all scenes, shape (n,); None if it is absent."""
    return None if values[0] is None else np.array(values)


def _by_lane(array: Floats) -> Floats:
    """Rows of blocks, (.., blocks, rows, BATCH), as rows of trajectories, (.., count, rows)."""
    turned = np.moveaxis(array, -2, -1)
    return turned.reshape(*turned.shape[:-3], -1, turned.shape[-1])


def _mean_and_error(values: Floats) -> tuple[Floats, Floats]:
    """Mean and standard error along the last axis."""
    return values.mean(axis=-1), values.std(axis=-1, ddof=1) / math.sqrt(values.shape[-1])


def _agree(now: tuple[Floats, Floats], before: Sequence[Floats]) -> Bools:
    """As `Moments.agrees`, of each scene; False if there is no window before (nan)."""
    (mine, my_error), (theirs, their_error) = now, before
    room = np.maximum(2.0 * np.hypot(my_error, their_error), 1e-3 * np.abs(mine))
    return np.asarray(np.abs(mine - theirs) <= room)
