"""Models of a user's own, the examples among them, and what they are compared with."""

import importlib.util
import itertools
import math
import sys
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from tests.support.paths import ROOT


@cache
def example(name):
    """A script of examples/ as a module."""
    spec = importlib.util.spec_from_file_location(
        f"example_{name}", ROOT / "examples" / f"{name}.py"
    )
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Motion(NamedTuple):
    """Displacement and velocity, and how far the mass was from its stop when it met it."""

    x: float
    v: float
    miss: float = 0.0


class Oscillator(NamedTuple):
    """A mass on a spring whose port is a piezo, with noise, and a stop at x = 0 where it has a restitution."""

    m: float
    k: float
    c: float
    noise: float | None = None
    restitution: float | None = None
    moving: float = 0.0  # the port sees the velocity rather than the displacement, as a coil

    def drift(self, s, h):
        return Motion(s.x + h * s.v, s.v, s.miss)

    def kick(self, s, h, reaction, noise):
        impulse = -h * (self.k * s.x + reaction)
        if self.noise is not None:
            impulse += math.sqrt(self.noise * h) * noise
        half = 0.5 * self.c * h / self.m
        return Motion(s.x, ((1.0 - half) * s.v + impulse / self.m) / (1.0 + half), s.miss)

    def event(self, s, h):
        if self.restitution is not None and s.v < 0.0 and s.x + h * s.v <= 0.0:
            return max(-s.x / s.v, 0.0)
        return None

    def jump(self, s):
        return Motion(0.0, -(self.restitution or 0.0) * s.v, max(s.miss, abs(s.x)))

    def source(self, s):
        return s.v if self.moving > 0.0 else s.x


def linear(a, start, times):
    """The exact y' = a y at equally spaced times, shape (times, len(start))."""
    step = expm(a * (times[1] - times[0]))
    rows = [np.array(start, dtype=float)]
    for _ in times[1:]:
        rows += [step @ rows[-1]]
    return np.array(rows)


def orders(errors):
    """The orders of convergence between errors at steps that halve."""
    return [math.log2(a / b) for a, b in itertools.pairwise(errors)]
