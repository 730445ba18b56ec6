"""The responses to a steady excitation that trajectories from many starts come to: which are one, and the kind of each.

Each trajectory has a phase of the excitation of its own, so that the compared quantities are means
over whole periods. A response that comes back after some periods of the excitation is periodic; for
one that does not, neighbouring motions part exponentially if it is chaotic (a positive Lyapunov
exponent), and stay together if it is quasi-periodic.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fclusterdata

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.burn_in import burn_in, until_steady
from harvester.mechanics.ensemble.own_circuit import OwnCircuit
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.mechanics.kernels.moments import Moments
from harvester.mechanics.kernels.noise import child
from harvester.mechanics.periodic import MULTIPLES

Indices = NDArray[np.intp]

NEAR = 0.02  # of the motion's size: a return
LARGEST_GAP = 0.02  # of a mean: a gap between means that are of several responses
ASIDE, PARTED = 1e-7, 1e-3  # of the motion's size: a small change, and one that has grown by chaos
FOLLOWED = 64  # periods in which it may
# times at most that the time doubles until nearly all trajectories are where they come to
LONGER = 5
FEWEST = 0.02  # of the trajectories: fewer are still on their way
# the second: times the motion's root mean square from rest, or the place farthest from x = 0
STARTS = 256
WIDE = 2.0
SAME = 0.2  # of a mean: what a step twice as long may change in a response


@dataclass(frozen=True)
class Attractor:
    """A response that ``members`` (indices of trajectories) come to, and that ``turns`` periods bring back; 0: none.

    ``moments`` are those of all trajectories over some periods.
    """

    members: Indices
    turns: int
    chaotic: bool
    moments: Moments

    def entries(self, name: str) -> Floats:
        """One moment of each member."""
        return np.asarray(getattr(self.moments, name)[self.members])

    def like(self, other: "Attractor") -> bool:
        """Whether it is the same response at another step: one of the same kind and place, and nearly the same size."""
        mine, its = (
            np.array([at.entries(name).mean() for name in ("V2", "x2", "x")])
            for at in (self, other)
        )
        return self.turns == other.turns and bool(_alike(mine[None], its, SAME)[0])


def from_many_starts(
    eqs: Equations, seed: np.random.SeedSequence, circuit: IdealCircuit | OwnCircuit | None
) -> Trajectories:
    """Settled trajectories from `STARTS` starts, all over the places and velocities that a response may have.

    Raises as `harvester.mechanics.ensemble.burn_in.burn_in`.
    """
    pilot = Trajectories(eqs, 1, seed, circuit=circuit)
    burn_in(pilot)
    moments = pilot.run(MULTIPLES * (eqs.shaking_period or 1.0))
    low, high = eqs.rigid_stops
    size = WIDE * max(*map(abs, eqs.resting_places), math.sqrt(float(moments.x2.max())))
    speed = max(
        size * math.sqrt(max(eqs.spring[0], 1.0)), WIDE * math.sqrt(float(moments.v2.max()))
    )
    draws = np.random.default_rng(child(seed, 4)).uniform(-1.0, 1.0, (2, STARTS))
    start = np.zeros((3, STARTS))
    start[0] = np.clip(size * draws[0], low, high)
    start[1] = speed * draws[1]
    trajectories = Trajectories(eqs, STARTS, seed, pilot.h, start, circuit)
    until_steady(trajectories)
    return trajectories


def attractors(trajectories: Trajectories) -> list[Attractor]:
    """The responses of trajectories under a steady excitation, the most frequent first.

    The trajectories continue until they have reached them.

    Raises UnboundedResponseError as `Trajectories.run`.
    """
    there = 0
    for _ in range(LONGER):
        present = _present(trajectories)
        before = there
        there = sum(
            len(attractor.members) for attractor in present if attractor.turns or attractor.chaotic
        )
        if (
            there > (1.0 - FEWEST) * trajectories.count or 0 < there <= before
        ):  # what is left comes to no more of them
            break
        trajectories.run(trajectories.time)  # many wander for long before they come to a response
    return present


def section(trajectories: Trajectories, k: int) -> tuple[Floats, float]:
    """The state of trajectory k after its last kick, shape (rows,), and the part of the excitation's period there."""
    eqs, h = trajectories.eqs, trajectories.h
    block, lane = divmod(k, BATCH)
    p, q = map(float, trajectories.filter[block, :2, lane])
    if eqs.drive is None:  # q is the place in the record
        phase = q * h / (eqs.shaking_period or h)
    else:
        phase = math.atan2(q / eqs.drive, p / eqs.drive) / (2.0 * math.pi)
    return trajectories.state[block, :, lane], phase % 1.0


def _present(trajectories: Trajectories) -> list[Attractor]:
    """The responses that trajectories are near at present."""
    period = trajectories.eqs.shaking_period
    assert period is not None, "the drive is steady"
    sections = []
    for _ in range(2 * MULTIPLES):
        trajectories.run(period)
        sections.append(trajectories.snapshot()[:2])
    moments = trajectories.run(MULTIPLES * period)
    spread = (
        np.sqrt(np.maximum(moments.x2 - moments.x**2, 1e-300)),
        np.sqrt(np.maximum(moments.v2, 1e-300)),
    )
    turns = _turns(np.array(sections) / np.array(spread))
    parted = _parts(trajectories, np.array(spread), period)
    turns[parted] = 0  # near an unstable response for a while
    responses = []
    of_all = moments
    for count in np.unique(turns):
        moments = of_all
        if (
            count and MULTIPLES % count
        ):  # a mean over a part of what comes back would differ with where it begins
            moments = trajectories.run(count * -(-MULTIPLES // count) * period)
        means = _means(moments, spread[0])
        those = np.flatnonzero(turns == count)
        which = np.ones(len(those)) if count == 0 or len(those) < 2 else linked(means[those])
        for number in np.unique(which):
            here = those[which == number]
            responses.append(Attractor(here, int(count), bool(parted[here].mean() > 0.5), moments))
    enough = [
        attractor
        for attractor in responses
        if len(attractor.members) >= FEWEST * trajectories.count
    ]
    return sorted(enough, key=lambda attractor: -len(attractor.members))


def _means(moments: Moments, spread: Floats) -> Floats:
    """The means of V^2, x^2 and x of each trajectory, shape (count, 3); a mean of x that is next to nothing is 0."""
    return np.array(
        [moments.V2, moments.x2, np.where(np.abs(moments.x) > NEAR * spread, moments.x, 0.0)]
    ).T


def _turns(sections: Floats) -> Indices:
    """After how many periods each trajectory comes back, 0 for never.

    ``sections``, shape (periods, 2, count).
    """
    turns_of_each = np.zeros(sections.shape[2], dtype=np.intp)
    for turns in range(MULTIPLES, 0, -1):
        away = np.abs(sections[turns:] - sections[:-turns]).max(axis=(0, 1))
        turns_of_each[away < NEAR] = turns
    return turns_of_each


def linked(means: Floats) -> Indices:
    """Numbers of the responses of trajectories, from their means, shape (n, 3), of V^2, x^2 and x.

    Means of one response scatter by the places of impacts in a step, more than `LARGEST_GAP` in
    all, without gaps.
    """
    square = np.maximum(means[:, :2], 1e-300)
    positions = np.column_stack([np.log(square), means[:, 2] / np.sqrt(square[:, 1])])
    return np.asarray(
        fclusterdata(
            positions, LARGEST_GAP, criterion="distance", metric="chebyshev", method="single"
        )
    )


def _alike(means: Floats, response: Floats, part: float) -> Floats:
    """Which rows of means, shape (n, 3), are those of one response: V^2 and x^2, and x relative to the root of x^2."""
    size = np.array([response[0], response[1], math.sqrt(response[1])])
    return np.asarray(np.all(np.abs(means - response) <= part * np.maximum(size, 1e-300), axis=1))


def _parts(trajectories: Trajectories, spread: Floats, period: float) -> Floats:
    """Whether a small change of each trajectory's place has grown to `PARTED` of its motion."""
    beside = trajectories.continued(trajectories.eqs, trajectories.h)
    low, high = trajectories.eqs.rigid_stops
    x = beside.state[:, 0]
    aside = ASIDE * spread[0].reshape(x.shape)
    x += np.where(x + aside < high, aside, -aside)
    np.clip(x, low, high, out=x)
    for ensemble in (trajectories, beside):
        ensemble.run(FOLLOWED * period)
    away = np.abs(beside.snapshot()[:2] - trajectories.snapshot()[:2]) / spread
    return np.asarray(away.max(axis=0) > PARTED)
