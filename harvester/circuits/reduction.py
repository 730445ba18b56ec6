"""The equations of one implicit stage, reduced to the unknowns that functions read or enter.

A stage of length tau solves, for y at its end, with z and q at its beginning,

    (P Z/tau + G) y + A (i(w) + q(w)/tau) = P z/tau + A q/tau + s + b u

Equations that no function enters and unknowns that no function reads are eliminated, pivot by
pivot, once for each tau and all values, so that Newton's iterations see the rest only (Schur's
complement):

    Y y + A (i(w) + q(w)/tau) = R (z, q, u, 1)         and then      (z1, V, ...) = O (y, z, u, 1)

These are admittances: ports of a bridge float, so that impedances would be infinite.  Which pivots
are used depends on the topology, and on values only if one of them is zero.

The total current of a group of nodes that float is the sum of their equations, computed before
numbers are rounded.  The rails of a bridge are such a group.  The equations of its nodes have a storage capacitor's
C/tau, which is up to 1e16 times the leakage of blocked diodes, so that rounding hides the rails'
voltages.  In the sum all that connects nodes of the group cancels; it replaces one of their
equations. Groups are nested: those that the storage capacitor connects, those of series resistances
of devices as well, of all capacitors, and of all linear elements.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.circuits.system import Row, System
from harvester.errors import InputError


class SummedEquations:
    """The equations of a system, in which ``sums`` replace those of some nodes: the nodes of each."""

    def __init__(self, system: System) -> None:
        seen = set[int]().union(*(row for row, _ in system.inputs))
        entered = set[int]().union(
            *(diode.rows for diode in system.diodes), *(f.rows for f in system.functions)
        )
        sums = {k: frozenset([k]) for k in range(system.size) if k not in system.owners}
        for group in itertools.chain.from_iterable(
            _floating(system, columns) for columns in _nested(system)
        ):
            heads = (k for k in group if not any(sums[k] < sums[other] for other in group))
            # one that is kept in any case
            first = max(heads, key=lambda k: (k in entered, k in seen, -k))
            sums[first] = group
        self.sums = {k: group for k, group in sums.items() if len(group) > 1}

    def of(self, column: Row) -> Row:
        """The entry in the equations for a ``column`` in those of nodes."""
        entering = dict(column)
        for first, group in self.sums.items():
            entering[first] = sum(value for k, value in column.items() if k in group)
        return {k: value for k, value in entering.items() if value != 0.0}


def _nested(system: System) -> Iterator[list[Row]]:
    """The columns by which elements enter the equations: those of the strongest ones, and each time of more."""
    leaks, series = ({id(row) for row in rows} for rows in (system.leaks, system.series))
    coils = {k for _, column, _, _ in system.charges for k in column if k in system.owners}
    sources = list[Row]()
    conductances = list[Row]()
    inner = list[Row]()
    for column, row, _ in system.conductances:
        if id(column) in series:
            inner.append(column)
        elif row.keys() <= system.owners.keys() and coils.isdisjoint(row):
            sources.append(column)
        elif id(column) not in leaks:
            conductances.append(column)
    store = [column for name, column, _, _ in system.charges if name == "csmooth"]
    capacitors = [column for _, column, _, _ in system.charges]
    yield store
    yield store + inner
    yield capacitors + sources + inner
    yield capacitors + sources + inner + conductances


def _floating(system: System, columns: Iterable[Row]) -> list[frozenset[int]]:
    """The groups of nodes, of two and more, that elements connect with each other but not with ground."""
    ground = system.size
    parent = list(range(ground + 1))

    def of(k: int) -> int:
        while parent[k] != k:
            k = parent[k]
        return k

    for column in columns:
        nodes = [k for k in column if k not in system.owners]
        if sum(column[k] for k in nodes) != 0.0:
            nodes.append(ground)
        for k in nodes[1:]:
            parent[of(k)] = of(nodes[0])
    groups = dict[int, set[int]]()
    for k in range(ground):
        if k not in system.owners and of(k) != of(ground):
            groups.setdefault(of(k), set()).add(k)
    return [frozenset(group) for group in groups.values() if len(group) > 1]


SMALLEST = 1e-11  # of a pivot, over the largest coefficient of its equation


@dataclass(frozen=True)
class Stage:
    """The reduced equations of stages of one length: Y, R and O."""

    admittances: Floats
    right: Floats
    outputs: Floats


class Reduction:
    """The matrices of a system, and which unknowns and equations are kept: ``columns`` and ``rows``.

    ``read`` are the rows of quantities that are reported at the end of a stage, next to the
    charges.
    """

    def __init__(self, system: System, read: list[Row], tau: float) -> None:
        self.system = system
        self.equations = SummedEquations(system)
        n = system.size
        self.G = np.zeros((n, n))
        for rows, columns, value in system.conductances:
            for (i, a), (j, b) in itertools.product(
                self.equations.of(rows).items(), columns.items()
            ):
                self.G[i, j] += a * b * value
        self.P = self._entering([column for _, column, _, _ in system.charges])
        self.Z = system.vectors([row for _, _, row, _ in system.charges])
        entering = [
            *(diode.rows for diode in system.diodes),
            *(function.rows for function in system.functions),
        ]
        self.A = self._entering(entering)
        self.W = system.vectors([row for row, _ in system.inputs])
        self.s = self._entering([system.sources])[:, 0]
        self.b = self._entering([{system.unknowns["p"]: 1.0}])[:, 0]
        self.read = system.vectors(read)
        self.entered = np.abs(self.A).sum(axis=1) > 0.0
        self.control = system.vectors([switch.control for switch in system.switches])
        seen = np.abs(np.vstack([self.W, np.zeros((1, n))])).sum(axis=0) > 0.0
        piezo = system.unknowns["p"]
        self.entered[piezo] = seen[piezo] = True  # so that something is left of a linear circuit
        self.rows, self.columns = self._kept(self.matrix(tau), self.entered, seen)
        self.gone_rows = [k for k in range(n) if k not in self.rows]
        self.gone_columns = [k for k in range(n) if k not in self.columns]

    def _entering(self, columns: Sequence[Row]) -> Floats:
        """Columns of the terms of the equations of nodes, shape (equations, columns)."""
        return self.system.vectors([self.equations.of(column) for column in columns]).T

    def matrix(self, tau: float) -> Floats:
        """The linear part of a stage's equations."""
        return np.asarray(self.P @ self.Z / tau + self.G)

    def _kept(self, matrix: Floats, entered: Floats, seen: Floats) -> tuple[list[int], list[int]]:
        """The equations and unknowns that no pivot eliminates, by Gauss with full pivoting."""
        left = matrix.copy()
        scale = np.abs(left).max(axis=1)
        scale[scale == 0.0] = 1.0
        left /= scale[:, None]
        across = np.abs(left).max(axis=0)
        across[across == 0.0] = 1.0
        left /= across
        rows, columns = list(range(len(left))), list(range(len(left)))
        while True:
            free_rows = [i for i in rows if not entered[i]]
            free_columns = [j for j in columns if not seen[j]]
            if not free_rows or not free_columns:
                return rows, columns
            part = np.abs(left[np.ix_(free_rows, free_columns)])
            i, j = np.unravel_index(part.argmax(), part.shape)
            if part[i, j] < SMALLEST:
                return rows, columns
            row, column = free_rows[i], free_columns[j]
            rows.remove(row)
            columns.remove(column)
            factors = left[rows, column] / left[row, column]
            left[np.ix_(rows, columns)] -= np.outer(factors, left[row, columns])

    def stage(self, tau: float) -> Stage:
        """The reduced equations of stages of a length tau, in seconds; raises as `_eliminated`."""
        matrix, known, by_S, by_known = self._eliminated(tau)
        S = self.columns
        L = self.gone_columns
        s_rows = self.rows
        outer = matrix[np.ix_(s_rows, L)]
        admittances = matrix[np.ix_(s_rows, S)] - outer @ by_S
        right = known[s_rows] - outer @ by_known
        # All unknowns, of those kept and of what is known: y = F y_S + H (z, q, u, 1)
        F = np.zeros((len(matrix), len(S)))
        H = np.zeros((len(matrix), known.shape[1]))
        F[S, range(len(S))] = 1.0
        F[L] = -by_S
        H[L] = by_known
        read_out = np.vstack([self.Z, self.read, self.control])
        return Stage(admittances, right, np.hstack([read_out @ F, read_out @ H]))

    def _eliminated(self, tau: float) -> tuple[Floats, Floats, Floats, Floats]:
        """The matrix, the columns of the known terms, and the eliminated unknowns by those kept and by the known terms.

        Raises InputError if there is no solution.
        """
        matrix = self.matrix(tau)
        S = self.columns
        L = self.gone_columns
        l_rows = self.gone_rows
        known = np.hstack(
            [
                self.P / tau,
                self.A[:, : len(self.system.diodes)] / tau,
                self.b[:, None],
                self.s[:, None],
            ]
        )
        scale = np.abs(matrix[l_rows]).max(axis=1, initial=0.0)
        scale[scale == 0.0] = 1.0
        both = np.hstack([matrix[np.ix_(l_rows, S)], known[l_rows]]) / scale[:, None]
        try:
            solved = np.linalg.solve(matrix[np.ix_(l_rows, L)] / scale[:, None], both)
        except np.linalg.LinAlgError:
            raise InputError(
                "netlist must have one solution, but its linear elements have none"
            ) from None
        return matrix, known, solved[:, : len(S)], solved[:, len(S) :]

    def unknowns(self, charges: Floats, kept: Floats, tau: float) -> Floats:
        """All unknowns of states, one a row: those of their charges, and those kept.

        In ``tau`` nothing changes.
        """
        _, _, by_S, by_known = self._eliminated(tau)
        unknowns = np.zeros((len(charges), self.system.size))
        unknowns[:, self.columns] = kept
        known = np.column_stack([charges, np.zeros(len(charges)), np.ones(len(charges))])
        unknowns[:, self.gone_columns] = known @ by_known.T - kept @ by_S.T
        return unknowns
