"""The largest values of a long trajectory in blocks, and its impacts: counted if Rice's formula does not hold.

The trajectory is that of the exact RC update (`harvester.mechanics.trace`).  A block is so long
that its largest value is independent of the next block's: its length is doubled until their
correlation is below `UNCORRELATED`.
"""

import math
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.equations.bounds import check_bounded
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError
from harvester.machine.progress import report_share
from harvester.uncertainty.value import Value, mean_and_error

SHORTEST, BLOCKS = 50, 2048  # a block's cycles at first, and how many blocks there are
UNCORRELATED = 0.2  # the largest correlation of neighbours that 100 blocks or so have by chance
LONGEST = 4_000_000  # steps in one piece, which the memory holds
READ = 0.05  # radian of the highest mode's phase, between two samples of the trajectory
FEWEST = 64  # blocks that a tail needs


@dataclass(frozen=True)
class Counted:
    """The largest |x|, |V| and impact speed of each block, shape (blocks,), and the impacts a unit of time.

    Nondimensional; ``speed`` is None without a stop.  ``block`` is the length of a block, ``time``
    that of all.
    """

    block: float
    x: Floats
    V: Floats
    speed: Floats | None
    impacts: Value | None

    @property
    def time(self) -> float:
        """The length of the trajectory that was counted."""
        return self.block * len(self.x)


def count(eqs: Equations, seed: int = 0, blocks: int = BLOCKS) -> Counted:
    """Follow a path and count.

    Raises SimulationError if the path is not finite, or if its largest values stay correlated.
    """
    from harvester.mechanics.kernels.noise import gaussian_grid
    from harvester.mechanics.kernels.step_size import step_from_rest
    from harvester.mechanics.trace import trace

    check_bounded(eqs)
    h = step_from_rest(eqs)
    stride = max(1, round(READ / (h * eqs.highest_frequency)))
    block_steps = math.ceil(2.0 * math.pi * SHORTEST / (h * stride)) * stride  # steps of a block
    piece = max(LONGEST // block_steps, 1)
    parts: list[tuple[Floats, Floats, Floats, Floats]] = []
    start: Floats | None = None
    # the first fifth is left out
    left = blocks + blocks // 4
    sequence = np.random.SeedSequence([seed, 11])
    while left > 0:
        n_blocks = min(piece, left)
        path = trace(
            eqs, gaussian_grid(sequence.spawn(1)[0], n_blocks * block_steps), h, stride, start
        )
        if not np.isfinite(path.samples[-1]).all():
            raise SimulationError(
                "the path is not finite: the response grows without bound, or the step is too long"
            )
        start = path.last
        number = np.minimum((path.impacts[:, 0] / (block_steps * h)).astype(int), n_blocks - 1)
        speed = np.zeros(n_blocks)
        hits = np.bincount(number, minlength=n_blocks).astype(float)
        np.maximum.at(speed, number, np.abs(path.impacts[:, 1]))
        peaks = (np.abs(values).reshape(n_blocks, -1).max(axis=1) for values in (path.x, path.V))
        parts.append((*peaks, speed, hits))
        left -= n_blocks
        report_share(1.0 - max(left, 0) / (blocks + blocks // 4))
    x, voltage, speed, hits = (
        np.concatenate(column)[-blocks:] for column in zip(*parts, strict=True)
    )
    block = block_steps * h
    while _correlation(x) > UNCORRELATED or _correlation(voltage) > UNCORRELATED:
        if len(x) < 2 * FEWEST:
            raise SimulationError(
                "the largest values of the path stay correlated: it takes longer than was counted to forget them"
            )
        x, voltage, speed = (
            v[: len(v) // 2 * 2].reshape(-1, 2).max(axis=1) for v in (x, voltage, speed)
        )
        hits = 0.5 * hits[: len(hits) // 2 * 2].reshape(-1, 2).sum(axis=1)
        block *= 2.0
    if not eqs.has_stop:
        return Counted(block, x, voltage, None, None)
    mean, error = mean_and_error(hits)
    return Counted(block, x, voltage, speed, Value(mean, error).scaled(1.0 / (block_steps * h)))


def _correlation(values: Floats) -> float:
    """The correlation of each value with the next."""
    if np.ptp(values) == 0.0:
        return 0.0
    return float(np.corrcoef(values[:-1], values[1:])[0, 1])
