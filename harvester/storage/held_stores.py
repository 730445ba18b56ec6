"""Stores that a rectifier charges from a held voltage while the mass moves: `HeldStores.advance`.

Each kind of mechanics has a class: one trajectory under a harmonic excitation or white noise, many
trajectories under noise, or a batch of them on parts of a record.
"""

import math
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats, aligned
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.equations.scales import Scales
from harvester.mechanics.ensemble.loads import loaded
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.forcing import forcing
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.shaking import filter_of, of_batch
from harvester.mechanics.kernels.step_size import whole_steps
from harvester.mechanics.kernels.trajectory_batch import IDEAL_SUMS, MASS_ROWS, Schedule
from harvester.mechanics.trace import at_rest
from harvester.storage.rectifier_cut import STORE
from harvester.storage.time_limit import check_time
from harvester.uncertainty.paired_difference import enough_entries

HELD = 1e7  # of a storage capacitor that is held, over the piezo's capacitance
STRIDE = 4  # steps between samples of V^2
STORE_ROW = 3  # of the storage voltage in a batch of trajectories with ideal elements
Elements = IdealCircuit | CompiledCircuit  # of a rectifier


def enough_runs(eqs: Equations, count: int) -> int:
    """So many runs, and at least those of some records if runs share records of tabulated noise."""
    return enough_entries(count, 1 if eqs.density is None else BATCH)


class Gained(NamedTuple):
    """Gained ``charges`` (C) and the piezo's mean ``squares`` (V^2), shape (n,)."""

    charges: Floats
    squares: Floats
    seconds: float

    @property
    def current(self) -> float:
        """The mean current (A) into the first store."""
        return float(self.charges[0] / self.seconds)


class HeldStores:
    """Stores of so many ``farads`` behind a rectifier's elements; the mass moves on in `advance`.

    ``together`` consecutive storage capacitors are on one record.
    """

    together = 1

    def __init__(self, circuit: Elements, farads: float, scales: Scales) -> None:
        self.circuit = circuit
        self.farads = farads
        self.scales = scales
        self.unit = 1.0  # C, of what a state has of the storage capacitor
        self._row = STORE_ROW
        if isinstance(circuit, CompiledCircuit):
            self._row = MASS_ROWS + circuit.charge_at(STORE)
        else:
            self.unit = farads * scales.volts

    @property
    def stored(self) -> Floats:
        """The charges in the ``unit``, as a view of the states, which change with it."""
        raise NotImplementedError

    @property
    def volts(self) -> Floats:
        """The voltages of the storage capacitors, shape (n,)."""
        return self.stored.ravel() * (self.unit / self.farads)

    def advance(self, volts: Floats | float | None, duration: float) -> Gained:
        """Move on for a nondimensional ``duration`` from ``volts``; None: from the present ones.

        A separate voltage for each storage capacitor has the shape of ``stored``.  Each class
        rounds the duration in its way.
        """
        if volts is not None:
            self.stored[...] = volts * self.farads / self.unit
        before = self.stored.copy()
        squares, duration = self._move_on(duration)
        check_time()
        charges = ((self.stored - before) * self.unit).ravel()
        return Gained(charges, squares, duration / self.scales.frequency)

    def _move_on(self, duration: float) -> tuple[Floats, float]:
        """Advance mass and rectifier: the piezo's mean squares (V^2), and how long that was."""
        raise NotImplementedError


class StoreOnPath(HeldStores):
    """The storage capacitor of one trajectory of a compiled ``circuit`` from rest, under a sinusoid or white noise.

    It moves on by multiples of ``part`` (nondimensional; None: a period of the excitation), rounded
    up, with white noise from ``rng``.  V^2 is sampled every `STRIDE` steps of a period, or at the
    end of each ``part``.  ``peak`` is the largest displacement so far, nondimensional; ``steps``
    are those of the circuit.
    """

    circuit: CompiledCircuit

    def __init__(
        self,
        problem: Problem,
        circuit: CompiledCircuit,
        farads: float,
        h: float,
        part: float | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(circuit, farads, problem.scales)
        self.eqs = problem.equations
        self.h = whole_steps(h, self.eqs.shaking_period)
        self.steps = 0
        self.peak = 0.0
        period = self.eqs.shaking_period
        assert part or period, "noise has no period, so that the caller gives a part"
        self._part: float = part or period or 0.0
        self._steps_a_part = round(self._part / self.h)
        self._stride = self._steps_a_part if part else math.gcd(self._steps_a_part, STRIDE)
        self._moved = 0  # steps of h
        self._rng = rng
        self._state = circuit.rest
        self._mass = at_rest(self.eqs)[:-1]

    @property
    def stored(self) -> Floats:
        """The one charge."""
        at = self._row - MASS_ROWS
        return self._state[at : at + 1]

    def _move_on(self, duration: float) -> tuple[Floats, float]:
        n_steps = self._steps_a_part * max(1, math.ceil(duration / self._part))
        path = self.circuit.trace(
            self.eqs,
            np.zeros(n_steps) if self._rng is None else self._rng.standard_normal(n_steps),
            h=self.h,
            stride=self._stride,
            start=self._mass,
            state=self._state,
            shaking=self._drive(n_steps),
            kicked=self._moved > 0,
        )
        self._moved += n_steps
        self._mass = path.last[:-1]
        self._state = path.state
        self.steps += path.steps
        self.peak = max(self.peak, float(np.abs(path.samples[:, 0]).max()))
        return np.mean(path.voltages[:, :1] ** 2, axis=0), n_steps * self.h

    def _drive(self, n_steps: int) -> Floats | None:
        """The accelerations of the excitation from now on; None without one."""
        period = self.eqs.shaking_period
        begin = 0 if period is None else self._moved % round(period / self.h)
        accelerations = forcing(self.eqs, self.h, begin + n_steps)
        return None if accelerations is None else accelerations[begin:]


class StoresOfMany(HeldStores):
    """A storage capacitor for each of many trajectories, ``runs``, which may have other storage capacitors in between.

    A duration is rounded as by `Trajectories.run`.
    """

    def __init__(
        self, runs: Trajectories, circuit: Elements, farads: float, scales: Scales
    ) -> None:
        super().__init__(circuit, farads, scales)
        self.runs = runs
        self.together = runs.together

    @property
    def stored(self) -> Floats:
        """The charges, shape (blocks, BATCH)."""
        return self.runs.state[:, self._row]

    def _move_on(self, duration: float) -> tuple[Floats, float]:
        begin = self.runs.time
        self.runs.put_behind(self.circuit)
        moments = self.runs.run(duration)
        return moments.V2 * self.scales.volts**2, self.runs.time - begin


class StoresOnRecord(HeldStores):
    """The storage capacitors of one batch of trajectories, each on a part of the same record, from rest.

    A duration is one of multiples of `STRIDE` steps of ``h``.
    """

    def __init__(self, problem: Problem, circuit: Elements, farads: float, h: float) -> None:
        super().__init__(circuit, farads, problem.scales)
        self.h = h
        self._eqs = problem.equations
        self._loaded = loaded(self._eqs, circuit)
        self._state: Floats = aligned((self._loaded.rows, BATCH))
        self._state[0] = self._eqs.resting_places[0]
        self._loaded.begin(self._state[None])
        self._sums: Floats = aligned((self._loaded.sums, BATCH))
        self._filter = aligned((2, BATCH))
        self._words = aligned((2, BATCH), np.uint64)

    @property
    def stored(self) -> Floats:
        """The charges, shape (BATCH,)."""
        return self._state[self._row, :]

    def begin(self, samples: Floats, positions: Floats) -> None:
        """Set the accelerations at all steps, and the place of each trajectory in them."""
        self._filter[:] = samples[positions.astype(int)], positions
        self._shaker = of_batch(filter_of(self._eqs, self.h), self._filter, self._words, samples)

    def _move_on(self, duration: float) -> tuple[Floats, float]:
        samples = round(duration / (STRIDE * self.h))
        self._sums[:] = 0.0
        self._loaded.advance(
            self._loaded.batch(self._state, self._words, self._sums, None),
            self._state,
            Schedule(samples, STRIDE, 0, False),
            self.h,
            self._shaker,
            False,
        )
        self._loaded.check(self._sums[len(IDEAL_SUMS) :].sum(axis=1), self._state[None])
        squares = self._sums[1] / samples * self.scales.volts**2
        return squares, samples * STRIDE * self.h
