"""When runs from empty reach a ladder of voltages, and their curves: the data from every engine to the study."""

import math
from dataclasses import dataclass, replace

import numpy as np

from harvester.arrays import Floats
from harvester.engines.protocol import Progress
from harvester.equations.problem import Problem
from harvester.netlists.probes import Probe
from harvester.presentation.diagnostic import Diagnostic
from harvester.studies.charging.afterwards import Afterwards
from harvester.uncertainty.paired_difference import difference95
from harvester.uncertainty.value import Value, mean_and_error, student95

LEVELS = 20  # up to the target
SAMPLES = 201  # times of the curve, from the beginning
LOW, HIGH = 0.05, 0.95  # fractions of the runs


@dataclass(frozen=True)
class ChargeRuns:
    """The request: ``count`` charges of a problem from rest and empty, and through which ``levels`` (V).

    ``duration`` (s) is how long they are watched at most, and ``h`` their step (1/w0); None: that
    of the scene. ``probe`` is the watched quantity; None: the storage capacitor.  Each begins at
    the beginning of the excitation, or ``anywhere``; with ``whole`` it continues to the end, else
    until all have reached the last level.  With a ``budget`` (s, without compilation) there are as
    many runs, and as long ones, as fit into it.
    """

    problem: Problem
    levels: Floats
    duration: float
    count: int
    seed: int
    h: float | None = None
    probe: Probe | None = None
    anywhere: bool = False
    whole: bool = False
    progress: Progress | None = None
    budget: float = math.inf

    def tell(self, fraction: float) -> None:
        """Tell the progress, if there is one, the fraction done."""
        if self.progress is not None:
            self.progress(fraction)


@dataclass(frozen=True)
class Passages:
    """Runs of one engine from rest and empty, in its own units (s and V of the device).

    ``levels``, shape (levels,), ends with the target; ``times``, shape (runs, levels), are when a
    run first reaches each, infinite if it never does; ``coarse`` are the same runs at a coarser
    step.  ``curves``, shape (runs, samples), are voltages at the times ``at``; ``end`` is how long
    each run was watched; ``capacitance`` (F) that of the storage capacitor, 0 if it is not known;
    ``seconds`` of all, without compilation.  ``after`` is the course after the first passage of
    each run, and at the coarser step; None if that was not looked at.
    """

    levels: Floats
    times: Floats
    coarse: Floats
    at: Floats
    curves: Floats
    end: float
    capacitance: float
    steps: int
    seconds: float
    unknown: str = ""
    counted: float = 1.0  # times the change at the coarser step that its error is
    after: tuple[list[Afterwards], list[Afterwards]] | None = None
    notes: tuple[Diagnostic, ...] = ()  # of how it was computed
    model: Floats | None = None  # errors of the mean times that no run shows, at 95 %, one a level
    # consecutive runs on one record of a density, which are no more than one independent sample
    together: int = 1

    @property
    def reached(self) -> float:
        """The fraction of the runs that reach the target."""
        return float(np.isfinite(self.times[:, -1]).mean())

    def reached_between(self) -> tuple[float, float]:
        """The 95 % interval of the fraction that reaches the target.

        For a deterministic run, itself.

        Runs on one record are alike: all are worth as many independent ones as the spread of the
        records' shares, less for the uncertainty of that spread (Korn and Graubard, Survey
        Methodology 24, 193, 1998), and the records if all of them have the same share.
        """
        runs = len(self.times)
        share = self.reached
        if runs == 1:
            return share, share
        if self.together == 1:
            return share_interval(round(share * runs), runs)
        shares = self.independent(np.isfinite(self.times[:, -1]).astype(float))
        records = len(shares)
        spread = mean_and_error(shares)[1]
        if spread == 0.0:
            return share_interval(share * records, records)
        few = student95(runs - 1.0) / student95(records - 1.0)
        worth = min(few**2 * share * (1.0 - share) / spread**2, runs)
        return share_interval(share * worth, worth)

    def arrived(self) -> Floats:
        """The fraction of the runs that have reached the target at the times ``at``, shape (samples,)."""
        order = np.sort(self.times[:, -1])
        return np.asarray(np.searchsorted(order, self.at, side="right") / len(order))

    def mean(self, values: Floats, coarse: Floats) -> Value:
        """The mean of one finite number a run, with its sampling error and the change at the coarser step.

        The change, ``counted`` times, and the unknown part of it, is the time-step error.
        """
        if len(values) == 1:
            change = self.counted * abs(float(coarse[0] - values[0]))
            return Value(float(values[0]), None, change, unknown=self.unknown)
        values, coarse = self.independent(values), self.independent(coarse)
        value, error = mean_and_error(values)
        bias = self.counted * difference95(coarse, values).largest95
        return Value(value, error, bias, dof=float(len(values) - 1), unknown=self.unknown)

    def independent(self, values: Floats) -> Floats:
        """Means of the values of runs, shape (runs, ...), on one record each: independent entries."""
        return np.asarray(values.reshape(-1, self.together, *values.shape[1:]).mean(axis=1))

    def time_to(self, level: int) -> Value | None:
        """The mean time to a level; None if a run does not reach it, so that its time is not known.

        If it is only the coarser run that does not, the time-step error is not known.
        """
        times, coarse = self.times[:, level], self.coarse[:, level]
        if not np.isfinite(times).all():
            return None
        if np.isfinite(coarse).all():
            model = None if self.model is None else float(self.model[level])
            return replace(self.mean(times, coarse), model=model)
        times = self.independent(times)
        value, error = mean_and_error(times)
        parts = " and ".join(filter(None, ("the step", self.unknown)))
        return Value(value, None if len(times) == 1 else error, dof=len(times) - 1.0, unknown=parts)

    def at_least(self) -> Value:
        """The mean of the times to the target, if one that is not known counts as the time watched.

        If no run gets there, that is the time watched, without an error.
        """
        if not (np.isfinite(self.times[:, -1]).any() or np.isfinite(self.coarse[:, -1]).any()):
            return Value(self.end)
        return self.mean(
            np.minimum(self.times[:, -1], self.end), np.minimum(self.coarse[:, -1], self.end)
        )

    def share_afterwards(self) -> Value | None:
        """The mean fraction of the time for which a run is at or above the target, once it has been there.

        For a single run the spread over its cycles counts as a time-step error; for several the
        spread between them is that of sampling, which has it already.  None if it was not looked
        at, or a run never gets there.
        """
        if self.after is None:
            return None
        fine, coarse = (
            np.array([after.share for after in runs_after]) for runs_after in self.after
        )
        if not (np.isfinite(fine).all() and np.isfinite(coarse).all()):
            return None
        share = self.mean(fine, coarse)
        if len(fine) > 1:
            return share
        return replace(share, bias=(share.bias or 0.0) + self.after[0][0].error)

    def rises(self) -> float | None:
        """How often a run rises through the target, on average; None if that was not looked at."""
        return (
            None if self.after is None else float(np.mean([after.rises for after in self.after[0]]))
        )

    def quantile(self, share: float, level: int = -1) -> float | None:
        """The time by which that fraction of the runs has reached a level.

        None if it is after the end.
        """
        ordered = np.sort(self.times[:, level])
        position = share * (len(ordered) - 1)
        low, high = float(ordered[math.floor(position)]), float(ordered[math.ceil(position)])
        if not math.isfinite(high):
            return None
        return low + (position - math.floor(position)) * (high - low)

    def power_between(self, level: int, joules: float) -> Value | None:
        """The mean power (W) that raises the storage capacitor by ``joules`` to a level from the one below it.

        The energy over the mean time for this, with its relative errors; None if a run does
        not get there.
        """

        def durations(times: Floats) -> Floats:
            return times[:, level] - (times[:, level - 1] if level else 0.0)

        if not (
            np.isfinite(self.times[:, level]).all() and np.isfinite(self.coarse[:, level]).all()
        ):
            return None
        took = self.mean(durations(self.times), durations(self.coarse))
        return None if took.value <= 0.0 else took.scaled(joules / took.value**2)


def share_interval(reached: float, runs: float) -> tuple[float, float]:
    """The 95 % interval of a share, from how many of so many independent runs (Clopper and Pearson 1934).

    Both may be fractions: as many as the runs are worth.
    """
    from scipy.special import betaincinv

    low = 0.0 if reached <= 0.0 else float(betaincinv(reached, runs - reached + 1.0, 0.025))
    high = 1.0 if reached >= runs else float(betaincinv(reached + 1.0, runs - reached, 0.975))
    return low, high
