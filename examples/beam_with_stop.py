"""A piezo beam of two modes whose tip hits a stop, on a resistor: impacts excite both modes, and both charge the piezo.

    q_i'' + 2 zeta_i w_i q_i' + w_i^2 q_i = -theta_i V          charge theta_1 q_1 + theta_2 q_2

in modal coordinates of mass 1 kg.  The tip is at phi_1 q_1 + phi_2 q_2; at -gap its velocity turns
to -r times itself, by an impulse along phi.  Run it:

    .venv/bin/python examples/beam_with_stop.py
"""

from typing import NamedTuple

import harvester as hv


class Modes(NamedTuple):
    """Modal coordinates and their velocities."""

    q1: float
    q2: float
    v1: float
    v2: float


class Beam(NamedTuple):
    """Frequencies (rad/s), damping ratio, couplings (N/V per root kg), shapes at the tip (per root kg), gap, r."""

    w1: float = 300.0
    w2: float = 1900.0
    zeta: float = 0.01
    theta1: float = 5e-3
    theta2: float = 1.2e-2
    phi1: float = 10.0
    phi2: float = -8.0
    gap: float = 2e-4
    r: float = 0.8

    def drift(self, s, h):
        """Positions move at given speeds."""
        return Modes(s.q1 + h * s.v1, s.q2 + h * s.v2, s.v1, s.v2)

    def kick(self, s, h, voltage, noise):
        """Forces act for a time h."""
        return Modes(
            s.q1,
            s.q2,
            kicked(
                s.v1, -(self.w1**2) * s.q1 - self.theta1 * voltage, 2.0 * self.zeta * self.w1, h
            ),
            kicked(
                s.v2, -(self.w2**2) * s.q2 - self.theta2 * voltage, 2.0 * self.zeta * self.w2, h
            ),
        )

    def event(self, s, h):
        """When the tip meets the stop."""
        place = self.gap + self.phi1 * s.q1 + self.phi2 * s.q2
        speed = self.phi1 * s.v1 + self.phi2 * s.v2
        if speed < 0.0 and place + h * speed <= 0.0:
            return max(-place / speed, 0.0)
        return None

    def jump(self, s):
        """What the stop does to the modes."""
        speed = self.phi1 * s.v1 + self.phi2 * s.v2
        impulse = -(1.0 + self.r) * speed / (self.phi1**2 + self.phi2**2)
        return Modes(s.q1, s.q2, s.v1 + self.phi1 * impulse, s.v2 + self.phi2 * impulse)

    def source(self, s):
        """What drives the port."""
        return self.theta1 * s.q1 + self.theta2 * s.q2


def kicked(v, force, damping, h):
    """The velocity after the forces of a time h, on a mass of 1 kg."""
    half = 0.5 * h * damping
    return ((1.0 - half) * v + h * force) / (1.0 + half)


# The source is the charge itself, so the port's coupling is 1 and the reaction is the voltage.
PIEZO = hv.Piezo(coupling=1.0, capacitance="40 nF")
LOAD = hv.Load(resistance="100 kohm")
START = Modes(1e-4, 0.0, 0.0, 0.0)


def run(step="50 us", duration="0.1 s", **options):
    """The path of the beam, let go with its tip at 1 mm."""
    return hv.cosimulate(Beam(), LOAD, PIEZO, START, duration, step, **options)


if __name__ == "__main__":
    path = run()
    print(path)
    print(f"impacts at {', '.join(f'{1e3 * t:.2f}' for t in path.events[:5])} ms, ...")
