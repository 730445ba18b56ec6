"""The remainder of a budget, and whether the next solution ends in it: seconds vary as the memory of the factors.

From the coarsest mesh to the finest, and with coloured noise, a byte needs the same time within a
factor of two.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from harvester.errors import SimulationError
from harvester.presentation.diagnostic import refusal

# bytes of all solutions that an answer takes at least, in those of one that settles the box
LEAST = 12.0
SHORTEST = 5.0  # seconds: a budget below it counts as this


@dataclass
class Pace:
    """A budget of seconds, None for any number, that began with its making; and the cost of the latest solution."""

    budget: float | None = None
    begin: float = field(default_factory=time.perf_counter)
    per_byte: float = 0.0

    @contextmanager
    def solving(self, memory: float) -> Iterator[None]:
        """Measure a solution whose factors need so many bytes."""
        begin = time.perf_counter()
        yield
        self.per_byte = (time.perf_counter() - begin) / memory

    def needed(self, memory: float) -> float:
        """The seconds since the beginning at which solutions of so many bytes would end."""
        return time.perf_counter() - self.begin + self.per_byte * memory

    def is_late(self, memory: float = 0.0) -> bool:
        """Whether they would end after the budget."""
        return self.budget is not None and self.needed(memory) > self.budget

    def check(self, memory: float) -> None:
        """Raise SimulationError if no answer would come in the budget, judged by a first solution of so many bytes."""
        needed = self.needed(LEAST * memory)
        if self.budget is not None and needed > max(self.budget, SHORTEST):
            raise SimulationError(refusal("density_needs_time", seconds=needed, budget=self.budget))
