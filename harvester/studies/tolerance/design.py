"""Which devices are computed: quasi-random samples of all spreads at once, and each key alone at its ends.

Places are Sobol's scrambled sequence in the unit cube, which fills it more evenly than random ones.
Correlated keys are tied by a Gaussian copula: the places become normal numbers, get the
correlation matrix C = L L^T by the factor L, and become places again,

    u' = Phi(L Phi^-1(u)),

so that each key keeps its own distribution.  A correlation is that of the normal numbers behind the
keys; for uniform spreads it is within 0.02 of their own.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown, unknown
from harvester.scene.keys import full_key
from harvester.studies.sweep.points import Axis, Points
from harvester.studies.tolerance.spreads import PartSpread

LEAST, MOST = 16, 50_000  # samples
INSIDE = 1e-12  # how near to 0 and 1 a place may come: a normal number has no end
LOW, HIGH = 0.05, 0.95  # the places at which a key is shown alone
POINTS_ALONE = 200  # places of a key alone
OUTER = 0.0005  # fraction of devices below, and above, the outer places that hold a polynomial


def sobol_points(count: int, dimensions: int, seed: int) -> Floats:
    """The first ``count`` places of Sobol's scrambled sequence in the unit cube, shape (count, dimensions)."""
    from scipy.stats import qmc  # which takes a second to load

    sequence = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
    u = sequence.random_base2(max(count - 1, 1).bit_length())[:count]
    return np.asarray(np.clip(u, INSIDE, 1.0 - INSIDE))


def correlation(
    given: Sequence[str] | Mapping[tuple[str, str], float], keys: Sequence[str]
) -> Floats | None:
    """The matrix of correlations that texts ``A,B=0.7`` or pairs describe, shape (n, n).

    None if absent.

    Raises InputError for a text of another form, a key that is not varied, a number outside -1 to
    1, and correlations that cannot be true together.
    """
    pairs = dict(given) if isinstance(given, Mapping) else dict(_pair(text) for text in given)
    if not pairs:
        return None
    matrix = np.eye(len(keys))
    for pair, value in pairs.items():
        first, second = map(full_key, pair)
        for key in (first, second):
            if key not in keys:
                raise unknown("varied key of `correlate`", key, keys)
        if first == second:
            raise InputError(f"`correlate` must name two different keys, but names {first!r} twice")
        if not -1.0 < value < 1.0:
            raise invalid(f"the correlation of {first} and {second}", "be between -1 and 1", value)
        a, b = keys.index(first), keys.index(second)
        matrix[a, b] = matrix[b, a] = value
    if np.linalg.eigvalsh(matrix).min() <= 1e-9:
        raise InputError(
            "`correlate` must give correlations that can be true together, but these cannot"
        )
    return matrix


def _pair(text: str) -> tuple[tuple[str, str], float]:
    names, equals, value = text.partition("=")
    keys = [name.strip() for name in names.split(",")]
    try:
        if not equals or len(keys) != 2:
            raise ValueError
        return (keys[0], keys[1]), float(value)
    except ValueError:
        raise InputError(
            f"`correlate` must be KEY,KEY=NUMBER, such as piezo.coupling,piezo.capacitance=0.7, but is {shown(text)}"
        ) from None


def tied(u: Floats, matrix: Floats | None) -> Floats:
    """Places with the correlations of a matrix, shape as ``u``; as they are if it is None."""
    if matrix is None:
        return u
    from scipy.special import ndtr, ndtri

    return np.asarray(ndtr(ndtri(u) @ np.linalg.cholesky(matrix).T))


def values_at(spreads: Sequence[PartSpread], u: Floats) -> Floats:
    """The values of the keys at places, both of shape (n, keys)."""
    return np.stack([spread.at(u[:, k]) for k, spread in enumerate(spreads)], axis=1)


def one_by_one(dimensions: int) -> Floats:
    """The middle, then each key alone at `LOW` and at `HIGH`, shape (1 + 2 dimensions, dimensions)."""
    u = np.full((1 + 2 * dimensions, dimensions), 0.5)
    for k in range(dimensions):
        u[1 + 2 * k, k], u[2 + 2 * k, k] = LOW, HIGH
    return u


def one_alone(key: int, dimensions: int) -> Floats:
    """Places of one key evenly over its spread, with the others in the middle, shape (`POINTS_ALONE`, dimensions)."""
    u = np.full((POINTS_ALONE, dimensions), 0.5)
    u[:, key] = (np.arange(POINTS_ALONE) + 0.5) / POINTS_ALONE
    return u


def outer(dimensions: int, matrix: Floats | None = None) -> Floats:
    """The places at which a key alone is at `OUTER` and at 1 - `OUTER`, shape (2 dimensions, dimensions).

    Keys that are tied to it are at their mean there.  With them a polynomial need not reach beyond
    the computed places.
    """
    from scipy.special import ndtr, ndtri

    shift = float(ndtri(1.0 - OUTER)) * (np.eye(dimensions) if matrix is None else matrix)
    return np.asarray(ndtr(np.vstack([-shift, shift])))


def points(spreads: Sequence[PartSpread], values: Floats) -> Points:
    """The list of points of a sweep that has these values of the keys."""
    axes = (Axis(spread.key, tuple(map(float, values[:, k]))) for k, spread in enumerate(spreads))
    return Points(tuple(axes), listed=True, argument="`vary`")
