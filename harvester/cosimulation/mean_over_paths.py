"""A user's model until its mean power has an asked error, which step, tolerance and sampling make.

The step is halved, with a quarter of ngspice's tolerance, on the same noise; the change of
the mean power is its error, of an order of 1 or more.  Trajectories with further noise give its
sampling error.  The step is made smaller if the change is seen despite the sampling; else there are
more trajectories.
"""

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from harvester.cosimulation.model_runs import ModelJob, ModelRun, packed, run_model
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.machine.progress import ProgressCallback
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value, mean_and_error

FIRST, MOST_PATHS = 4, 256
MOST_HALVINGS = 8
MOST_REFINED = 8_000_000  # steps of a path
FINEST = 1e-9  # of ngspice's tolerance
QUARTER = 0.25  # of the tolerance with half the step


@dataclass
class MeanOverPaths:
    """Trajectories of a job with further seeds, and with the step of ``halvings`` more."""

    job: ModelJob
    halvings: int = 1
    first: ModelRun | None = None  # of the job's own seed, at the finest step so far
    report: ProgressCallback | None = None  # of the fraction of the trajectories that is done
    _needed: int = 0  # how many trajectories are known to be needed
    _powers: dict[tuple[int, int], float] = field(default_factory=dict)  # by seed and halvings

    def to(self, within: float) -> tuple[Value, bool]:
        """The mean power (W) with its error, and whether that is ``within``, a part of it."""
        count = FIRST
        while True:
            levels = (self.halvings, self.halvings - 1)
            missing = sum(len(self._missing(count, level)) for level in levels)
            self._needed = len(self._powers) + missing
            fine, coarse = (self._of(count, level) for level in levels)
            if np.ptp(fine) == 0.0 and np.ptp(coarse) == 0.0:  # of a model without noise
                fine, coarse = fine[:1], coarse[:1]
            change = difference95(fine, coarse)
            bias = abs(change.value) + change.sampling95
            mean, stderr = mean_and_error(fine)
            has_noise = len(fine) > 1
            power = Value(
                mean,
                stderr if has_noise else None,
                bias,
                dof=len(fine) - 1.0 if has_noise else None,
            )
            if power.known_error95 <= within * abs(mean):
                return power, True
            # Trajectories of both steps part at impacts: a change that sampling may explain needs
            # more of them.
            if abs(change.value) > max(change.sampling95, power.sampling95) or not has_noise:
                if self.halvings == MOST_HALVINGS or self._is_longest:
                    return power, False
                self.halvings += 1
            elif 2 * count > MOST_PATHS:
                return power, False
            else:
                count *= 2

    @property
    def _is_longest(self) -> bool:
        """Whether a trajectory with half the step would have too many steps for the memory of several workers."""
        return self.job.steps << (self.halvings + 1) > MOST_REFINED

    def finest(self) -> ModelJob:
        """The job at the finest step so far."""
        return self._at(0, self.halvings)

    def _missing(self, count: int, halvings: int) -> list[int]:
        """Those of so many trajectories that have not been run at one step."""
        return [k for k in range(count) if (k, halvings) not in self._powers]

    def _of(self, count: int, halvings: int) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
        """The mean powers of so many trajectories at one step."""
        todo = self._missing(count, halvings)
        jobs = [(packed(self._at(k, halvings)),) for k in todo]
        for k, run in zip(todo, map_in_workers(run_model, jobs), strict=True):
            self._powers[k, halvings] = run.ledger.load
            if k == 0 and halvings == self.halvings:
                self.first = run
            if self.report is not None:
                self.report(len(self._powers) / self._needed)
        return np.array([self._powers[k, halvings] for k in range(count)])

    def _at(self, path: int, halvings: int) -> ModelJob:
        """The job of a trajectory at a step."""
        parts = 2**halvings
        tolerance, volts = self.job.tolerances
        return dataclasses.replace(
            self.job,
            h=self.job.h / parts,
            steps=self.job.steps * parts,
            stride=self.job.stride * parts,
            halvings=halvings,
            path=path,
            tolerances=(max(tolerance * QUARTER**halvings, FINEST), volts),
        )
