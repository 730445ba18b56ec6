"""The coefficients of the nondimensional equations (paper, Eq. 2, and the terms that this package adds)."""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.effects import EFFECTS, SEVERAL_MODES
from harvester.equations.modes import Modes, SingleMode
from harvester.errors import CannotServeError
from harvester.presentation.diagnostic import refusal
from harvester.records.records import Record, TabulatedDensity

# The friction f(x) = -c1 - c2 x^2 + c3 x^4: a term for each even power of x, its coefficient and
# the sign that it has.
FRICTION = {"c1": -1.0, "c2": -1.0, "c3": 1.0}


def friction_names() -> tuple[str, ...]:
    """The names of the coefficients of damping, the arguments of the kernels."""
    return tuple(FRICTION)


@dataclass(frozen=True, kw_only=True)
class Equations:
    """The coefficients of Eq. 2; None is an effect that is absent.

    The spring is linear x + alpha2 x^2 + alpha x^3 - softening x |x|; ``linear`` None is 1.  The
    mass is 1 + inertia x^2, the coupling 1 + gamma x^2, and ``mu`` includes the ``loss_tangent`` of
    the piezo.  The friction is f(x) + cv |x'|.

    The stop is at x = -gap (None: at rest, x = 0), rigid if ``restitution`` is given, compliant if
    ``stop_stiffness`` is; the opposite one is rigid, at x = opposite_gap.  n1 = eps1^2 D11, n2 =
    eps2^2 D22 and n12 = eps1 eps2 D12 are the noise intensities. beta None is a voltage without
    force on the mass, mu None an open circuit, restitution None no stop, and so on.

    Other excitation than white noise, one kind at most (`harvester.mechanics.kernels.shaking`):
    ``drive`` cos(drive_frequency t); noise of low-frequency intensity ``coloured`` with a
    ``correlation_time``; or of intensity ``coloured`` at the frequency ``centre`` with the
    half-power ``bandwidth``; a ``record``, or records of a ``density``.  ``modes`` are further
    modes, or a magnifier.
    """

    alpha: float | None = None
    beta: float | None = None
    mu: float | None = None
    c1: float | None = None
    c2: float | None = None
    c3: float | None = None
    cv: float | None = None
    restitution: float | None = None
    n1: float | None = None
    n2: float | None = None
    n12: float | None = None
    linear: float | None = None
    alpha2: float | None = None
    softening: float | None = None
    inertia: float | None = None
    gamma: float | None = None
    loss_tangent: float | None = None
    gap: float | None = None
    opposite_restitution: float | None = None
    opposite_gap: float | None = None
    stop_stiffness: float | None = None
    stop_damping: float | None = None
    drive: float | None = None
    drive_frequency: float | None = None
    coloured: float | None = None
    correlation_time: float | None = None
    centre: float | None = None
    bandwidth: float | None = None
    record: Record | None = None
    density: TabulatedDensity | None = None
    modes: Modes | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that are present, in the order of the equations.

        Nothing else is computed.
        """
        return tuple(effect.name for effect in EFFECTS if effect.is_in(self))

    @property
    def is_random(self) -> bool:
        """Whether anything is random."""
        return not (
            self.n1 is None and self.n2 is None and self.coloured is None and self.density is None
        )

    @property
    def has_new_noise(self) -> bool:
        """Whether noise is new from step to step: white or coloured, and no record drawn at the beginning."""
        return not (self.n1 is None and self.n2 is None and self.coloured is None)

    @property
    def is_shaken(self) -> bool:
        """Whether anything shakes the mass at rest."""
        return self.n1 is not None or self.is_shaken_otherwise

    @property
    def is_steady(self) -> bool:
        """Whether the mass is shaken and nothing is random: a harmonic excitation or a record alone."""
        return self.is_shaken and not self.is_random

    @property
    def is_shaken_otherwise(self) -> bool:
        """Whether anything other than white noise shakes the mass."""
        return any(
            shaking is not None
            for shaking in (self.coloured, self.drive, self.record, self.density)
        )

    @property
    def is_shaken_by_white_noise(self) -> bool:
        """Whether white noise moves the mass, and nothing else."""
        return self.is_random and not self.is_shaken_otherwise

    @property
    def shaking_period(self) -> float | None:
        """Period of an excitation that repeats itself.

        None for one that does not, and without any.
        """
        if self.drive is not None:
            assert self.drive_frequency is not None, "Scene checks this"
            return 2.0 * math.pi / self.drive_frequency
        return None if self.record is None else self.record.period

    @property
    def spring(self) -> tuple[float, float, float]:
        """Linear, quadratic and cubic coefficient of the spring, 0 if absent."""
        return 1.0 if self.linear is None else self.linear, self.alpha2 or 0.0, self.alpha or 0.0

    @property
    def friction(self) -> tuple[float, ...]:
        """Coefficients of 1, x^2, x^4 and so on in the friction f(x) = c3 x^4 - c2 x^2 - c1, 0 if absent."""
        return tuple(
            sign * value if (value := getattr(self, name)) else 0.0
            for name, sign in FRICTION.items()
        )

    def spring_force(self, x: float) -> float:
        """Force of the spring at x; 0 at infinity, if no stop is."""
        if not math.isfinite(x):
            return 0.0
        linear, alpha2, alpha = self.spring
        return -x * (linear + x * (alpha2 + x * alpha)) + (self.softening or 0.0) * x * abs(x)

    def spring_slope(self, x: float) -> float:
        """Stiffness of the spring for small motions about x."""
        linear, alpha2, alpha = self.spring
        return (
            linear + x * (2.0 * alpha2 + 3.0 * alpha * x) - 2.0 * (self.softening or 0.0) * abs(x)
        )

    @property
    def balanced_places(self) -> Floats:
        """Places without a force of the spring, in ascending order."""
        linear, alpha2, alpha = self.spring
        if self.softening is None:
            roots = np.roots([alpha, alpha2, linear, 0.0])
            return np.sort(roots.real[roots.imag == 0.0])
        sides = [
            (side, np.roots([alpha, alpha2 - side * self.softening, linear]))
            for side in (-1.0, 1.0)
        ]
        beyond = [
            roots.real[(roots.imag == 0.0) & (side * roots.real > 0.0)] for side, roots in sides
        ]
        return np.sort(np.concatenate([*beyond, [0.0]]))

    @property
    def load(self) -> float | None:
        """The part of mu that is the load's; None in open circuit."""
        if self.loss_tangent is None or self.mu is None:
            return self.mu
        return self.mu - self.loss_tangent if self.mu > self.loss_tangent else None

    @property
    def modal(self) -> SingleMode | Modes:
        """The coordinates, also of one mode."""
        return self.modes or SingleMode()

    @property
    def highest_frequency(self) -> float:
        """The highest natural frequency of the modes in open circuit; 1 of one mode."""
        return self.modal.highest(self.spring[0], self.beta or 0.0)

    @property
    def has_stop(self) -> bool:
        """Whether the mass can hit a stop, rigid or compliant."""
        return self.restitution is not None or self.stop_stiffness is not None

    @property
    def has_ball(self) -> bool:
        """Whether the stops are the ends of a ball's box."""
        return self.modal.pull is not None

    @property
    def rigid_stops(self) -> tuple[float, float]:
        """Least and most x that the rigid stops allow; infinite if absent.

        For several modes, and of a stop under a magnifier, they are those of the contact
        coordinate; a ball limits none.
        """
        if self.has_ball:
            return -math.inf, math.inf
        low = -math.inf if self.restitution is None else 0.0 - (self.gap or 0.0)
        return low, math.inf if self.opposite_restitution is None else self.opposite_gap or 0.0

    @property
    def stops(self) -> tuple[float, float]:
        """Places of the stops, rigid or compliant; infinite if absent."""
        low, high = self.rigid_stops
        return (low if self.stop_stiffness is None else -(self.gap or 0.0)), high

    @property
    def pressure(self) -> float:
        """The spring's acceleration that presses the mass on a stop, the larger one of two.

        0 if on none.
        """
        low, high = self.stops
        return max(0.0, -self.spring_force(low), self.spring_force(high))

    @property
    def resting_places(self) -> list[float]:
        """Rest positions of the mass without voltage: minima of the spring's energy, and stops that it is pressed on.

        In ascending order; two or more for a bistable spring.  A mass pressed on a compliant stop
        is placed at its edge.
        """
        low, high = self.stops
        pressed = {
            x for x, inward in ((low, 1.0), (high, -1.0)) if inward * self.spring_force(x) < 0.0
        }
        free = [float(x) for x in self.balanced_places if self.spring_slope(float(x)) > 0.0]
        return sorted(pressed | {x for x in free if low <= x <= high})

    @property
    def has_unlike_wells(self) -> bool:
        """Whether the mass has several resting places that are not mirror images of each other."""
        stop, opposite = (
            (self.restitution, self.gap),
            (self.opposite_restitution, self.opposite_gap),
        )
        mirrored = (
            stop == opposite
            and self.alpha2 is None
            and self.n12 is None
            and self.stop_stiffness is None
        )
        return len(self.resting_places) > 1 and not mirrored


def check_one_mode(eqs: Equations) -> None:
    """Refuse further modes and a magnifier, if equations of one mode are solved.

    Raises CannotServeError.
    """
    if eqs.modes is not None:
        effects = " and ".join(name for name in eqs.effects if name in SEVERAL_MODES)
        instead = "engine 'ensemble', which gives the mean power"
        raise CannotServeError(
            refusal("unknown_effects", who="this study", effects=effects, instead=instead)
        )
