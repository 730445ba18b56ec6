"""How many ngspice runs an estimate begins with."""

FEWEST = 8  # runs that tell the bias of the step, and pairs of which each half weighs the other
LOOSE = 0.1  # a target from which on fewer pairs do
FEW = 4  # pairs for a loose target
FEWEST_BLOCKS = 16  # of all these pairs together: with fewer, one half cannot weigh the other


def fewest_pairs(within: float | None, blocks: int) -> int:
    """Pairs with a cheap model from which on a mean has an honest error: `FEW` for a loose target, else `FEWEST`.

    ``within`` is the relative error asked for, None: none; a trajectory has so many ``blocks``.  The error of so few
    runs is stated by Student's t of two degrees of freedom: two to three times that of `FEWEST`, at half the cost.

    >>> fewest_pairs(0.2, blocks=5), fewest_pairs(0.2, blocks=1), fewest_pairs(0.01, blocks=5)
    (4, 8, 8)
    """
    return FEW if within is not None and within >= LOOSE and FEW * blocks >= FEWEST_BLOCKS else FEWEST
