"""A cubic fitted to the powers of a design in a small box, its highest place, and how well that is known.

The coefficients are linear in the powers, c = L P, so their covariance is L C L' with C that of the powers.  With the
same noise at every point of a design most of the error is common to all of it: C, measured trajectory by trajectory,
knows that, and the error of a difference is small.  What the cubic leaves of the powers beyond their noise, s^2 =
|P - X c|^2/(m - k) less its expectation, counts as further noise of each: it is the shape that no cubic has.

Where the gradient vanishes, its error moves the place by -H^-1 times it (delta method): Cov(x) = H^-1 G L C L' G' H^-1.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harvester.arrays import Floats

DEGREE = 3
_EDGE = 1e-6  # of the box: nearer to its face than this is on it


def exponents(dimensions: int) -> Floats:
    """Of the monomials up to `DEGREE`, shape (k, dimensions)."""
    rows = [
        np.bincount(np.array(one, dtype=int), minlength=dimensions)
        for degree in range(DEGREE + 1)
        for one in itertools.combinations_with_replacement(range(dimensions), degree)
    ]
    return np.array(rows, dtype=float)


def design_size(dimensions: int) -> int:
    """Points of a design: twice the coefficients, and a middle."""
    return 2 * len(exponents(dimensions)) + 1


@dataclass(frozen=True)
class Fit:
    """The cubic over ``x`` (m, keys), within -1 to 1, from powers (m,) with ``covariance`` (m, m).

    ``low`` and ``high`` are the ends of the box within the ranges; ``walls`` (2, keys) says which are ends of a range.
    """

    x: Floats
    power: Floats
    covariance: Floats
    low: Floats
    high: Floats
    walls: Floats

    @cached_property
    def _exponents(self) -> Floats:
        return exponents(self.x.shape[1])

    @cached_property
    def _solver(self) -> Floats:
        """L, shape (k, m)."""
        return np.linalg.pinv(self._rows(self.x))

    @cached_property
    def coefficients(self) -> Floats:
        """c, shape (k,)."""
        return np.asarray(self._solver @ self.power)

    @cached_property
    def misfit(self) -> float:
        """s^2: variance of the powers about the cubic beyond their noise."""
        matrix = self._rows(self.x)
        rest = np.eye(len(self.x)) - matrix @ self._solver
        freedom = len(self.x) - matrix.shape[1]
        residual = rest @ self.power
        expected = float(np.trace(rest @ self.covariance @ rest.T))
        return max((float(residual @ residual) - expected) / freedom, 0.0)

    @cached_property
    def _covariance(self) -> Floats:
        """Of the coefficients, shape (k, k)."""
        whole = self.covariance + self.misfit * np.eye(len(self.x))
        return np.asarray(self._solver @ whole @ self._solver.T)

    def _rows(self, x: Floats, orders: tuple[int, ...] = ()) -> Floats:
        """The monomials at places x (n, keys), or their derivative by the keys in ``orders``; shape (n, k)."""
        powers, factor = self._exponents.copy(), np.ones(len(self._exponents))
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

        starts = [self.x[int(np.argmax(self.power))], np.clip(np.zeros(len(self.low)), self.low, self.high)]
        scale = max(float(np.ptp(self.power)), 1e-300)

        def down(x: Floats) -> tuple[float, Floats]:
            return -self.value(x)[0] / scale, -(self._gradient_rows(x) @ self.coefficients) / scale

        found = [
            minimize(down, start, jac=True, method="L-BFGS-B", bounds=list(zip(self.low, self.high, strict=True)))
            for start in starts
        ]
        return np.asarray(min(found, key=lambda one: float(one.fun)).x)

    def value(self, x: Floats) -> tuple[float, float]:
        """The power at a place, and its standard error."""
        row = self._rows(x[None])[0]
        return float(row @ self.coefficients), float(np.sqrt(max(row @ self._covariance @ row, 0.0)))

    @cached_property
    def faces(self) -> Floats:
        """Of each key -1, 0 or 1: the highest place lies on the lower face, inside, on the upper face."""
        size = _EDGE * (self.high - self.low)
        return np.where(self.best <= self.low + size, -1.0, np.where(self.best >= self.high - size, 1.0, 0.0))

    @property
    def leaves(self) -> Floats:
        """The `faces` that are no ends of the range: it is higher yet outside."""
        wall = np.where(self.faces < 0.0, self.walls[0], self.walls[1])
        return np.where(wall, 0.0, self.faces)

    @cached_property
    def hessian(self) -> Floats:
        """At the highest place, shape (keys, keys)."""
        n = len(self.best)
        rows = [[self._rows(self.best[None], (i, j))[0] for j in range(n)] for i in range(n)]
        return np.asarray(np.array(rows) @ self.coefficients)

    @cached_property
    def pressed(self) -> Floats:
        """Keys whose best value is an end of their range beyond doubt: the power still grows there, at 95 %."""
        rows = self._gradient_rows(self.best)
        gradient = rows @ self.coefficients
        error = np.sqrt(np.maximum(np.diag(rows @ self._covariance @ rows.T), 0.0))
        return np.asarray((self.faces * gradient > 1.96 * error) & (self.faces != 0.0))

    @cached_property
    def resolution(self) -> float:
        """The weakest curvature over its standard error, without the keys that are `pressed`; infinite if all are."""
        free = np.flatnonzero(~self.pressed)
        if len(free) == 0:
            return np.inf
        weakest, vectors = np.linalg.eigh(-self.hessian[np.ix_(free, free)])
        direction = np.zeros(len(self.best))
        direction[free] = vectors[:, 0]
        n = len(direction)
        row = sum(
            direction[i] * direction[j] * self._rows(self.best[None], (i, j))[0] for i in range(n) for j in range(n)
        )
        error = float(np.sqrt(max(row @ self._covariance @ row, 0.0)))
        return float(weakest[0]) / error if error > 0.0 else float(np.sign(weakest[0])) * np.inf

    def place_covariance(self) -> Floats:
        """Of the highest place, shape (keys, keys); keys that are `pressed` have none."""
        n, free = len(self.best), np.flatnonzero(~self.pressed)
        whole = np.zeros((n, n))
        if len(free):
            rows = self._gradient_rows(self.best)[free]
            inverse = np.linalg.inv(self.hessian[np.ix_(free, free)])
            whole[np.ix_(free, free)] = inverse @ rows @ self._covariance @ rows.T @ inverse.T
        return whole

    def shift(self, bias: Floats) -> Floats:
        """How far a bias of the powers (m,), its sign unknown, moves the highest place; shape (keys,)."""
        n, free = len(self.best), np.flatnonzero(~self.pressed)
        moved = np.zeros(n)
        if len(free):
            gradient = self._gradient_rows(self.best)[free] @ self._solver @ bias
            moved[free] = np.abs(np.linalg.solve(self.hessian[np.ix_(free, free)], gradient))
        return moved
