"""A polynomial fitted to the powers of a design in a small box, its highest place, and how well that is known.

The coefficients are linear in the powers, c = L P, so their covariance is L C L' with C that of the
powers.  With the same noise at every point of a design most of the error is common to all of it: C,
measured trajectory by trajectory, knows that, and the error of a difference is small.  The part
that the polynomial leaves of the powers beyond their noise, s^2 = |P - X c|^2/(m - k) less its
expectation, counts as further noise of each: it is the shape that no such polynomial has.

If the gradient vanishes, its error moves the place by -H^-1 times it (delta method): Cov(x) =
H^-1 G L C L' G' H^-1.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.studies.tolerance.surface import exponents
from harvester.uncertainty.value import half95

Flags = np.ndarray[Any, np.dtype[np.bool_]]

QUADRATIC, CUBIC = 2, 3
SEEN = 3.0  # standard errors that a curvature must have to be one
_EDGE = 1e-6  # of the box: nearer to its face than this is on it


def design_size(dimensions: int) -> int:
    """The number of points of a design: twice the coefficients of a cubic, and one."""
    return 2 * len(exponents(dimensions, CUBIC)) + 1


@dataclass(frozen=True)
class Fit:
    """A polynomial over places ``x`` (m, keys), within -1 to 1, through powers (m,) with ``covariance`` (m, m).

    ``low`` and ``high`` are the ends of the box within the ranges; ``walls`` (2, keys) names which
    are ends of a range.
    """

    x: Floats
    power: Floats
    covariance: Floats
    low: Floats
    high: Floats
    walls: Floats
    degree: int = CUBIC

    @cached_property
    def _exponents(self) -> Floats:
        return exponents(self.x.shape[1], self.degree)

    @cached_property
    def _solver(self) -> Floats:
        """The matrix L that makes coefficients of powers, shape (k, m)."""
        return np.asarray(np.linalg.pinv(self._rows(self.x)), dtype=np.float64)

    @cached_property
    def coefficients(self) -> Floats:
        """The coefficients c, shape (k,)."""
        return np.asarray(self._solver @ self.power)

    @cached_property
    def misfit(self) -> float:
        """The misfit s^2: the variance of the powers about the polynomial beyond their noise."""
        matrix = self._rows(self.x)
        rest = np.eye(len(self.x)) - matrix @ self._solver
        dof = len(self.x) - matrix.shape[1]
        residual: Floats = rest @ self.power
        expected = float(np.trace(rest @ self.covariance @ rest.T))
        return max((float(np.sum(residual**2)) - expected) / float(dof), 0.0)

    @cached_property
    def _covariance(self) -> Floats:
        """The covariance of the coefficients, shape (k, k)."""
        return self._sampling + self.misfit * np.asarray(self._solver @ self._solver.T)

    @cached_property
    def _sampling(self) -> Floats:
        """The part of the coefficients' covariance that is noise."""
        return np.asarray(self._solver @ self.covariance @ self._solver.T)

    @cached_property
    def misfit_dominates(self) -> bool:
        """Whether the misfit makes the gradient more uncertain than the noise does."""
        rows = self._gradient_rows(self.best)
        noise = float(np.trace(rows @ self._sampling @ rows.T))
        return float(np.trace(rows @ self._covariance @ rows.T)) > 2.0 * noise

    def _rows(self, x: Floats, orders: tuple[int, ...] = ()) -> Floats:
        """The monomials at places x (n, keys), or their derivative by the keys in ``orders``.

        Shape (n, k).
        """
        powers = self._exponents.copy()
        factor = np.ones(len(self._exponents))
        for k in orders:
            factor = factor * powers[:, k]
            powers[:, k] = np.maximum(powers[:, k] - 1.0, 0.0)
        return np.asarray(factor * np.prod(x[:, None, :] ** powers[None], axis=2))

    def _gradient_rows(self, x: Floats) -> Floats:
        return np.vstack([self._rows(x[None], (k,)) for k in range(len(x))])

    @cached_property
    def best(self) -> Floats:
        """The highest place in the box."""
        from scipy.optimize import minimize

        starts = [
            self.x[int(np.argmax(self.power))],
            np.clip(np.zeros(len(self.low)), self.low, self.high),
        ]
        scale = max(float(np.ptp(self.power)), 1e-300)

        def down(x: Floats) -> tuple[float, Floats]:
            return -self.value(x)[0] / scale, -(self._gradient_rows(x) @ self.coefficients) / scale

        results = [
            minimize(
                down,
                start,
                jac=True,
                method="L-BFGS-B",
                bounds=list(zip(self.low, self.high, strict=True)),
            )
            for start in starts
        ]
        return np.asarray(min(results, key=lambda result: float(result.fun)).x)

    def value(self, x: Floats) -> tuple[float, float]:
        """The power at a place, and its standard error."""
        row = self._rows(x[None])[0]
        return float(row @ self.coefficients), float(
            np.sqrt(max(row @ self._covariance @ row, 0.0))
        )

    @cached_property
    def faces(self) -> Floats:
        """The face that the highest place lies on, for each key: -1 the lower, 1 the upper, 0 none."""
        size = _EDGE * (self.high - self.low)
        return np.where(
            self.best <= self.low + size, -1.0, np.where(self.best >= self.high - size, 1.0, 0.0)
        )

    @property
    def exits(self) -> Floats:
        """The `faces` that are not ends of the range, so that the power is higher yet outside the box."""
        wall = np.where(self.faces < 0.0, self.walls[0], self.walls[1])
        return np.where(wall, 0.0, self.faces)

    @cached_property
    def hessian(self) -> Floats:
        """The second derivatives at the highest place, shape (keys, keys)."""
        n = len(self.best)
        rows = [[self._rows(self.best[None], (i, j))[0] for j in range(n)] for i in range(n)]
        return np.asarray(np.array(rows) @ self.coefficients)

    @property
    def on_face(self) -> Flags:
        """The keys whose highest place is on a face, so that the gradient need not vanish."""
        return np.asarray(self.faces != 0.0)

    @cached_property
    def surely_on_face(self) -> Flags:
        """The keys on a face beyond doubt: the power grows towards the face, at 95 %."""
        rows = self._gradient_rows(self.best)
        error = np.sqrt(np.maximum(np.diag(rows @ self._covariance @ rows.T), 0.0))
        return np.asarray(self.on_face & (self.faces * (rows @ self.coefficients) > half95(error)))

    @cached_property
    def resolution(self) -> float:
        """The weakest curvature over its standard error, of the keys that are on no face.

        Infinite if all are.
        """
        free = np.flatnonzero(~self.on_face)
        if len(free) == 0:
            return np.inf
        weakest, vectors = np.linalg.eigh(-self.hessian[np.ix_(free, free)])
        direction = np.zeros(len(self.best))
        direction[free] = vectors[:, 0]
        n = len(direction)
        row = sum(
            direction[i] * direction[j] * self._rows(self.best[None], (i, j))[0]
            for i in range(n)
            for j in range(n)
        )
        error = float(np.sqrt(max(row @ self._covariance @ row, 0.0)))
        return float(weakest[0]) / error if error > 0.0 else float(np.sign(weakest[0])) * np.inf

    @cached_property
    def half_widths(self) -> Floats:
        """The half-widths of the 95 % interval of the highest place, shape (keys,).

        For keys on a face as `_reach`.

        Wider by 1/(1 - (Q/z)^2), as Fieller's interval is, for a curvature of z standard errors (Q:
        the 95 % quantile).
        """
        free = np.flatnonzero(~self.on_face)
        half = self._reach.copy()
        if len(free):
            rows = self._gradient_rows(self.best)[free]
            inverse = np.linalg.inv(self.hessian[np.ix_(free, free)])
            error = np.sqrt(np.diag(inverse @ rows @ self._covariance @ rows.T @ inverse.T))
            half[free] = half95(error) / max(1.0 - (half95(1.0) / self.resolution) ** 2, 1e-3)
        return half

    @cached_property
    def _reach(self) -> Floats:
        """How far inwards the power is not lower beyond doubt, for keys on a face that are not `surely_on_face`."""
        reach = np.zeros(len(self.best))
        for k in np.flatnonzero(self.on_face & ~self.surely_on_face):
            steps = np.linspace(0.0, self.high[k] - self.low[k], 65)
            points = np.repeat(self.best[None], len(steps), axis=0)
            points[:, k] -= self.faces[k] * steps
            rows = self._rows(self.best[None]) - self._rows(points)
            error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, self._covariance, rows), 0.0))
            reach[k] = steps[rows @ self.coefficients <= half95(error)].max()
        return reach

    @property
    def flat(self) -> bool:
        """Whether no place in the box is seen to be better than another."""
        if not self.on_face.all():
            return self.resolution < SEEN
        return bool(np.all(self._reach >= self.high - self.low))

    @property
    def power_lost(self) -> float:
        """The power that is lost at the ends of the interval, the most of all keys that are on no face."""
        return 0.5 * float(
            np.max(np.where(self.on_face, 0.0, np.abs(np.diag(self.hessian)) * self.half_widths**2))
        )

    def bias_shift(self, bias: Floats) -> Floats:
        """How far a bias of the powers (m,), its sign unknown, moves the highest place.

        Shape (keys,).
        """
        free = np.flatnonzero(~self.on_face)
        shift = np.zeros(len(self.best))
        if len(free):
            gradient = self._gradient_rows(self.best)[free] @ self._solver @ bias
            shift[free] = np.abs(np.linalg.solve(self.hessian[np.ix_(free, free)], gradient))
        return shift
