"""Densities of one or two quantities, and the rates at which levels are passed, from the density of `weak_form`.

Each passage of a level is a flux of the density: of a displacement a, of a voltage a (V' = v - mu V), and of impacts
that are harder than w, where a stop is at x = s,

    int_{v > 0} v p(a, v) dv,    int int_{v > mu a} (v - mu a) p(x, v, V = a) dx dv,    int_w^oo u p(s, -u) du

These are Rice's rates with the true density in place of a Gaussian one.
"""

import numpy as np

from harvester.arrays import Floats
from harvester.density.elements import evaluated, quadrature, shape_values
from harvester.density.weak_form import WeakForm


class Marginals:
    """What a density p on a form says of one or two quantities; places outside of its box have the density 0."""

    def __init__(self, form: WeakForm, p: Floats) -> None:
        self.form, self.p, mesh = form, p, form.mesh
        self._x = quadrature(mesh.x_breaks, mesh.degree, mesh.degree + 3)
        self._v = quadrature(mesh.v_breaks, mesh.degree, mesh.degree + 3)
        self._over_v = form.v_mass.sum(axis=0)

    def displacement(self, x: Floats) -> Floats:
        """The density of the displacement, shape (n,)."""
        return self._at(self.p[0] @ self._over_v, x)

    def share_below(self, x: float) -> float:
        """The probability of a displacement below x."""
        breaks = self.form.mesh.x_breaks
        along = quadrature(np.append(breaks[breaks < x], min(x, breaks[-1])), 1, self.form.mesh.degree + 2)
        return float(self.displacement(along.points.ravel()) @ along.weights.ravel())

    def velocity(self, v: Floats) -> Floats:
        """The density of the velocity, shape (n,)."""
        line = np.einsum("eij,ei->j", self.p[0], self.form.x_mass.sum(axis=1))
        found: Floats = self._across(v) @ line
        return found

    def phase_plane(self, x: Floats, v: Floats) -> Floats:
        """The density of displacement and velocity, shape (n, m)."""
        found: Floats = self._at(self.p[0], x) @ self._across(v).T
        return found

    def voltage(self, voltage: Floats) -> Floats:
        """The density of the voltage, shape (n,); that of the displacement where no load takes any charge."""
        if self.form.modes == 1:
            return self.displacement(voltage)
        weights = self._x.weights.ravel()
        found: Floats = self._in_voltage(self.p @ self._over_v, self._x.points.ravel(), voltage).T @ weights
        return found

    def with_voltage(self, x: Floats, voltage: Floats) -> Floats:
        """The density of displacement and voltage, shape (n, m)."""
        return self._in_voltage(self.p @ self._over_v, x, voltage)

    def passages(self, level: float) -> float:
        """How often the displacement passes a level upwards, a unit of time."""
        return float(self._at(self.p[0], np.array([level]))[0] @ self.form.v_up.sum(axis=0))

    def voltage_passages(self, level: float) -> float:
        """How often the voltage passes a level away from 0, a unit of time."""
        if self.form.modes == 1:
            return self.passages(level)
        way, speed = np.sign(level), self._v.points - self.form.mu * level
        upwards = self._v.weights * np.maximum(way * speed, 0.0)
        line, degree = np.zeros(self.form.shape[3]), self.form.mesh.degree
        for e, part in enumerate(upwards @ self._v.values):
            line[e * degree : (e + 1) * degree + 1] += part
        weights = self._x.weights.ravel()
        return float(self._in_voltage(self.p @ line, self._x.points.ravel(), np.array([level]))[:, 0] @ weights)

    def impacts(self, speeds: Floats, way: float = -1.0) -> Floats:
        """The impacts a unit of time and a unit of speed at the lower stop (``way`` -1) or the upper, shape (n,)."""
        wall = self.p[0, 0, 0] if way < 0.0 else self.p[0, -1, -1]
        found: Floats = speeds * (self._across(way * speeds) @ wall)
        return found

    def harder(self, speed: float, way: float = -1.0) -> float:
        """The impacts a unit of time that are harder than a speed."""
        breaks = self.form.mesh.v_breaks
        ends = np.concatenate([[speed], breaks[breaks > speed]])
        if len(ends) < 2:
            return 0.0
        along = quadrature(ends, 1, self.form.mesh.degree + 2)
        return float(self.impacts(along.points.ravel(), way) @ along.weights.ravel())

    def _at(self, values: Floats, x: Floats) -> Floats:
        """Values on the nodes in x, shape (elements, nodes, ...) at some places, shape (n, ...)."""
        breaks, degree = self.form.mesh.x_breaks, self.form.mesh.degree
        element = np.clip(np.searchsorted(breaks, x, side="right") - 1, 0, len(breaks) - 2)
        left, right = breaks[element], breaks[element + 1]
        local = shape_values(degree, (2.0 * x - left - right) / (right - left))
        inside = (x >= breaks[0]) & (x <= breaks[-1])
        found: Floats = np.einsum("pn,pn...->p...", local * inside[:, None], values[element])
        return found

    def _across(self, v: Floats) -> Floats:
        breaks = self.form.mesh.v_breaks
        inside = (v >= breaks[0]) & (v <= breaks[-1])
        found: Floats = evaluated(breaks, self.form.mesh.degree, v) * inside[:, None]
        return found

    def _in_voltage(self, modes: Floats, x: Floats, voltage: Floats) -> Floats:
        """The density of modes in x, shape (modes, elements, nodes), at places and voltages, shape (n, m)."""
        frame, at = self.form.frame, [self._at(one, x) for one in modes]
        z = (((1.0 - frame.slope) * x - frame.offset)[:, None] - voltage) / frame.scale
        before, now = np.zeros_like(z), np.exp(-0.5 * z * z) / (np.sqrt(2.0 * np.pi) * frame.scale)
        total = np.zeros_like(z)
        for k, one in enumerate(at):
            total += one[:, None] * now
            before, now = now, (z * now - np.sqrt(k) * before) / np.sqrt(k + 1.0)
        return total
