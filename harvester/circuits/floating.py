"""Groups of nodes that hang together by linear elements and float: only junctions and functions lead elsewhere.

The rails of a bridge are such a group.  The equations of its nodes have a store's C/tau, which is 1e16 times what leaks
through blocked diodes.  What the group gets as a whole is the sum of its equations, in which linear elements cancel;
taken before numbers are rounded, it stands in place of one of them.
"""

from harvester.circuits.system import Row, System


def floating_groups(system: System) -> list[list[int]]:
    """The unknowns of the nodes of each group that floats, those of two nodes and more."""
    ground = system.size
    parent = list(range(ground + 1))

    def of(k: int) -> int:
        while parent[k] != k:
            k = parent[k]
        return k

    leaks = {id(row) for row in system.leaks}
    columns = [rows for rows, _, _ in system.conductances if id(rows) not in leaks]
    for column in (*columns, *(column for _, column, _, _ in system.charges)):
        nodes = [k for k in column if k not in system.owners]
        if not nodes:
            continue
        if sum(column[k] for k in nodes) != 0.0:
            nodes.append(ground)
        for k in nodes[1:]:
            parent[of(k)] = of(nodes[0])
    groups = dict[int, list[int]]()
    for k in range(ground):
        if k not in system.owners and of(k) != of(ground):
            groups.setdefault(of(k), []).append(k)
    return [group for group in groups.values() if len(group) > 1]


class Equations:
    """The equations of a system, in which the ``sums`` of groups that float stand in place of one of each group's."""

    def __init__(self, system: System) -> None:
        entering = [*(diode.rows for diode in system.diodes), *(function.rows for function in system.functions)]
        seen = {k for row, _ in system.inputs for k in row}
        entered = {k for row in entering for k in row}
        self.sums = dict[int, frozenset[int]]()
        for group in floating_groups(system):
            if not entered.isdisjoint(group):  # among its nodes one that is kept in any case
                first = max(group, key=lambda k: ((k in entered) + (k in seen), k in entered, -k))
                self.sums[first] = frozenset(group)

    def of(self, column: Row) -> Row:
        """What enters the equations where a ``column`` enters those of nodes."""
        entering = dict(column)
        for first, group in self.sums.items():
            entering[first] = sum(value for k, value in column.items() if k in group)
        return {k: value for k, value in entering.items() if value != 0.0}
