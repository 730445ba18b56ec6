"""A polynomial through the samples, which states how much of their scatter it does not explain.

    y(x) ~ sum_k c_k prod_j P_{e_kj}(x_j),   sum_j e_kj <= degree,

with Legendre's polynomials P of the keys, each scaled to -1 to 1 over its samples.  Least squares
give c; the degree is the one whose errors of leaving one sample out are smallest.  Such an error is
r/(1 - h) with the residual r and the leverage h of the sample, the diagonal of the projection;
their mean square over the variance of y is ``unexplained`` (1 - Q^2, Blatman and Sudret, J. Comput.
Phys. 230, 2011).
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from harvester.arrays import Floats
from harvester.errors import SimulationError

HIGHEST = 10  # degree
PER_TERM = 2.0  # samples that a coefficient needs
MOST_TERMS = 600
ENOUGH = 1e-8  # of the variance unexplained
PATIENCE = 2
_SINGULAR = 1e-10


def exponents(dimensions: int, most: int) -> Floats:
    """The exponents of the monomials up to a degree, shape (k, dimensions)."""
    rows = [
        np.bincount(np.array(factors, dtype=int), minlength=dimensions)
        for degree in range(most + 1)
        for factors in itertools.combinations_with_replacement(range(dimensions), degree)
    ]
    return np.array(rows, dtype=float)


@dataclass(frozen=True)
class Polynomial:
    """A polynomial through values y, shape (n,), at the keys' values x, shape (n, keys).

    ``scatter`` is the standard deviation of its prediction by the others, in the unit
    of y, and ``unexplained`` the fraction of the variance of y that this is; ``factor``, shape
    (terms, kept), is that of the coefficients' covariance over the variance of noise in y.
    """

    middle: Floats
    half: Floats
    powers: Floats
    coefficients: Floats
    scatter: float
    unexplained: float
    factor: Floats

    def __call__(self, x: Floats) -> Floats:
        """The values at keys' values, shape (m, keys).

        Those beyond the samples count as at their edge.
        """
        return np.asarray(self._terms(x) @ self.coefficients)

    def leverage(self, x: Floats) -> Floats:
        """The variance of the polynomial over that of independent noise in y, at keys' values (m, keys): shape (m,)."""
        return np.asarray(((self._terms(x) @ self.factor) ** 2).sum(axis=1))

    def change_beyond(self, x: Floats) -> Floats:
        """The distance of the polynomial from its edge, at keys' values (m, keys).

        0 within the samples.
        """
        free = _basis((x - self.middle) / self.half, self.powers) @ self.coefficients
        return np.asarray(np.abs(free - self(x)))

    def _terms(self, x: Floats) -> Floats:
        return _basis(np.clip((x - self.middle) / self.half, -1.0, 1.0), self.powers)


def fit(x: Floats, y: Floats, scored: int | None = None) -> Polynomial:
    """The surface through values y, shape (n,), at x, shape (n, keys), of the degree that predicts best.

    The first ``scored`` samples (None: all) report how well; those behind them only hold the outer
    places of the keys.

    Raises SimulationError for fewer samples than a plane needs.
    """
    count, keys = x.shape
    if count < PER_TERM * (keys + 1):
        raise SimulationError(
            f"there are too few samples with an answer for a response surface: {count}"
        )
    middle = 0.5 * (x.max(axis=0) + x.min(axis=0))
    half = 0.5 * np.ptp(x, axis=0)
    half = np.where(half > 0.0, half, 1.0)
    scaled = (x - middle) / half
    variance = float(y[:scored].var())
    best: Polynomial | None = None
    worse = 0  # degrees in a row that predict no better: of an even function every other does
    for degree in range(1, HIGHEST + 1):
        powers = exponents(keys, degree)
        if len(powers) > MOST_TERMS or PER_TERM * len(powers) > count:
            break
        left, sizes, right = np.linalg.svd(_basis(scaled, powers), full_matrices=False)
        # of a key with few values, high powers are no new functions
        kept = sizes > _SINGULAR * sizes[0]
        left = left[:, kept]
        sizes = sizes[kept]
        right = right[kept]
        coefficients = right.T @ ((left.T @ y) / sizes)
        leverage = np.minimum((left**2).sum(axis=1), 1.0 - 1e-9)
        errors = (y - left @ (left.T @ y)) / (1.0 - leverage)
        scatter = float(np.sqrt(np.mean(errors[:scored] ** 2)))
        if best is None or scatter < 0.99 * best.scatter:
            unexplained = min(scatter**2 / variance, 1.0) if variance > 0.0 else 0.0
            factor = right.T / sizes
            best = Polynomial(
                middle=middle,
                half=half,
                powers=powers,
                coefficients=coefficients,
                scatter=scatter,
                unexplained=unexplained,
                factor=factor,
            )
            worse = 0
        else:
            worse += 1
        if best.unexplained < ENOUGH or worse == PATIENCE:
            break
    assert best is not None, "a plane was tried"
    return best


def _basis(scaled: Floats, powers: Floats) -> Floats:
    """The products of Legendre's polynomials, shape (n, terms)."""
    degree = int(powers.max())
    each = legendre.legvander(scaled, degree)  # (n, keys, degree + 1)
    products = np.ones((len(scaled), len(powers)))
    for key in range(scaled.shape[1]):
        products *= each[:, key, powers[:, key].astype(int)]
    return products
