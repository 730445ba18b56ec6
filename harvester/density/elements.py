"""One-dimensional elements: nodes, polynomials through them, and integrals of their products.

A line is cut at ``breaks`` into elements, each with the Gauss-Lobatto nodes of one degree.  A
function on the line is given by its values at the nodes; between them it is the polynomial through
those of its element.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from harvester.arrays import Floats


@cache
def lobatto_nodes(degree: int) -> Floats:
    """The degree + 1 Gauss-Lobatto nodes on [-1, 1]: the ends, and the extrema of the Legendre polynomial."""
    inner = np.polynomial.legendre.Legendre.basis(degree).deriv().roots()
    return np.concatenate([[-1.0], np.sort(inner.real), [1.0]])


@cache
def _barycentric_weights(degree: int) -> Floats:
    nodes = lobatto_nodes(degree)
    differences = nodes[:, None] - nodes
    np.fill_diagonal(differences, 1.0)
    return np.asarray(1.0 / differences.prod(axis=1))


def shape_values(degree: int, points: Floats) -> Floats:
    """The polynomials that are 1 at one node and 0 at all others, at points of [-1, 1]: shape (points, degree + 1)."""
    away = points[:, None] - lobatto_nodes(degree)
    hit: NDArray[np.bool_] = np.abs(away) < 1e-15
    terms = _barycentric_weights(degree) / np.where(hit, 1.0, away)
    at_node = np.any(hit, axis=1, keepdims=True)
    return np.asarray(np.where(at_node, hit, terms / terms.sum(axis=1, keepdims=True)))


@cache
def _derivative_matrix(degree: int) -> Floats:
    nodes, weights = lobatto_nodes(degree), _barycentric_weights(degree)
    away = nodes[:, None] - nodes
    np.fill_diagonal(away, 1.0)
    matrix: Floats = weights / weights[:, None] / away
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix


def shape_slopes(degree: int, points: Floats) -> Floats:
    """Derivatives of `shape_values` at points of [-1, 1]."""
    return np.asarray(shape_values(degree, points) @ _derivative_matrix(degree))


@dataclass(frozen=True)
class Quadrature:
    """Gauss points of every element of a line, exact for polynomials of degree 2 n - 1.

    ``points`` and ``weights`` have the shape (elements, n); ``values`` (n, nodes) and ``slopes``
    (elements, n, nodes) are those of the shape functions there.
    """

    points: Floats
    weights: Floats
    values: Floats
    slopes: Floats


def quadrature(breaks: Floats, degree: int, n: int) -> Quadrature:
    """The Gauss points of all elements between the breaks."""
    on_unit, weights = np.polynomial.legendre.leggauss(n)
    half = 0.5 * np.diff(breaks)
    points = breaks[:-1, None] + half[:, None] * (1.0 + on_unit)
    slopes = shape_slopes(degree, on_unit) / half[:, None, None]
    return Quadrature(points, weights * half[:, None], shape_values(degree, on_unit), slopes)


def products(weight: Floats, tests: Floats, trials: Floats) -> Floats:
    """Integrals of weight test trial over each element: shape (elements, nodes, nodes)."""
    matrix: Floats = np.swapaxes(np.broadcast_to(tests, (len(weight), *tests.shape[-2:])), 1, 2) @ (
        weight[:, :, None] * trials
    )
    return matrix


def evaluated(breaks: Floats, degree: int, points: Floats) -> Floats:
    """The values of all shape functions of a continuous line at some points: shape (points, nodes of the line)."""
    count = len(breaks) - 1
    element = np.clip(np.searchsorted(breaks, points, side="right") - 1, 0, count - 1)
    left = breaks[element]
    right = breaks[element + 1]
    local = shape_values(degree, (2.0 * points - left - right) / (right - left))
    values = np.zeros((len(points), count * degree + 1))
    columns = element[:, None] * degree + np.arange(degree + 1)
    np.put_along_axis(values, columns, local, axis=1)
    return values
