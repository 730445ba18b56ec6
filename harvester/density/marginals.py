"""Densities of one or two quantities, and rates of passages, from the density of `weak_form`.

A passage is a flux of the density: upwards through a displacement a, and by impacts of the speed u
at a stop at s,

    int_{v > 0} v p(a, v) dv,    u p(s, -u)

The first is Rice's rate with the true density in place of a Gaussian one.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.density.elements import evaluated, quadrature, shape_values
from harvester.density.moment_weights import MomentWeights, value
from harvester.density.weak_form import WeakForm

WIDEST = 12.0  # root mean squares of the voltage: where its moments end


def _next_mode(x: Floats, k: int, before: Floats, now: Floats) -> Floats:
    """The normalised Hermite polynomial k + 1 at x, times any weight, from those of k - 1 and k."""
    return np.asarray((x * now - np.sqrt(k) * before) / np.sqrt(k + 1.0))


class Marginals:
    """The marginals of a density p on a form for one or two quantities; 0 outside of its box."""

    def __init__(self, form: WeakForm, p: Floats) -> None:
        # no further modes of coloured noise
        self.form = form
        self.p = p[..., : form.v_nodes]
        mesh = form.mesh
        self._whole = p
        self._x = mesh.in_x
        self._over_v = form.over_v(form.v_mass)[: form.v_nodes]

    def displacement(self, x: Floats) -> Floats:
        """The density of the displacement, shape (n,)."""
        return self._at(self.p[0] @ self._over_v, x)

    def share_below(self, x: float) -> float:
        """The probability of a displacement below x."""
        breaks = self.form.mesh.x_breaks
        in_x = quadrature(
            np.append(breaks[breaks < x], min(x, breaks[-1])), 1, self.form.mesh.degree + 2
        )
        return float(self.displacement(in_x.points.ravel()) @ in_x.weights.ravel())

    def velocity(self, v: Floats) -> Floats:
        """The density of the velocity, shape (n,)."""
        return np.asarray(
            self._across(v) @ np.einsum("eij,ei->j", self.p[0], self.form.x_mass.sum(axis=1))
        )

    def phase_plane(self, x: Floats, v: Floats) -> Floats:
        """The density of displacement and velocity, shape (n, m)."""
        return np.asarray(self._at(self.p[0], x) @ self._across(v).T)

    def voltage(self, voltage: Floats, terms: int | None = None) -> Floats:
        """The voltage density, shape (n,); that of the displacement if no load draws any charge.

        The modes of y determine E[V^n] for n below their number, but summed at a point they need
        not converge.  So a series of Gram and Charlier with these moments is used, of as many
        ``terms`` as there are modes or fewer.
        """
        if self.form.modes == 1:
            return self.displacement(voltage)
        spread = np.sqrt(value(MomentWeights(self.form).voltage_squared(), self._whole))
        grid = np.linspace(-WIDEST, WIDEST, 200 * int(WIDEST) + 1)
        modal = self._x.weights.ravel() @ self._in_voltage(grid * spread)
        scaled = voltage / spread
        seen_before = np.zeros_like(scaled)
        seen = np.exp(-0.5 * scaled**2) / np.sqrt(2.0 * np.pi)
        made_before = np.zeros_like(grid)
        made = np.ones_like(grid)
        total: Floats = np.zeros_like(scaled)
        for k in range(terms or self.form.modes):
            total += float(modal @ made) * (grid[1] - grid[0]) * seen
            later = _next_mode(scaled, k, seen_before, seen)
            seen_before = seen
            seen = later
            later = _next_mode(grid, k, made_before, made)
            made_before = made
            made = later
        return total

    def passages(self, level: float) -> float:
        """How often the displacement passes a level upwards, a unit of time."""
        return float(
            self._at(self.p[0], np.array([level]))[0]
            @ self.form.over_v(self.form.v_up)[: self.form.v_nodes]
        )

    def impacts(self, speeds: Floats, way: float = -1.0) -> Floats:
        """The impacts a unit of time and a unit of speed at the lower stop (``way`` -1) or the upper, shape (n,)."""
        wall = self.p[0, 0, 0] if way < 0.0 else self.p[0, -1, -1]
        return np.asarray(speeds * (self._across(way * speeds) @ wall))

    def _at(self, values: Floats, x: Floats) -> Floats:
        """Values on the nodes in x, shape (elements, nodes, ...) at some places, shape (n, ...)."""
        breaks, degree = self.form.mesh.x_breaks, self.form.mesh.degree
        element = np.clip(np.searchsorted(breaks, x, side="right") - 1, 0, len(breaks) - 2)
        left = breaks[element]
        right = breaks[element + 1]
        local = shape_values(degree, (2.0 * x - left - right) / (right - left))
        inside = (x >= breaks[0]) & (x <= breaks[-1])
        return np.asarray(np.einsum("pn,pn...->p...", local * inside[:, None], values[element]))

    def _across(self, v: Floats) -> Floats:
        breaks = self.form.mesh.v_breaks
        inside = (v >= breaks[0]) & (v <= breaks[-1])
        return np.asarray(evaluated(breaks, self.form.mesh.degree, v) * inside[:, None])

    def _in_voltage(self, voltage: Floats) -> Floats:
        """The sum of the modes at the Gauss points in x and some voltages, shape (m, n)."""
        frame = self.form.frame
        x = self._x.points.ravel()
        z = (((1.0 - frame.slope) * x - frame.offset)[:, None] - voltage) / frame.scale
        before = np.zeros_like(z)
        now = np.exp(-0.5 * z * z) / (np.sqrt(2.0 * np.pi) * frame.scale)
        total = np.zeros_like(z)
        for k, mode in enumerate(self.p @ self._over_v):
            total += self._at(mode, x)[:, None] * now
            later = _next_mode(z, k, before, now)
            before = now
            now = later
        return total
