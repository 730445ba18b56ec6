"""Many trajectories -> stationary means with their errors.

`Ensemble.settle` runs until the start is forgotten, as the data show; `Ensemble.measure` adds
up moments afterwards.  Every trajectory gives one independent time average, so standard errors
need no correlation time.
"""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from harvester.arrays import Floats
from harvester.errors import UnboundedResponseError, invalid
from harvester.mechanics.lanes import LANES, SUMS, advance
from harvester.mechanics.moments import Moments, from_sums
from harvester.mechanics.noise import child, random_words
from harvester.mechanics.path import coefficients
from harvester.mechanics.step import drift, relaxation
from harvester.scaling import Equations

STEP = 0.1  # default step, in units of 1/(frequency of the settled response)
FIRST_WINDOW = 32.0  # time units: about five periods
MOST_STEPS = 1e10  # of one trajectory in one go
LONGEST = 2e5  # time units: the burn-in ends here whatever the data say
_GROWN = 1e12  # times the first energy: a growth that no bounded response shows

Progress = Callable[[float], None]  # told the nondimensional time times trajectories done


def typical_frequency(eqs: Equations, x2: float) -> float:
    """Frequency that the step must resolve: w^2 = 1 + beta + 3 alpha E[x^2] (nondimensional)."""
    return math.sqrt(1.0 + (eqs.beta or 0.0) + 3.0 * (eqs.alpha or 0.0) * x2)


def check_bounded(eqs: Equations) -> None:
    """Refuse a friction that feeds energy at every large amplitude.

    Raises
    ------
    UnboundedResponseError
        where the highest term of f(x) = c3 x^4 - c2 x^2 - c1 beyond c1 is negative.
    """
    top = next(((name, c) for name, c in (("c3", eqs.c3), ("c2", -(eqs.c2 or 0.0))) if c), None)
    if top is not None and top[1] < 0.0:
        key = {"c3": "damping_x4 (c3)", "c2": "damping_x2 (-c2)"}[top[0]]
        raise UnboundedResponseError(
            f"the response grows without bound: {key} feeds energy at large amplitude and nothing bounds it; "
            "give a positive damping of a higher power"
        )


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
    """

    def __init__(self, eqs: Equations, trajectories: int, seed: np.random.SeedSequence, h: float | None = None):
        check_bounded(eqs)
        if h is not None and not 1e-6 <= h <= 1e3:
            raise invalid("--dt", "be between 1e-6 and 1e3 times 1/w0", f"{h:.3g}/w0")
        self.eqs, self.seed, self.given_h = eqs, seed, h
        self.blocks = -(-trajectories // LANES)
        self.trajectories = self.blocks * LANES
        self.steps = 0
        self._start(STEP / typical_frequency(eqs, 0.0) if h is None else h)

    def _start(self, h: float) -> None:
        eqs = self.eqs
        self.h, self.time = h, 0.0
        # At rest; without external noise rest is where it would stay, so the mass starts displaced.
        x0 = 0.0 if eqs.n1 is not None else 1.0
        self.state = np.zeros((self.blocks, 3, LANES))
        self.state[:, 0] = x0
        self.words = np.stack([random_words(child(self.seed, 0, k), LANES) for k in range(self.blocks)])
        # Two steps to a draw, and a reading every .4 time units or so: V^2 varies on the scale of 1.
        self.pairs = max(1, round(0.2 / h))

    def run(self, duration: float, progress: Progress | None = None) -> Moments:
        """Advance all trajectories by ``duration`` (rounded to whole readings) and average.

        Raises
        ------
        UnboundedResponseError
            when a trajectory leaves the finite numbers.
        """
        stride = 2 * self.pairs
        if duration > MOST_STEPS * self.h:
            raise invalid("--duration", f"be at most {MOST_STEPS:.0e} steps", f"{duration / self.h:.3g} steps")
        readings = max(1, round(duration / (stride * self.h)))
        sums = np.zeros((self.blocks, len(SUMS), LANES))
        arguments = (self.pairs, self.h, *coefficients(self.eqs))

        def block(k: int) -> None:
            advance(*self.state[k], *self.words[k], sums[k], readings, *arguments)  # type: ignore[call-arg]
            if progress is not None:
                progress(readings * stride * self.h * LANES)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(block, range(self.blocks)))
        elapsed = readings * stride * self.h
        self.time += elapsed
        self.steps += readings * stride * self.trajectories
        if not (np.isfinite(sums).all() and np.isfinite(self.state).all()):
            raise _LeftFiniteError(
                f"the response grows without bound: it left the finite numbers after {self.time:g} time units "
                f"at step {self.h:g}; add damping, or try a smaller --dt if the scene is known to be bounded"
            )
        return from_sums(sums, readings, elapsed)

    def snapshot(self) -> Floats:
        """Displacement, velocity and voltage of all trajectories now, in mid-drift: shape (3, trajectories)."""
        half = 0.5 * self.h
        e, g = relaxation(half, self.eqs.mu)
        states = np.moveaxis(self.state, 1, 2).reshape(-1, 3)
        return np.array([drift(*s, half, e, g, self.eqs.mu, self.eqs.restitution)[:3] for s in states]).T  # type: ignore[call-arg]

    def settle(self) -> list[str]:
        """Run until the start is forgotten; returns warnings.

        Windows of doubled length follow each other until the means of the energy and of V^2 in
        two neighbours agree within two standard errors, and 5/mu has gone by.  A step that the
        response outgrows is made smaller, unless it was given.

        Raises
        ------
        UnboundedResponseError
            when the energy keeps growing.
        """
        while True:
            try:
                moments, warnings = self._windows()
            except _LeftFiniteError:
                if self.given_h is not None or self.h < 1e-3 * STEP:
                    raise
                self._start(self.h / 8)
                continue
            frequency = typical_frequency(self.eqs, moments.mean("x2")[0])
            if self.given_h is not None or self.h * frequency < 1.5 * STEP:
                if self.h * frequency > 5 * STEP:
                    warnings.append(f"step {self.h:g} is coarse for a response of frequency {frequency:.3g}")
                return warnings
            self._start(STEP / frequency)

    def with_step(self, h: float) -> "Ensemble":
        """A fresh ensemble of the same scene and size with another step and other noise."""
        return Ensemble(self.eqs, self.trajectories, child(self.seed, 1), h)

    def _windows(self) -> tuple[Moments, list[str]]:
        mu = self.eqs.mu
        memory = 0.0 if mu is None else 5.0 / mu
        length, before, first = FIRST_WINDOW, None, None
        while True:
            now = self.run(length)
            energy = now.mean("x2")[0] + now.mean("v2")[0]
            first = energy if first is None else first
            if energy > _GROWN * max(first, 1e-300):
                raise UnboundedResponseError(
                    f"the response grows without bound: its energy grew {energy / first:.1e} times in "
                    f"{self.time:g} time units; add damping that bounds it"
                )
            steady = before is not None and all(_agree(before, now, name) for name in ("x2", "v2"))
            if steady and before is not None and _agree(before, now, "V2") and self.time >= memory:
                return now, []
            if energy <= first / _GROWN:
                return now, ["the response dies out: the scene has no noise that keeps it going"]
            if self.time >= LONGEST:
                if not steady:
                    raise UnboundedResponseError(
                        f"the response grows without bound: its energy still changes after {self.time:g} time units; "
                        "add damping or a stop with restitution below 1"
                    )
                slow = f" of the load's memory, 1/mu = {1 / mu:g}," if mu is not None and memory > LONGEST else ""
                return now, [
                    f"burn-in stopped at {self.time:g} time units because{slow} no stationary voltage was seen"
                ]
            length, before = 2.0 * length, now


def _agree(a: Moments, b: Moments, name: str) -> bool:
    (ma, sa), (mb, sb) = a.mean(name), b.mean(name)
    return abs(ma - mb) <= max(2.0 * math.hypot(sa, sb), 1e-3 * abs(mb))


class StepPair:
    """A settled ensemble and one with twice its step: averages, and the bias of the step from both.

    The scheme is of second order, so E_h - E_0 = (E_2h - E_h)/3 + O(h^4) (Richardson).
    """

    def __init__(self, many: Ensemble, duration: float) -> None:
        self.many, self.duration, self.burn_in = many, duration, max(many.time, FIRST_WINDOW)
        if many.time == 0.0:
            many.settle()
        self._coarse = many.with_step(2.0 * many.h)
        self.fine = many.run(duration)
        self.coarse: Moments | None = None
        try:
            self._coarse.run(self.burn_in)
            self.coarse = self._coarse.run(duration)
        except UnboundedResponseError:  # twice the step is unstable: no estimate from it
            pass

    def extend(self) -> None:
        """Go on for as long as it has run so far."""
        self.fine = self.fine.mixed(self.many.run(self.duration))
        if self.coarse is not None:
            self.coarse = self.coarse.mixed(self._coarse.run(self.duration))
        self.duration *= 2.0

    @property
    def steps(self) -> int:
        """Trajectory-steps of both."""
        return self.many.steps + self._coarse.steps

    @property
    def bias(self) -> float:
        """Estimated size of the bias of E[V^2] at the step of ``many``."""
        fine = self.fine.mean("V2")[0]
        return abs(fine) if self.coarse is None else abs(self.coarse.mean("V2")[0] - fine) / 3.0

    @property
    def bias_error(self) -> float:
        """Standard error of `bias`."""
        if self.coarse is None:
            return 0.0
        return math.hypot(self.fine.mean("V2")[1], self.coarse.mean("V2")[1]) / 3.0
