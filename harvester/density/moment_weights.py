"""MomentWeights of a density: those of x and v are integrals of the first mode, those with V need three modes."""

import numpy as np

from harvester.arrays import Floats
from harvester.density.weak_form import WeakForm


class MomentWeights:
    """Linear functionals of the density of `weak_form`, as weights of the same shape."""

    def __init__(self, form: WeakForm) -> None:
        self.form = form
        mesh = form.mesh
        in_x = mesh.in_x
        in_v = mesh.in_v
        self._x = [
            np.einsum("eq,qi->ei", in_x.weights * in_x.points**n, in_x.values) for n in range(3)
        ]
        self._v = []
        self._across = in_v
        for n in range(3):
            self._v.append(self._integrated(in_v.points**n))

    def _integrated(self, weight: Floats) -> Floats:
        """The integrals of a weight times each shape function in v, and over coloured noise."""
        degree = self.form.mesh.degree
        whole = np.zeros(self.form.shape[3])
        for e, part in enumerate((self._across.weights * weight) @ self._across.values):
            whole[e * degree : (e + 1) * degree + 1] += part
        return whole

    def speed_cubed(self, way: float) -> Floats:
        """The weights of the integral of |v|^3 over the velocities of one sign, on the nodes in v."""
        cubes: Floats = np.maximum(way * self._across.points, 0.0) ** 3
        return self._integrated(cubes)

    def of(self, x: int, v: int, mode: int = 0) -> Floats:
        """The weights of the integral of x^x v^v p_mode."""
        weights = np.zeros(self.form.shape)
        if mode < self.form.modes:
            weights[mode] = self._x[x][:, :, None] * self._v[v]
        return weights

    def mean(self, x: int = 0, v: int = 0, y: int = 0) -> Floats:
        """The weights of E[x^x v^v y^y], y at most 2."""
        frame = self.form.frame
        a = frame.slope
        m = frame.offset
        s = frame.scale
        if self.form.modes == 1:
            assert y == 0, "y is not known"
        if y == 0:
            return self.of(x, v)
        if y == 1:
            return a * self.of(x + 1, v) + m * self.of(x, v) + s * self.of(x, v, 1)
        squares = (
            a * a * self.of(x + 2, v) + 2.0 * a * m * self.of(x + 1, v) + m * m * self.of(x, v)
        )
        mixed = 2.0 * s * (a * self.of(x + 1, v, 1) + m * self.of(x, v, 1))
        return np.asarray(
            squares + mixed + s * s * (self.of(x, v) + np.sqrt(2.0) * self.of(x, v, 2))
        )

    def voltage_squared(self) -> Floats:
        """The weights of E[V^2], V = x - y.

        Those of E[x^2] if no load lets the voltage leave the displacement.
        """
        if self.form.modes == 1:
            return self.of(2, 0)
        return self.of(2, 0) - 2.0 * self.mean(1, 0, 1) + self.mean(0, 0, 2)


def value(weights: Floats, p: Floats) -> float:
    """A functional of a density."""
    return float(np.vdot(weights, p))
