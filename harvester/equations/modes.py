"""Several modes or masses: the coordinates next to that of the oscillator, nondimensional.

All coordinates y_j are scaled so that the kinetic energy is sum y_j'^2/2, in the units of the first
mode's mass M:

    y_j'' + d_j y_j' + k_j y_j + e_j F + beta s_j V = g_j a,    V' + mu V = sum s_j y_j'

F is spring and friction of the oscillator at its displacement x = sum e_j y_j, a the acceleration
that shakes it.

    further modes   y_j = sqrt(M_j/M) x_j,  e = (1, 0, ...),  s_j = theta_j/theta sqrt(M/M_j),  g_j = base_j sqrt(M_j/M)
    ball            one more: y = sqrt(Mb/M) Z/l, k = d = s = e = 0, g = sqrt(Mb/M), and a constant pull, its weight
    magnifier       y = (X + Z, sqrt(Mm/M) Z)/l,  e = s = (1, -sqrt(M/Mm)),  g = (1, sqrt(Mm/M)),  Mm its mass

A stop meets w = sum phi_j y_j, of a ball X - Z at its place: an impact changes the speeds along
phi, so that

    y' += phi/(phi.phi) (w'+ - w'-)    with the energy (w'-^2 - w'+^2)/(2 phi.phi) removed

Friction of the oscillator on a magnifier damps both coordinates, e_i e_j f: that matrix is kept
whole.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from harvester.arrays import Floats
from harvester.scene.modal_parameters import ModalParameters
from harvester.scene.physical import Ball, Magnifier, Mode

TURN = 2.0 * math.pi
STANDARD_GRAVITY = 9.80665
ALIKE = 1e-9  # of the accelerations of a ball and its box


class SingleMode:
    """The oscillator's coordinate alone, with the properties of `Modes`.

    ``contact`` is None, as the displacement meets the stops; ``shares_friction`` is whether no
    other coordinate has a friction of its own, ``meets_stops`` whether the displacement alone meets
    the stops.
    """

    contact: tuple[float, ...] | None = None
    pull: float | None = None
    shaken_mass = 1.0
    shares_friction = True
    meets_stops = True

    def highest(self, spring: float, beta: float) -> float:
        """The frequency at rest without a load, in units of itself."""
        return 1.0

    def flow(
        self, spring: float, friction: float, beta: float, grown: float, mu: float | None
    ) -> Floats:
        """The matrix of (x, x', V), or without a load of (x, x'); x' feeds V by ``grown``."""
        if mu is None:
            return np.array([[0.0, 1.0], [-spring - beta * grown, -friction]])
        return np.array([[0.0, 1.0, 0.0], [-spring, -friction, -beta], [0.0, grown, -mu]])


@dataclass(frozen=True)
class Modes:
    """The coefficients above, each of all coordinates, shape (n,).

    ``stiffness`` and ``damping`` in addition to F.

    ``oscillator`` is e, None if it is (1, 0, ...).  With a ball, the last coordinate, ``pull`` is its weight,
    -y'', 0 if its path is level; None without one.
    """

    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    coupling: tuple[float, ...]
    base: tuple[float, ...]
    contact: tuple[float, ...]
    oscillator: tuple[float, ...] | None = None
    pull: float | None = None
    shares_friction: ClassVar[bool] = False

    @property
    def count(self) -> int:
        """How many coordinates there are."""
        return len(self.stiffness)

    @property
    def sprung(self) -> int:
        """How many of them have a spring: all but a ball's."""
        return self.count - (self.pull is not None)

    @property
    def is_carried(self) -> bool:
        """Whether a ball and its box are shaken alike, so that no noise keeps it from lying still in there."""
        return self.pull is not None and abs(float(np.dot(self.contact, self.base))) < ALIKE

    def at_rest(self, x: Floats | float) -> Floats:
        """All y with the oscillator at x and a ball amid its box, shape (n, ...)."""
        y = np.zeros((self.count, *np.shape(x)))
        y[0] = x
        if self.pull is not None:
            y[-1] = -self.contact[0] / self.contact[-1] * y[0]
        return y

    @property
    def meets_stops(self) -> bool:
        """Whether the oscillator's displacement alone meets the stops."""
        return self.contact == tuple(self.direction)

    @property
    def shaken_mass(self) -> float:
        """The sum of g_j^2: the mass that the base excites, in units of M."""
        return math.fsum(g * g for g in self.base)

    @property
    def mobility(self) -> float:
        """The product phi.phi, which is M over the mass that a stop meets."""
        return math.fsum(phi * phi for phi in self.contact)

    @property
    def direction(self) -> Floats:
        """The vector e."""
        return np.eye(self.count)[0] if self.oscillator is None else np.array(self.oscillator)

    def matrices(self, spring: float, friction: float) -> tuple[Floats, Floats]:
        """The matrices of stiffness and damping, shape (n, n), with those of the oscillator."""
        e = self.direction
        oscillator = np.outer(e, e)
        return np.diag(self.stiffness) + spring * oscillator, np.diag(
            self.damping
        ) + friction * oscillator

    def highest(self, spring: float, beta: float) -> float:
        """The highest frequency of all, in open circuit."""
        s = np.array(self.coupling)
        return math.sqrt(
            float(np.linalg.eigvalsh(self.matrices(spring, 0.0)[0] + beta * np.outer(s, s))[-1])
        )

    def flow(
        self, spring: float, friction: float, beta: float, grown: float, mu: float | None
    ) -> Floats:
        """The matrix of (y, y', V), or without a load of (y, y'); ``grown`` is 1."""
        (k, d) = self.matrices(spring, friction)
        s = np.array(self.coupling)
        n = self.count
        if mu is None:
            return np.block([[np.zeros((n, n)), np.eye(n)], [-k - beta * np.outer(s, s), -d]])
        matrix = np.zeros((2 * n + 1, 2 * n + 1))
        matrix[:n, n : 2 * n] = np.eye(n)
        matrix[n : 2 * n, :n] = -k
        matrix[n : 2 * n, n : 2 * n] = -d
        matrix[n : 2 * n, -1] = -beta * s
        matrix[-1, n : 2 * n] = s
        matrix[-1, -1] = -mu
        return matrix


def further_modes(
    modal: ModalParameters,
    modes: Sequence[Mode],
    magnifier: Magnifier | None,
    ball: Ball | None,
    length: float,
) -> Modes | None:
    """The coordinates of a device with further modes, a magnifier or a ball, in units of ``length``; None without."""
    if ball is not None:
        return _with_ball(modal, modes, ball, length)
    if magnifier is not None:
        return _on_magnifier(modal, magnifier)
    return _of_device(modal, modes) if modes else None


def _of_device(modal: ModalParameters, modes: Sequence[Mode]) -> Modes:
    """The coordinates of the oscillator and of further modes."""
    roots = [math.sqrt(mode.mass / modal.mass) for mode in modes]
    w = [TURN * mode.frequency / modal.frequency for mode in modes]

    def of_all(name: str, default: float) -> list[float]:
        return [default if (value := getattr(mode, name)) is None else value for mode in modes]

    return Modes(
        stiffness=(0.0, *(w_j * w_j for w_j in w)),
        damping=(
            0.0,
            *(
                2.0 * ratio * w_j
                for ratio, w_j in zip(of_all("damping_ratio", 0.0), w, strict=True)
            ),
        ),
        coupling=(
            1.0,
            *(
                s / (modal.coupling * root)
                for s, root in zip(of_all("coupling", 0.0), roots, strict=True)
            ),
        ),
        base=(1.0, *(base * root for base, root in zip(of_all("base", 1.0), roots, strict=True))),
        contact=(
            1.0,
            *(phi / root for phi, root in zip(of_all("at_stop", 1.0), roots, strict=True)),
        ),
    )


def _on_magnifier(modal: ModalParameters, magnifier: Magnifier) -> Modes:
    """The coordinates of a device on a magnifier; a stop is under that, or the device's own."""
    root = math.sqrt(magnifier.mass / modal.mass)
    rate = magnifier.mass * modal.frequency
    e = (1.0, -1.0 / root)
    stiffness = magnifier.stiffness / (rate * modal.frequency)
    contact = e if magnifier.restitution is None else (0.0, 1.0 / root)
    return Modes(
        (0.0, stiffness), (0.0, (magnifier.damping or 0.0) / rate), e, (1.0, root), contact, e
    )


def _with_ball(modal: ModalParameters, modes: Sequence[Mode], ball: Ball, length: float) -> Modes:
    """The coordinates of a device, and that of a ball on it."""
    plain = _of_device(modal, modes)
    root = math.sqrt(ball.mass / modal.mass)
    weight = (
        STANDARD_GRAVITY * math.sin(math.radians(ball.tilt or 0.0)) / (length * modal.frequency**2)
    )
    return Modes(
        stiffness=(*plain.stiffness, 0.0),
        damping=(*plain.damping, 0.0),
        coupling=(*plain.coupling, 0.0),
        base=(*plain.base, root),
        contact=(*plain.contact, -1.0 / root),
        pull=root * weight,
    )
