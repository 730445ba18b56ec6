"""Trees of expressions: nodes that know their size and are equal if their trees are, with constants computed."""

import hashlib
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

from harvester.errors import InputError
from harvester.netlists.folding import constant_of

LARGEST = 5_000  # nodes of a tree, its parameters and functions written out
LONGEST = 300  # operations one within another, as in a sum of so many terms


@dataclass(frozen=True, eq=False)
class Node:
    """A node of a tree: an operation on ``arguments``, or a leaf.

    Leaves are a ``constant`` of a ``value``, a ``name`` or a ``call`` of a function of the netlist (``names``), a
    voltage ``v`` or current ``i`` of ``names``, the ``time``, and, in a compiled circuit, the ``input`` or the
    ``state`` of an ``index``.  Nodes are equal if their trees are; ``depth`` and ``size`` are those
    of the tree.
    """

    operation: str
    arguments: tuple["Node", ...] = ()
    value: float = 0.0
    index: int = 0
    names: tuple[str, ...] = ()
    depth: int = field(init=False)
    size: int = field(init=False)
    key: bytes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        below = self.arguments
        object.__setattr__(self, "depth", 1 + max((node.depth for node in below), default=0))
        object.__setattr__(self, "size", min(1 + sum(node.size for node in below), 10**9))
        fields = repr((self.operation, self.value, self.index, self.names)).encode()
        object.__setattr__(
            self,
            "key",
            hashlib.blake2b(fields + b"".join(node.key for node in below), digest_size=16).digest(),
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Node) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    @property
    def is_constant(self) -> bool:
        """Whether it is a number."""
        return self.operation == "constant"

    @property
    def nodes(self) -> set["Node"]:
        """All nodes of the tree."""
        waiting = [self]
        nodes = {self}
        while waiting:
            new = set(waiting.pop().arguments) - nodes
            nodes |= new
            waiting += new
        return nodes

    @property
    def leaves(self) -> set["Node"]:
        """All leaves that are not constants."""
        return {node for node in self.nodes if not node.arguments and not node.is_constant}


def constant(value: float) -> Node:
    """A leaf that has a value."""
    return Node("constant", value=float(value))


def input_of(index: int) -> Node:
    """A leaf that is an input."""
    return Node("input", index=index)


def operation(name: str, *arguments: Node) -> Node:
    """An operation on trees, computed at once if all are constants, or its condition is."""
    if name == "?" and arguments[0].is_constant:
        return arguments[1] if arguments[0].value != 0.0 else arguments[2]
    if all(argument.is_constant for argument in arguments):
        return constant(constant_of(name, *(argument.value for argument in arguments)))
    return Node(name, arguments)


def checked(tree: Node, where: str) -> Node:
    """The tree, if it is not too large.

    Raises InputError otherwise.
    """
    if tree.depth > LONGEST or tree.size > LARGEST:
        raise InputError(
            f"{where} must have an expression of at most {LARGEST:,} operations, {LONGEST} of them one within another "
            "(as the terms of a sum are), with its parameters and functions written out"
        )
    return tree


def with_leaves(tree: Node, leaf: Callable[[Node], Node]) -> Node:
    """The tree with other leaves in place of its voltages, currents and times."""
    done: dict[Node, Node] = {}

    def new(node: Node) -> Node:
        if node not in done:
            arguments = [new(argument) for argument in node.arguments]
            if arguments:
                done[node] = (
                    Node("pwl", tuple(arguments))
                    if node.operation == "pwl"
                    else operation(node.operation, *arguments)
                )
            else:
                done[node] = node if node.is_constant else leaf(node)
        return done[node]

    return new(tree)


def table(arguments: list[Node], where: str) -> Node:
    """A table pwl(x, x0, y0, x1, y1, ...), straight between its points, and on with the last slopes beyond them.

    Raises InputError unless its points are two or more constants that ascend.
    """
    x, *points = arguments
    if len(points) % 2 or len(points) < 4 or not all(point.is_constant for point in points):
        raise InputError(f"{where} must give to pwl two points or more, pairs of constants")
    knots = [point.value for point in points[::2]]
    if any(not first < second for first, second in itertools.pairwise(knots)):
        raise InputError(f"{where} must give to pwl points that ascend")
    if x.is_constant:
        return constant(constant_of("pwl", *(argument.value for argument in arguments)))
    return Node("pwl", tuple(arguments))


def limited(x: Node, first: Node, second: Node) -> Node:
    """The middle one of three values, which is limit(x, a, b) of LTspice."""
    low, high = operation("min", first, second), operation("max", first, second)
    return operation("min", operation("max", x, low), high)
