"""An electromagnetic harvester with a rectifier: a magnet on a spring, a coil, and the package's bridge.

    m x'' + c x' + k x = F(t) - K i          e = K x'   in series with the coil's R and L, then the bridge

The base shakes it at its resonance.  Run it:

    .venv/bin/python examples/electromagnetic_bridge.py
"""

import math
from typing import NamedTuple

import harvester as hv


class Magnet(NamedTuple):
    """Displacement (m), velocity (m/s), and the time (s), which the force needs."""

    x: float
    v: float
    t: float


class Harvester(NamedTuple):
    """Mass (kg), damping (N s/m), stiffness (N/m), and the base's acceleration (m/s^2) and frequency (rad/s)."""

    m: float = 0.02
    c: float = 0.025
    k: float = 300.0
    a: float = 2.0
    w: float = 120.0

    def drift(self, s, h):
        """Positions move at given speeds."""
        return Magnet(s.x + h * s.v, s.v, s.t + h)

    def kick(self, s, h, reaction, noise):
        """Forces act for a time h."""
        force = self.m * self.a * math.cos(self.w * s.t) - self.k * s.x - reaction
        half = 0.5 * h * self.c / self.m
        return Magnet(s.x, ((1.0 - half) * s.v + h * force / self.m) / (1.0 + half), s.t)

    def source(self, s):
        """What drives the port."""
        return s.v


COIL = hv.Coil(coupling="10 V s/m", resistance="100 ohm", inductance="20 mH")
BRIDGE = hv.Netlist("bridge", R="100 kohm", C="1 uF")


def run(step="0.25 ms", duration="1 s", **options):
    """The path of the harvester from rest, with the voltage of the bridge's capacitor."""
    options = {"probe": "store", **options}
    return hv.cosimulate(
        Harvester(), BRIDGE, COIL, Magnet(0.0, 0.0, 0.0), duration, step, **options
    )


if __name__ == "__main__":
    path = run()
    print(path)
    print(f"the store is at {path.probes['store'][-1]:.3f} V")
