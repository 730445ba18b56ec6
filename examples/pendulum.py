"""A pendulum with dry friction in its bearing, that turns a generator: swings of any size, and a rest.

    I a'' = -m g l sin a - M sign(a') - K i          e = K a'

Within a kick the angle stands still, so the speed goes on at a steady rate until it is zero; there
it turns round, or stays where friction holds it.  Run it:

    .venv/bin/python examples/pendulum.py
"""

import math
from typing import NamedTuple

import harvester as hv


class Swing(NamedTuple):
    """Angle (rad) and its speed (rad/s)."""

    angle: float
    speed: float


class Pendulum(NamedTuple):
    """Inertia (kg m^2), torque of gravity at a right angle (N m), and torque of the friction (N m)."""

    inertia: float = 1e-3
    gravity: float = 0.049
    friction: float = 4e-4

    def drift(self, s, h):
        """Positions move at given speeds."""
        return Swing(s.angle + h * s.speed, s.speed)

    def kick(self, s, h, reaction, noise):
        """Forces act for a time h."""
        torque = -self.gravity * math.sin(s.angle) - reaction
        return Swing(
            s.angle, with_friction(s.speed, torque / self.inertia, self.friction / self.inertia, h)
        )

    def source(self, s):
        """What drives the port."""
        return s.speed


def with_friction(speed, a, f, h):
    """The speed after a time h of the acceleration a, and of f against the motion."""
    way = math.copysign(1.0, speed if speed != 0.0 else a)
    after = speed + (a - way * f) * h
    if after * way >= 0.0 and (speed != 0.0 or abs(a) > f):
        return after
    if abs(a) <= f:
        return 0.0
    return (a + way * f) * (h + speed / (a - way * f))


GENERATOR = hv.Coil(coupling=0.5, resistance="50 ohm", inductance="30 mH")
START = Swing(2.0, 0.0)


def run(step="5 ms", duration="10 s", load="200 ohm", model=None, **options):
    """The path of the pendulum, let go at 115 degrees."""
    load = hv.Load(resistance=load)
    return hv.cosimulate(model or Pendulum(), load, GENERATOR, START, duration, step, **options)


if __name__ == "__main__":
    path = run()
    print(path)
    print(f"it rests at {math.degrees(path.state['angle'][-1]):.2f} degrees")
