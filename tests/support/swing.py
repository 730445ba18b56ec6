"""A mass on a spring as a model of `cosimulate`."""

import math
from typing import NamedTuple

import harvester as hv

PIEZO = hv.Piezo(coupling="1 mN/V", capacitance="50 nF")


class Place(NamedTuple):
    """A displacement (m) and a velocity (m/s)."""

    x: float
    v: float


class Swing(NamedTuple):
    """Mass (kg), damping (N s/m), stiffness (N/m), density of force (N^2/Hz), and a base's acceleration (m/s^2)."""

    m: float = 0.04
    c: float = 6e-3
    k: float = 16.0
    density: float = 0.0
    a: float = 0.0

    def drift(self, s, h):
        return Place(s.x + h * s.v, s.v)

    def kick(self, s, h, reaction, noise):
        half = 0.5 * h * self.c / self.m
        force = (
            h * (-self.k * s.x - reaction - self.m * self.a) + math.sqrt(self.density * h) * noise
        )
        return Place(s.x, ((1.0 - half) * s.v + force / self.m) / (1.0 + half))

    def source(self, s):
        return s.x
