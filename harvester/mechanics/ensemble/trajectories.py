"""Many trajectories side by side, and their means.

One compiled kernel advances a batch of `BATCH` trajectories in a thread of its own.  Every
trajectory gives one independent time average, so that standard errors need no correlation time; for
tabulated noise every block, on a record.  The kernels are `harvester.mechanics.ensemble.loads`'s.

Long because running, beginning anew and reporting share the states.
"""

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.bounds import check_bounded
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError, UnboundedResponseError, invalid
from harvester.machine.threads import end_if_given_up
from harvester.mechanics.ensemble.block_threads import each
from harvester.mechanics.ensemble.hopping import Hopping
from harvester.mechanics.ensemble.loads import loaded
from harvester.mechanics.ensemble.own_circuit import OwnCircuit
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.moments import Moments, from_sums
from harvester.mechanics.kernels.noise import child, random_words
from harvester.mechanics.kernels.path import check_start
from harvester.mechanics.kernels.shaking import (
    Filter,
    filter_of,
    filter_start,
    of_batch,
    rows_of,
    samples_of,
)
from harvester.mechanics.kernels.step_size import STEP, remedy, typical_frequency, whole_steps
from harvester.mechanics.kernels.trajectory_batch import IDEAL_SUMS, Schedule

SHORTEST, LONGEST = 1e-6, 1e3  # steps
MOST_OF_A_PERIOD = 2e6  # steps
MOST_STEPS = 1e10  # of one trajectory in one go
# steps of a trajectory with a circuit of its own between two looks whether it is given up, at most
PIECE = 4096
WATCHED = 8  # the same, at first, and between two looks at a deadline: some 4 % of the time

REPORTED = 0.1  # s from one report of the progress to the next

# called with the share that is done
Progress = Callable[[float], None]


class NotFiniteError(UnboundedResponseError):
    """A trajectory left the finite numbers: by growth, or by a step too long for its stiffness."""


class LateError(SimulationError):
    """A run that was given up, as it would have passed its deadline."""


class Trajectories:
    """A set of trajectories in blocks of `BATCH`, with their own random generators.

    ``count`` is their number, ``together`` of them are on one recording of a density, ``h`` is the
    nondimensional step, ``time`` how far they are and ``steps`` the trajectory-steps made in all;
    ``state`` holds x, x', V (with a circuit also its capacitor's voltage and the switch's place),
    shape (blocks, 3 or 5, BATCH), after a kick.

    Parameters
    ----------
    eqs
        nondimensional equations.
    count
        rounded up to whole blocks; the result depends neither on threads nor on their number.
    seed
        the same seed, the same trajectories.
    h
        nondimensional step; None: `STEP` over `typical_frequency`, which the burn-in may make
        shorter.
    start
        x, x' and V at the beginning, shape (3,) or (3, count) with whole blocks; None: at rest, in
        each of `resting_places` in turn.  If nothing random shakes it, off it by 1 or half-way to
        the opposite stop; under a harmonic excitation spread over that distance, so that several
        responses to it are found.
    circuit
        the load, in place of the resistive one of the equations; its capacitor is empty at first.
    ngspice_rule
        advance the load resistor by ngspice's integration rule
        (`harvester.mechanics.kernels.ngspice_rule`), for a stop at rest or none.
    controlled
        with the sums of mean zero that make means cheaper, if white or coloured noise has any:
        see `harvester.mechanics.kernels.control_variates`, `circuit_features` and
        `shaken_features`.
    origin
        ``state``, ``filter`` and ``words`` of others, to continue from.

    Raises InputError for a start behind a stop, a step out of range, and a circuit on a device with
    mu.
    """

    def __init__(
        self,
        eqs: Equations,
        count: int,
        seed: np.random.SeedSequence,
        h: float | None = None,
        start: Floats | None = None,
        circuit: IdealCircuit | OwnCircuit | None = None,
        ngspice_rule: bool = False,
        controlled: bool = False,
        origin: tuple[Any, Any, Any] | None = None,
    ) -> None:
        driven = circuit is not None
        check_bounded(eqs, driven)
        if driven and eqs.mu is not None:
            raise invalid("mu with a load circuit", "be None", eqs.mu)
        if h is not None and not SHORTEST <= h <= LONGEST:
            raise invalid(
                "`dt`", f"be between {SHORTEST:g} and {LONGEST:g} times 1/w0", f"{h:.3g}/w0"
            )
        self.blocks = -(-count // BATCH)
        self.count = self.blocks * BATCH
        self.together = 1 if eqs.density is None else BATCH
        resting = np.array(eqs.resting_places)
        start = start_of(eqs, self.count) if start is None else start
        check_start(eqs.rigid_stops, start[0].min(), start[0].max())
        self.eqs = eqs
        self.seed = seed
        self.step_is_fixed = h is not None
        self.start = start
        self.ngspice_rule = ngspice_rule
        self.steps = 0
        self.moving = BATCH  # trajectories of each block, with a circuit's own kernel
        self.rate = math.inf  # steps per second, if it was measured
        self.put_behind(circuit)
        self.hopping: Hopping | None = None  # if transitions are too rare to forget the start
        self.controlled = controlled and not ngspice_rule and self.loaded.has_controls
        self._alike: Callable[..., Trajectories] = partial(
            Trajectories, circuit=circuit, ngspice_rule=ngspice_rule, controlled=self.controlled
        )
        self.own_sums: Any = 0.0  # what the load alone has counted, in all
        # the first: of a step whose noise is that of the steps in it
        self.doublings = 0
        self._origin = origin
        self.restart(STEP / typical_frequency(eqs, float(np.max(resting**2))) if h is None else h)

    def restart(self, h: float) -> None:
        """Begin again with a step of h, or the next shorter one of which a period has whole multiples.

        Raises SimulationError for an excitation so fast that its steps are below `SHORTEST`, or so
        slow that a period has more than `MOST_OF_A_PERIOD`.
        """
        repeat = self.eqs.shaking_period
        self.h = h = whole_steps(h, repeat)
        self.time = 0.0
        self.hopping = None
        self.stride = 2 if self.eqs.drive is not None else stride_of(h)
        if repeat is not None:  # whole samples to a period
            _check_period(h, repeat)
            self.stride = max(
                2, math.gcd(round(repeat / h) // 16, 2 ** int(math.log2(self.stride)))
            )
        self.is_brief = False
        start = np.moveaxis(self.start.reshape(3, -1, BATCH if self.start.ndim > 1 else 1), 1, 0)
        self.state = aligned((self.blocks, self.loaded.rows, BATCH))
        self.state[:, :3] = start
        self.loaded.begin(self.state)
        self.words = aligned((self.blocks, 2, BATCH), np.uint64)
        for k, words in enumerate(self.words):
            words[:] = random_words(child(self.seed, 0, k), BATCH)
        self.filter = aligned((self.blocks, rows_of(self.eqs), BATCH))
        self.shakers: list[Filter | None] = [None] * self.blocks
        if self.eqs.is_shaken_otherwise:
            self._begin_shaking()
        if self._origin is not None:
            self.state[:], self.filter[:], self.words[:] = self._origin

    def put_behind(self, circuit: IdealCircuit | OwnCircuit | None) -> None:
        """Continue with a circuit of the same elements with other values."""
        self.circuit = circuit
        self.loaded = loaded(self.eqs, circuit)

    def _begin_shaking(self) -> None:
        """Make the filters of excitation other than white noise.

        All share a record that is not drawn at random.
        """
        coarse = self.doublings > 0
        grid = 0.5 * self.h if coarse else self.h
        known = filter_of(self.eqs, self.h, coarse)
        samples = None
        for k, (states, words) in enumerate(zip(self.filter, self.words, strict=True)):
            rng = np.random.default_rng(child(self.seed, 2, k))
            if k == 0 or self.eqs.density is not None:
                samples = samples_of(self.eqs, grid, rng)
            states[:] = filter_start(self.eqs, grid, BATCH, rng, samples)
            self.shakers[k] = of_batch(known, states, words, samples)

    def run(
        self, duration: float, progress: Progress | None = None, deadline: float = math.inf
    ) -> Moments:
        """Advance all trajectories by ``duration`` (rounded to whole samples and periods) and average.

        Raises UnboundedResponseError when a trajectory leaves the finite numbers, CircuitError
        if too many circuit steps fail, and LateError if those of a circuit of its own would pass
        the ``deadline`` (`time.perf_counter`).
        """
        end_if_given_up()
        if duration > MOST_STEPS * self.h:
            most = f"be at most {MOST_STEPS:.0e} steps"
            raise invalid("`duration`", most, f"{duration / self.h:.3g} steps")
        time = self.stride * self.h  # from one sample to the next
        repeat = time if self.is_brief else self.eqs.shaking_period or time
        samples_a_period = round(repeat / time)
        samples = samples_a_period * max(1, round(duration / (samples_a_period * time)))
        pair = self.loaded
        sums = aligned((self.blocks, pair.sums, BATCH))
        noise = aligned((self.blocks, pair.martingales, BATCH)) if self.controlled else None
        begin = pair.boundary(self._states()) if self.controlled else np.empty(0)
        landed = self.ngspice_rule and self.time > 0.0
        schedule = Schedule(samples, self.stride, self.doublings, landed, self.moving)
        steps = PIECE if math.isinf(deadline) else WATCHED
        longest = max(1, steps // self.stride) if pair.is_dear else samples
        reached = np.zeros(self.blocks)
        given_up = threading.Event()
        reported = [perf_counter()]

        def block(k: int) -> None:
            controls = None if noise is None else noise[k]
            batch = pair.batch(self.state[k], self.words[k], sums[k], controls)
            piece = max(1, WATCHED // self.stride) if pair.is_dear else samples
            done = 0
            while done < samples:
                begun = perf_counter()
                part = schedule._replace(samples=min(piece, samples - done))
                shaker = self.shakers[k]
                pair.advance(batch, self.state[k], part, self.h, shaker, self.ngspice_rule)
                if not np.abs(self.state[k]).max() < pair.largest:
                    self.state[k] = math.nan
                reached[k] = done = done + part.samples
                piece = min(2 * piece, longest)
                if progress is not None and begun >= reported[0] + REPORTED:
                    reported[0] = begun
                    progress(float(reached.mean()) / samples)
                if done < samples and 2.0 * perf_counter() - begun > deadline:
                    given_up.set()
                if given_up.is_set() or math.isnan(self.state[k, 0, 0]):
                    break

        each(block, self.blocks, samples * self.stride, given_up)
        self.steps += round(reached.sum()) * self.stride * BATCH
        elapsed = samples * time
        if not given_up.is_set():
            self.time += elapsed
        if not all(
            np.isfinite(array).all() for array in (sums, self.state, noise) if array is not None
        ):
            raise NotFiniteError(
                f"the response grows without bound: it left the finite numbers after {self.time:g}/w0 "
                f"at a step of {self.h:.3g}/w0; {remedy(self.eqs, self.h)}"
            )
        self.own_sums = self.own_sums + sums[:, len(IDEAL_SUMS) :].sum(axis=(0, 2))
        pair.check(self.own_sums, self.state)
        if given_up.is_set():  # and no failed steps are the cause
            raise LateError("the run would not end in the time for it: give a longer `budget`")
        moments = from_sums(sums, samples, elapsed, pair.loss_unit, self.eqs.load)
        if noise is None:
            return moments
        known = pair.controls(np.hstack(list(noise)), pair.boundary(self._states()) - begin)
        return replace(moments, controls=known.T / elapsed)

    @property
    def stored(self) -> Floats:
        """The energy in storage of each trajectory now, as of `Loaded.stored`: shape (count,)."""
        return self.loaded.stored(self.state)

    def snapshot(self) -> Floats:
        """Displacement, velocity and voltage of all trajectories now, in mid-drift: shape (3, count)."""
        out = np.empty((3, self.count))
        if self.ngspice_rule and self.time > 0.0:
            return self._states().copy()
        # in one piece, also of several blocks: else their kernel is compiled twice
        columns = np.empty((3, BATCH))
        for k, shaker in enumerate(self.shakers):
            batch = self.loaded.batch(self.state[k], self.words[k], None, None)
            self.loaded.mid_drift(batch, self.state[k], columns, self.h, shaker)
            out[:, k * BATCH : (k + 1) * BATCH] = columns
        return out

    def _states(self) -> Floats:
        """The state after a kick of all trajectories, shape (3 or 5, count)."""
        return np.moveaxis(self.state, 0, 1).reshape(self.state.shape[1], -1)

    def brief(self, h: float | None) -> "Trajectories":
        """A fresh block of such trajectories with samples of two steps, whole periods or not."""
        brief = self._alike(self.eqs, 1, self.seed, h, None)
        brief.stride = 2
        brief.is_brief = True
        return brief

    def with_step(self, h: float) -> "Trajectories":
        """Fresh trajectories of the same scene and number at another step, on other noise."""
        return self._alike(self.eqs, self.count, child(self.seed, 1), h, self.start)

    def coarser(self) -> "Trajectories":
        """Fresh trajectories of the same scene, number and start at twice the step, on the same noise.

        Without excitation other than white noise these have coarser ones as well.
        """
        other = self._alike(self.eqs, self.count, self.seed, 2.0 * self.h, self.start)
        other.doublings = self.doublings + 1
        other._origin = self._origin
        other.restart(other.h)
        other.stride = max(self.stride // 2, 1)
        other.is_brief = self.is_brief
        return other

    def continued(self, eqs: Equations, h: float) -> "Trajectories":
        """Trajectories that continue under a harmonic excitation of another frequency, at a step up to h."""
        now = self.state.copy(), self.filter.copy(), self.words.copy()
        return self._alike(eqs, self.count, child(self.seed, 3), h, self.start, origin=now)


def start_of(eqs: Equations, count: int) -> Floats:
    """The beginning of trajectories, as of `Trajectories`: shape (3, count)."""
    resting = np.array(eqs.resting_places)
    off = np.resize(np.minimum(1.0, 0.5 * (eqs.rigid_stops[1] - resting)), count)
    if eqs.is_shaken:
        off *= 0.0 if eqs.is_random else np.linspace(0.0, 1.0, count)
    start = np.zeros((3, count))
    start[0] = np.resize(resting, count) + off
    return start


def stride_of(h: float) -> int:
    """Steps of h from one sample to the next, 0.4 or so later; V^2 varies on the scale of 1.

    There are two steps to a draw of noise.  Under a drive V^2 jumps at each impact, and every two
    steps are a sample.
    """
    return 2 * max(1, round(0.2 / h))


def _check_period(h: float, repeat: float) -> None:
    """Refuse an excitation whose period ``repeat`` is too short or too long for steps of h."""
    period = f"the excitation repeats after {repeat:.2g}/w0"
    if h < SHORTEST:
        raise SimulationError(
            f"{period}, too fast for the mass to follow: a step would be {h:.1e}/w0"
        )
    if repeat > MOST_OF_A_PERIOD * h:
        raise SimulationError(
            f"{period}, which would need {repeat / h:.1e} steps of {h:.2g}/w0: too slow for the response, "
            "which follows it as at rest; give a longer `dt`, or a shorter record"
        )
