"""Many trajectories -> stationary means with their errors.

`Ensemble.settle` runs until the start is forgotten, as the data show; `Ensemble.run` adds
up moments afterwards.  Every trajectory gives one independent time average, so standard errors
need no correlation time.
"""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.equations.scaling import Equations
from harvester.errors import SimulationError, UnboundedResponseError, invalid
from harvester.machine.cores import cores
from harvester.mechanics.ensemble.burn_in import PATIENCE, STEPS_A_SECOND, until_steady
from harvester.mechanics.ensemble.histograms import Density, Histogram
from harvester.mechanics.kernels.bounds import (
    chatter,
    check_bounded,
    remedy,
    resting_places,
    room,
    typical_frequency,
)
from harvester.mechanics.kernels.lanes import LANES, SUMS, advance, mid_drift
from harvester.mechanics.kernels.moments import Moments, from_sums
from harvester.mechanics.kernels.ngspice_rule import advance_ruled
from harvester.mechanics.kernels.noise import child, random_words
from harvester.mechanics.kernels.other_stops import loss_unit, stops_of
from harvester.mechanics.kernels.path import check_start, coefficients
from harvester.mechanics.kernels.shaking import (
    has_shaker,
    is_random,
    is_shaken,
    period,
    samples_of,
    shaker,
    shaker_start,
    whole_steps,
)
from harvester.mechanics.rectifiers.circuit import IdealCircuit
from harvester.mechanics.rectifiers.rectifier_lanes import IDEAL_SUMS, advance_ideal, mid_drift_ideal

STEP = 0.1  # default step, in units of 1/(frequency of the settled response)
MOST_OF_A_PERIOD = 2e6  # steps
MOST_STEPS = 1e10  # of one trajectory in one go

Progress = Callable[[float], None]  # told the nondimensional time times trajectories done


class _LeftFiniteError(UnboundedResponseError):
    """A trajectory left the finite numbers: by growth, or by a step too long for its stiffness."""


class Ensemble:
    """A set of trajectories in blocks of `LANES`, with their own random generators.

    Parameters
    ----------
    eqs
        nondimensional equations.
    trajectories
        rounded up to whole blocks; the result depends neither on threads nor on their number.
    seed
        the same seed, the same trajectories.
    h
        nondimensional step; None: `STEP` over the typical frequency, found while settling.
    start
        x, x' and V at the beginning, shape (3,) or (3, trajectories) with whole blocks; None: at rest, in each of
        `resting_places` in turn.  Where nothing random shakes it, off it by 1 or half-way to the opposite stop; under a
        drive spread over that distance, so that several responses to it are found.
    circuit
        the load, in place of the resistive one of the equations; its capacitor is empty at first.
    ruled
        the load resistor by ngspice's integration rule (`harvester.mechanics.kernels.ngspice_rule`), for a stop at rest
        or none.

    Raises
    ------
    InputError
        for a start behind a stop, a step out of range, and a circuit on a device without external noise or with mu.
    """

    def __init__(
        self,
        eqs: Equations,
        trajectories: int,
        seed: np.random.SeedSequence,
        h: float | None = None,
        start: Floats | None = None,
        circuit: IdealCircuit | None = None,
        ruled: bool = False,
    ) -> None:
        check_bounded(eqs)
        if circuit is not None and (eqs.n1 is None or eqs.mu is not None):
            raise invalid("n1 and mu beside a load circuit", "be a noise and None", f"{eqs.n1} and {eqs.mu}")
        if h is not None and not 1e-6 <= h <= 1e3:
            raise invalid("`dt`", "be between 1e-6 and 1e3 times 1/w0", f"{h:.3g}/w0")
        self.blocks = -(-trajectories // LANES)
        self.trajectories = self.blocks * LANES
        places = np.array(resting_places(eqs))
        if start is None:
            off = np.resize(np.minimum(1.0, 0.5 * (room(eqs)[1] - places)), self.trajectories)
            if is_shaken(eqs):
                off *= 0.0 if is_random(eqs) else np.linspace(0.0, 1.0, self.trajectories)
            start = np.zeros((3, self.trajectories))
            start[0] = np.resize(places, self.trajectories) + off
        check_start(eqs, start[0].min(), start[0].max())
        self.eqs, self.seed, self.given_h, self.start = eqs, seed, h, start
        self.circuit, self.ruled = circuit, ruled
        self._coarse: bool | None = None
        self.steps, self.patience = 0, PATIENCE
        self._start(STEP / typical_frequency(eqs, float(np.max(places**2))) if h is None else h)

    def _start(self, h: float) -> None:
        self.h, self.time = whole_steps(self.eqs, h), 0.0
        h = self.h
        start = np.moveaxis(self.start.reshape(3, -1, LANES if self.start.ndim > 1 else 1), 1, 0)
        self.state = aligned((self.blocks, 3 if self.circuit is None else 5, LANES))
        self.state[:, :3] = start
        if self.circuit is not None:
            self.state[:, 4] = start[:, 0]
        self.words = aligned((self.blocks, 2, LANES), np.uint64)
        for k, words in enumerate(self.words):
            words[:] = random_words(child(self.seed, 0, k), LANES)
        # Two steps to a draw, and a reading every .4 time units or so: V^2 varies on the scale of 1.
        self.stride = 2 * max(1, round(0.2 / h))
        self.filter = aligned((self.blocks, 2, LANES))
        if (repeat := period(self.eqs)) is not None:  # whole readings, at least 16, to a period
            self.stride = math.gcd(round(repeat / h) // 16, 2 ** int(math.log2(self.stride)))
        self.samples: list[Floats | None] = [None] * self.blocks
        if has_shaker(self.eqs):
            grid = 0.5 * h if self._coarse else h
            for k, states in enumerate(self.filter):
                rng = np.random.default_rng(child(self.seed, 2, k))
                drawn = k == 0 or self.eqs.density is not None
                self.samples[k] = samples_of(self.eqs, grid, rng) if drawn else self.samples[0]
                states[:] = shaker_start(self.eqs, grid, LANES, rng, self.samples[k])

    @property
    def reading(self) -> float:
        """Time between two readings."""
        return self.stride * self.h

    def run(self, duration: float, progress: Progress | None = None) -> Moments:
        """Advance all trajectories by ``duration`` (rounded to whole readings, and periods of a drive) and average.

        Raises
        ------
        UnboundedResponseError
            when a trajectory leaves the finite numbers.
        SimulationError
            for a drive so slow that a period takes more than `MOST_OF_A_PERIOD`.
        """
        if duration > MOST_STEPS * self.h:
            raise invalid("`duration`", f"be at most {MOST_STEPS:.0e} steps", f"{duration / self.h:.3g} steps")
        whole = round((period(self.eqs) or self.reading) / self.reading)  # readings to a period
        if whole * self.stride > MOST_OF_A_PERIOD:
            raise SimulationError(
                f"a period of the drive would take {whole * self.stride:.1e} steps of {self.h:.2g}/w0: it is too slow "
                "for the response, which follows it as at rest; give a longer `dt`"
            )
        readings = whole * max(1, round(duration / (whole * self.reading)))
        sums = aligned((self.blocks, len(SUMS if self.circuit is None else IDEAL_SUMS), LANES))
        grid = (readings, self.stride, self._coarse, self.h)

        def block(k: int) -> None:
            state = (*self.state[k], *self.words[k], sums[k])
            known = coefficients(self.eqs)
            if self.circuit is not None:  # without mu, and what the ideal circuits do not serve
                advance_ideal(*state, *grid, *self.circuit.arguments, *known[1:10])  # type: ignore[call-arg]
            elif self.ruled:
                advance_ruled(*state, *grid[:3], self.time > 0.0, self.h, *known[:10])  # type: ignore[call-arg]
            else:
                advance(*state, *grid, *known, self._shaker(k))  # type: ignore[call-arg]
            if progress is not None:
                progress(readings * self.reading * LANES)

        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(block, range(self.blocks)))
        elapsed = readings * self.reading
        self.time += elapsed
        self.steps += readings * self.stride * self.trajectories
        if not (np.isfinite(sums).all() and np.isfinite(self.state).all()):
            raise _LeftFiniteError(
                f"the response grows without bound: it left the finite numbers after {self.time:g} time units "
                f"at step {self.h:g}; {remedy(self.eqs, self.h)}"
            )
        return from_sums(sums, readings, elapsed, loss_unit(self.eqs), self.eqs.mu)

    def snapshot(self) -> Floats:
        """Displacement, velocity and voltage of all trajectories now, in mid-drift: shape (3, trajectories)."""
        eqs = self.eqs
        out = np.empty((3, self.trajectories))
        if self.ruled and self.time > 0.0:
            return np.moveaxis(self.state, 0, 1).reshape(3, -1).copy()
        if self.circuit is not None:
            mid_drift_ideal(self.state, out, self.h, eqs.restitution, *self.circuit.arguments)
            return out
        for k, state in enumerate(self.state):
            lanes = out[:, k * LANES : (k + 1) * LANES]
            mid_drift(state, lanes, self.h, eqs.mu, eqs.restitution, eqs.beta, eqs.n1, stops_of(eqs), self._shaker(k))
        return out

    def densities(self, snapshots: int, spacing: float, **edges: Floats) -> dict[str, Density]:
        """Densities of x, v and V (the keywords: edges of bins of equal width, nondimensional).

        Counts ``snapshots`` readings ``spacing`` apart; each block of `LANES` trajectories is one independent
        entry, so that standard errors need no correlation time.
        """
        counted = {name: Histogram(values, self.blocks) for name, values in edges.items()}
        for _ in range(snapshots):
            self.run(spacing)
            for name, values in zip("xvV", self.snapshot(), strict=True):
                if name in counted:
                    counted[name].add(values)
        return {name: one.density() for name, one in counted.items()}

    def settle(self) -> list[str]:
        """Run until the start is forgotten; returns warnings.

        When it is forgotten: `harvester.mechanics.ensemble.burn_in`.  A step that the response outgrows
        is made smaller, unless it was given.

        Raises
        ------
        UnboundedResponseError
            when the energy keeps growing.
        SimulationError
            when it is bounded, but does not become stationary in a sensible time.
        """
        while True:
            try:
                moments, warnings = until_steady(self)
            except _LeftFiniteError:
                if self.given_h is not None or self.h < 1e-3 * STEP:
                    raise
                self._start(self.h / 8)
                continue
            frequency = typical_frequency(self.eqs, moments.mean("x2")[0], moments.mean("v2")[0])
            if self.given_h is not None or self.h * frequency < 1.5 * STEP:
                frequency = max(frequency, chatter(self.eqs, moments.mean("v2")[0]))
                if self.h * frequency > 5 * STEP:
                    warnings.append(f"step {self.h:g} is coarse for a response of frequency {frequency:.3g}")
                return warnings
            self._start(STEP / frequency)

    def with_step(self, h: float) -> "Ensemble":
        """A fresh ensemble of the same scene and size with another step and other noise."""
        other = Ensemble(self.eqs, self.trajectories, child(self.seed, 1), h, self.start, self.circuit, self.ruled)
        other.patience = self.patience
        return other

    def patient(self, seconds: float | None) -> "Ensemble":
        """Itself, with steps for a burn-in of about so many seconds, at least one; None: `PATIENCE`."""
        self.patience = PATIENCE if seconds is None else STEPS_A_SECOND * max(seconds, 1.0)
        return self

    def _shaker(self, k: int) -> tuple[Any, ...] | None:
        """What shakes block k beside white noise, as the kernels take it."""
        whole = shaker(self.eqs, self.h, self._coarse, self.samples[k])
        return None if whole is None else (*self.filter[k], *self.words[k], *whole)

    def continued(self, eqs: Equations, h: float) -> "Ensemble":
        """An ensemble that goes on from the present states at a drive of another frequency, with a step up to h."""
        other = Ensemble(eqs, self.trajectories, child(self.seed, 3), h, self.start)
        other.state[:], other.filter[:], other.words[:] = self.state, self.filter, self.words
        return other

    def coarser(self) -> "Ensemble":
        """A fresh ensemble of the same scene and size with twice the step, on the same noise."""
        other = Ensemble(self.eqs, self.trajectories, self.seed, 2.0 * self.h, self.start, self.circuit, self.ruled)
        other._coarse = True
        other._start(other.h)
        other.stride = self.stride // 2
        return other
