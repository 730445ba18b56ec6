"""Periodic states: the fixed points of a map of a period, with far fewer periods than settling needs.

A mass and its circuit settle in their slowest mode, which for a large capacitor lasts hundreds of
periods; a state has a few such modes only.  Anderson's acceleration finds the fixed point y = f(y)
from the last periods: among all combinations of the last f(y_i), with weights that add up to 1,
it chooses the one whose residuals f(y_i) - y_i leave least. (Anderson, J. ACM 12, 547, 1965; Walker
and Ni, SIAM J. Numer. Anal. 49, 1715, 2011.)

The changes between periods are worth as much for a neighbouring map, of a smaller step or
another frequency: a way may begin with those of another one (`Secants`), and then needs two or
three periods.

For a state y only the slow parts ``slow`` @ y count in a residual, and each group of them relative
to its size; the rest (nodes between diodes, say) follows.  If the way ends, the change in one
period of a storage capacitor that holds the energy of many is reported relative to the flow through
it in one, for so far is its state from the fixed point's, relative to its size.  The remainder of
the way is estimated by the next step of the same rule.

That step leads only along the last periods.  For a change f(y) - y in any other direction nothing
is known but that it may continue for as long as the slowest mode does, of which it may be one
period's part: it counts so many times (`Settling.unexplained`), and if that is too much, each slow
part is moved by itself (`Settling.learn`).

Long because the way to a fixed point and the remainder of it read the same changes.
"""

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.equations.bounds import growth_near
from harvester.equations.coefficients import Equations
from harvester.errors import CircuitError

MULTIPLES = 8  # periods of the excitation that a periodic response may take
FIRST = 4  # oscillations of the mass from rest before the way is shortened
# the same of a mass that is not linear; times so many at most, until it is near a response
LONGEST_WAY, WANDERS = 60, 5
NEAR = 0.01  # of the motion's size: a return that is seen among periods that still settle
COMES_BACK = 3e-3  # of the state's size, in the run that measures the response
SURE = 2.0  # times what is left as the last periods say it
MEMORY = 12  # periods that are combined
MOST = 80  # periods
PROBED = 0.01  # of the state's size: a change that shows the derivative, and no noise
KEPT = 16  # changes between periods that are reported to another way
REACHED = 3e-5  # of the state's size, where no other is asked for
NOISY = 2e-3  # the same, where ngspice's tolerance lets it come no nearer in `PATIENCE` periods
# the second: of the nearest before, what counts as nearer
PATIENCE = 4
NEARER = 0.7
# of the state's size: a change of y that is worth telling to another way, well above that noise
WORTH = 3e-3
# of a step to a state that the circuit refuses; relative to the state, not worth a try
SHORTER, LEAST = 0.3, 1e-3
EXPLAINED = 0.3  # of the change of f(y) - y: the change of y that explains it
# What is not believed of a change: a part of the size of one that was known of another scene, of
# the same one at another step, of one's own, and what ngspice's tolerance makes in any, relative to
# the state
STALE = 0.1
ALIKE = 0.03
CURVED = 0.01
NOISE = 1e-4
CREEPING = 0.1  # of f(y) - y: what it changes by in a period where only a slow mode is left
LONGEST = 100.0  # periods that the slowest mode is taken to last, at most
# of f(y) - y itself: that noise is no larger than this, for a slow mode changes little in a period
QUIETER = 0.1


def periods_to_settle(eqs: Equations, turns: int) -> float:
    """Times ``turns`` periods of the excitation that small motions of the mass last: 1/(1 - e^-q) if these leave e^-q.

    If they do not die out, it is `LONGEST`.
    """
    period = eqs.shaking_period
    assert period is not None, "the drive is steady"
    rate = -max(growth_near(eqs, x) for x in eqs.resting_places or [0.0])
    left = math.expm1(-max(rate, 0.0) * turns * period)
    return min(-1.0 / left, LONGEST) if left < 0.0 else LONGEST


def periods_that_hold(oscillations: float, period: float, least: int = 1) -> int:
    """How many periods of the excitation hold so many oscillations of the mass, at least ``least``."""
    return max(math.ceil(oscillations * min(2.0 * math.pi / period, 1.0)), least)


def comes_back_after(motion: Floats, size: float) -> int:
    """After how many periods the last of many (x, x'), of a motion of that size, come back.

    0 if they do not.

    ``motion``, shape (n, 2), has the states a period apart.
    """
    last = motion[-MULTIPLES:]
    for turns in range(1, MULTIPLES + 1):
        if np.max(np.linalg.norm(last - motion[-MULTIPLES - turns : -turns], axis=1)) < NEAR * size:
            return turns
    return 0


# a state -> the state a period later, and the means over that period
Turn = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Secants:
    """Changes of f(y), shape (m, size of a state), of the slow part of f(y) - y, and of the means, between periods."""

    states: Floats
    residuals: Floats
    means: Floats


@dataclass(frozen=True)
class Remainder:
    """The rest of the way to a fixed point.

    ``size`` is relative to the state's; ``means`` are their changes on that way; ``unexplained`` is
    the part of ``size`` that no known change explains (`Settling.unexplained`).
    """

    size: float
    means: Floats
    unexplained: float

    def shares(self, means: Floats, stderr: Floats | float = 0.0) -> Floats:
        """The parts of ``means`` that the rest may change, with their standard error."""
        known = (np.abs(self.means) + stderr) / np.maximum(means, 1e-300)
        return np.asarray(SURE * (known + self.unexplained))


@dataclass
class Settling:
    """The way to a fixed point of ``turn``.

    ``slow``, shape (n, size of a state), picks the parts that count; ``groups``, shape (n,),
    numbers those of one size. ``state`` is the last f(y), shape (size,), ``begin`` the y that led
    there, and ``means`` those of its period; ``known`` are another way's changes, and ``stale`` the
    part of it that is not believed.  The last slow part, squared and times ``stored``, is an energy
    in units of the first mean over a period; ``swing`` @ means, shape (n,), are squares of sizes
    over a period, which at a state near 0 count in place of those of the state; ``slowest`` is the
    number of periods that the slowest mode needs, apart from a storage capacitor; ``probed``
    whether each slow part was moved.
    """

    turn: Turn
    slow: Floats
    groups: Floats
    state: Floats
    known: Secants | None = None
    stored: float = 0.0
    stale: float = STALE
    swing: Floats | None = None
    slowest: float = 1.0
    means: Floats = field(default_factory=lambda: np.zeros(0))
    begin: Floats = field(default_factory=lambda: np.zeros(0))
    probed: bool = False
    _states: list[Floats] = field(default_factory=list)
    _residuals: list[Floats] = field(default_factory=list)
    _means: list[Floats] = field(default_factory=list)

    def size(self, change: Floats) -> float:
        """The size of a change of the slow part, shape (n,), relative to that of the last state's groups."""
        return float(np.linalg.norm(self._weights() * change))

    def residual_norm(self, residual: Floats) -> float:
        """The size of the slow part of f(y) - y, shape (n,), of which that of storage counts by the flow through it."""
        return float(np.linalg.norm(self._weights(flow=True) * residual))

    def _weights(self, flow: bool = False) -> Floats:
        """One over the size of each slow part's group, or in the last place, over the flow through storage."""
        square = (self.slow @ self.state) ** 2
        sizes = np.sqrt([square[self.groups == group].sum() for group in self.groups])
        if self.swing is not None and len(self.means):
            sizes = np.maximum(sizes, np.sqrt(self.swing @ self.means))
        if flow and self.stored and len(self.means) and self.means[0] > 0.0:
            sizes[-1] /= max(self.stored * float(square[-1] / self.means[0]), 1.0)
        return np.asarray(1.0 / np.maximum(sizes, 1e-12))

    def fixed_point_iteration(self, turns: int, start: Floats | None = None) -> None:
        """Continue for so many periods as they come, from the last state or from another."""
        self.state = self.state if start is None else start
        for _ in range(turns):
            self.begin = self.state
            self.state, self.means = self.turn(self.begin)

    def left(self, residual: Floats) -> tuple[Floats, Floats]:
        """How far f(y) and its means are from those of the fixed point, by the last periods.

        ``residual`` is the slow part of f(y) - y, shape (n,).
        """
        changes, share = self._combination(residual)
        if changes is None:
            return np.zeros_like(self.state), np.zeros_like(self.means)
        return share @ changes.states, share @ changes.means

    def unexplained(self, residual: Floats) -> float:
        """How far f(y) may be from the fixed point for the unexplained part of f(y) - y, relative to its size.

        ``residual`` is as of `left`.  The part that changes explain is removed twice: as none
        of them is believed altogether, the first time leaves some of it, which is within the error
        of `left`.
        """
        rest = residual
        for _ in range(2):
            changes, share = self._combination(rest)
            rest = rest if changes is None else rest - share @ changes.residuals
        return self.slowest * self.residual_norm(rest)

    def remainder(self, residual: Floats) -> Remainder:
        """The rest of the way, of which ``residual`` is as of `left`."""
        left, means = self.left(residual)
        unexplained = self.unexplained(residual)
        size = self.residual_norm(residual) + self.size(self.slow @ left) + unexplained
        return Remainder(size, means, unexplained)

    def _combination(self, residual: Floats) -> tuple[Secants | None, Floats]:
        """The known changes, and how much of each explains the slow part of f(y) - y.

        None before there are any.
        """
        changes = self.secants()
        if changes is None:
            return None, np.zeros(0)
        weights = self._weights()
        columns = (weights * changes.residuals).T
        known = 0 if self.known is None else len(self.known.states)
        noise = min(NOISE, QUIETER * self.size(residual))
        if len(self._residuals) > 1:  # nor larger than the last two differ: of a slow mode hardly
            noise = min(noise, self.size(self._residuals[-1] - self._residuals[-2]))
        curved = np.where(np.arange(columns.shape[1]) < known, self.stale, CURVED)
        penalty = curved * np.linalg.norm(columns, axis=0) + noise
        system = np.vstack([columns, np.diag(penalty)])
        return changes, np.linalg.lstsq(
            system, np.append(weights * residual, np.zeros(len(penalty))), rcond=None
        )[0]

    def secants(self, worth: float = 0.0) -> Secants | None:
        """The known changes, and after them the changes between this way's last periods.

        None before there are any.

        A change of f(y) that no change of y explains is ngspice's tolerance, and has no information
        on the way; nor does a change of y that is not ``worth`` it, relative to the state's size.
        """
        known = (
            []
            if self.known is None
            else [[self.known.states, self.known.residuals, self.known.means]]
        )
        if len(self._states) > 1:
            new = [
                np.diff(values, axis=0) for values in (self._states, self._residuals, self._means)
            ]
            moved = new[0] @ self.slow.T - new[1]
            changed = new[1]
            least = [max(EXPLAINED * self.size(change), worth) for change in changed]
            kept = [self.size(change) > size for change, size in zip(moved, least, strict=True)]
            known.append([values[kept] for values in new])
        if not known:
            return None
        states, residuals, means = (
            np.concatenate(values)[-KEPT if worth else 0 :] for values in zip(*known, strict=True)
        )
        return Secants(states, residuals, means) if len(states) else None

    def probe(self) -> None:
        """Continue from where changes of each slow part lead."""
        self._must_learn(True)
        self.state = self.state - self.left(self.slow @ (self.state - self.begin))[0]

    def learn(self) -> None:
        """Change each slow part by `PROBED` of its group's size, one after the other, to know the way from here on.

        A period is so smooth a map that this gives its derivative to a part of about `CURVED`.
        """
        y = self.begin
        after = self.state
        derivatives = []
        for row, weight in zip(self.slow, self._weights(), strict=True):
            aside = row * (PROBED / weight / max(float(row @ row), 1e-300))
            if aside.any():
                with contextlib.suppress(CircuitError):  # which need not bear it
                    there, means = self.turn(y + aside)
                    derivatives.append(
                        (there - after, self.slow @ (there - after - aside), means - self.means)
                    )
        if derivatives:
            self._forget(1)
            states, residuals, means = map(np.array, zip(*derivatives, strict=True))
            self.known = Secants(states, residuals, means)
            self.stale = CURVED
        self.probed = True

    def _keep(self, residual: Floats) -> None:
        """Keep the last period, whose f(y) - y has this slow part, for the combinations to come."""
        for values, value in (
            (self._states, self.state),
            (self._residuals, residual),
            (self._means, self.means),
        ):
            values.append(value)
            del values[:-MEMORY]

    def _creeps(self, since: int) -> bool:
        """Whether f(y) - y hardly changes: a slow mode, which the changes of faster ones hide, and no noise."""
        if (
            since < 2 or len(self._residuals) < 2
        ):  # a circuit that failed on the way made it forget the others
            return False
        before, now = self._residuals[-2:]
        return self.size(now - before) < CREEPING * self.size(now)

    def _forget(self, but: int = 0) -> None:
        """Combine no periods but so many of the last ones."""
        self.known = None
        for values in (self._states, self._residuals, self._means):
            del values[: len(values) - but]

    def _nearer(self, reached: Floats, step: Floats) -> Floats:
        """A shorter step from a state that was reached; none from where it is not worth a try."""
        if self.size(self.slow @ step) >= LEAST:
            return reached - step
        self._forget()
        return reached

    def reach(self, enough: float = REACHED, guess: bool = False) -> bool:
        """Go on to the fixed point, to ``enough`` of the state's size.

        Whether it was reached, in `MOST` periods.

        With ``guess``, it ends as soon as the remainder by the last periods may bring it there, and
        moves by it.
        """
        y = self.state
        best = np.inf
        since = 0
        step = np.zeros_like(self.state)
        nearest = (self.state, self.state)
        near = np.inf
        for _ in range(MOST):
            reached = self.state
            try:
                self.fixed_point_iteration(1, y)
            except (
                CircuitError
            ):  # which a combination may ask of a circuit, but no state that a period leads to
                if y is reached:
                    raise
                step *= SHORTER
                y = self._nearer(reached, step)
                self.state = reached
                continue
            residual = self.slow @ (self.state - y)
            self._keep(residual)
            step = self.left(residual)[0]
            going = self.size(self.slow @ step)
            size = self.residual_norm(residual) + going
            if size < NEARER * best:
                best = size
                nearest = (y, self.state)
                since = 0
                near = self.size(residual) + going
            else:
                since += 1
            if self._creeps(since):
                self._forget(2)
                step = self.left(residual)[0]
                best = np.inf
                since = 0
            if self.secants() is not None:
                whole = size + self.unexplained(residual)
                noisy = since >= PATIENCE and near < NOISY
                if guess and whole < enough / STALE:
                    self.state = self.state - step
                    return True
                if whole < enough or (noisy and self.probed):
                    self.begin, self.state = nearest
                    return True
                if self._must_learn(size < enough or noisy):
                    step = self.left(residual)[0]
                    best = np.inf
                    since = 0
            y = self.state - step
        return False

    def _must_learn(self, seems_there: bool) -> bool:
        """Move each slow part, once, if the way seems to end, for all that is known of it.

        Whether it did.
        """
        learns = seems_there and not self.probed
        if learns:
            self.learn()
        return learns
