"""Groups of nodes that float: their total current is the sum of their equations, computed before numbers are rounded.

The rails of a bridge are such a group.  The equations of its nodes have a storage capacitor's
C/tau, which is up to 1e16 times the leakage of blocked diodes, so that rounding hides the rails'
voltages.  In the sum all that connects nodes of the group cancels; it replaces one of their
equations. Groups are nested: those that the storage capacitor connects, those of series resistances
of devices as well, of all capacitors, and of all linear elements.
"""

import itertools
from collections.abc import Iterable, Iterator

from harvester.circuits.system import Row, System


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
