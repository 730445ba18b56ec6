"""Gauss's elimination for one pattern of a matrix, as straight lines of Python without a zero in them.

The pivots are chosen once, for samples of the matrix as Newton's iterations meet it: where
derivatives are zero, and where they are large.  Among pivots that are safe in all samples that with
the fewest products is first (Markowitz). The lines test their pivots; if one fails,
elimination with pivots of the matrix at hand follows.

Source: Duff, Erisman, Reid, Direct Methods for Sparse Matrices, 2nd ed. 2017, chapter 7.
"""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from harvester.arrays import Bools, Floats
from harvester.netlists.part import UnservedError

# of the largest coefficient of its column, in each sample: the least pivot that is taken
SAFE = 1e-6


def pivots(samples: Floats, pattern: Bools) -> list[tuple[int, int]]:
    """The places of the pivots, row and column, in their order.

    ``samples``, shape (samples, n, n), have rows of like size; ``pattern``, shape (n, n), is where
    any is not zero.

    Raises UnservedError if no entry is left for a pivot, so that there is not one solution.
    """
    left, pattern = samples.copy(), pattern.copy()
    rows, columns = list(range(len(pattern))), list(range(len(pattern)))
    order = list[tuple[int, int]]()
    while rows:
        part = np.abs(left[:, rows][:, :, columns])
        near = pattern[np.ix_(rows, columns)]
        largest = part.max(axis=1, keepdims=True)
        share = (part / np.where(largest > 0.0, largest, 1.0)).min(axis=0) * near
        products = np.outer(near.sum(axis=1) - 1.0, near.sum(axis=0) - 1.0)
        off = 0.5 * np.not_equal.outer(rows, columns)  # among equals that of a node's own equation
        if not near.any():
            raise UnservedError(
                "the netlist has no single solution: give inductors that are side by side a "
                "coupling other than 1, or a resistor in series"
            )
        enough = near & (share >= min(SAFE, float(share.max())))
        cost = np.where(enough, products + off, np.inf)
        i, j = np.unravel_index(int(cost.argmin()), cost.shape)
        row, column = rows.pop(int(i)), columns.pop(int(j))
        order.append((row, column))
        with np.errstate(divide="ignore", invalid="ignore"):
            factors = left[:, rows, column] / left[:, row, column][:, None]
        factors[~np.isfinite(factors)] = 0.0
        left[np.ix_(range(len(left)), rows, columns)] -= (
            factors[:, :, None] * left[:, row, columns][:, None, :]
        )
        pattern[np.ix_(rows, columns)] |= np.outer(pattern[rows, column], pattern[row, columns])
    return order


def largest_factors(
    voltages: Sequence[bool], largest: float, impedance: float
) -> list[list[float]]:
    """The largest factors, by the equations that are subtracted from and that are subtracted, shape (n, n).

    From an equation of ``voltages`` currents are subtracted with factors of the size of an
    impedance, and the other way round.
    """
    sizes = {0: largest, 1: largest * impedance, -1: largest / impedance}
    return [[sizes[a - b] for b in voltages] for a in voltages]


def terms_of(weights: Mapping[int, float]) -> list[float]:
    """A sum on a tape: the number of its terms, and their places and weights."""
    return [float(len(weights)), *itertools.chain(*weights.items())]


def joined(sizes: Sequence[int], parts: Sequence[Sequence[float]]) -> list[float]:
    """A tape: its length, the sizes, the places of its parts, and these."""
    lengths = [len(part) for part in parts]
    *begins, length = itertools.accumulate(lengths, initial=1 + len(sizes) + len(parts))
    return [*map(float, (length, *sizes, *begins)), *itertools.chain.from_iterable(parts)]


def tape_of(
    order: list[tuple[int, int]], pattern: Bools, limits: Sequence[Sequence[float]]
) -> tuple[list[float], list[float]]:
    """The lines of `lines_of` as numbers: those of the elimination, and those of the solution after it.

    For each pivot its row, its place in the matrix, and the number of rows from which it is
    subtracted; for each of these the row, the place of its entry, its limit, the number of entries,
    and of each the places in both rows.  Then for each pivot, the last one first, its row and
    column, and the places of the other entries with their columns.
    """
    n = len(pattern)
    filled = pattern.copy()
    forth, back = list[float](), list[float]()
    for k, (row, column) in enumerate(order):
        later = order[k + 1 :]
        columns = [j for _, j in later if filled[row, j]]
        others = [i for i, _ in later if filled[i, column]]
        forth += [row, row * n + column, len(others)]
        for other in others:
            forth += [other, other * n + column, limits[other][row], len(columns)]
            for j in columns:
                forth += [other * n + j, row * n + j]
                filled[other, j] = True
        known = itertools.chain.from_iterable((row * n + j, j) for j in columns)
        back = [row, column, len(columns), *known, *back]
    return forth, back


def lines_of(
    order: list[tuple[int, int]], pattern: Bools, limits: Sequence[Sequence[str]]
) -> list[str]:
    """The lines that solve a z = b from variables a{row}_{column} and b{row} for z{column}.

    ``safe``: whether they did.

    Each variable but ``safe`` is assigned once, which is far less work for the compiler.  ``limits`` are the arguments'
    texts of the largest factors, by the equations that are subtracted from and that are subtracted, shape (n, n).
    """
    lines = ["safe = True"]
    right = [f"b{i}" for i in range(len(pattern))]
    names = {(i, j): f"a{i}_{j}" for i, j in np.argwhere(pattern).tolist()}
    for k, (row, column) in enumerate(order):
        later = order[k + 1 :]
        lines.append(f"d{row} = 1.0 / {names[row, column]}")
        for other, _ in later:
            if (other, column) not in names:
                continue
            f = f"f{other}_{row}"
            lines += [
                f"{f} = {names[other, column]} * d{row}",
                f"safe &= abs({f}) < {limits[other][row]}",
            ]
            for _, j in later:
                if (row, j) in names:
                    before = names.get((other, j), "")
                    names[other, j] = f"a{other}_{j}_{row}"
                    lines.append(f"{names[other, j]} = {before} - {f} * {names[row, j]}")
            lines.append(f"b{other}_{row} = {right[other]} - {f} * {right[row]}")
            right[other] = f"b{other}_{row}"
    for k in range(len(order) - 1, -1, -1):
        row, column = order[k]
        known = "".join(
            f" - {names[row, j]} * z{j}" for _, j in order[k + 1 :] if (row, j) in names
        )
        lines.append(f"z{column} = ({right[row]}{known}) * d{row}")
    return lines
