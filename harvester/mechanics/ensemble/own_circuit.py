"""The contribution of a circuit of a higher layer, with which trajectories advance: kernels of its own."""

from typing import Protocol

from harvester.arrays import Floats
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.path import Path
from harvester.mechanics.kernels.shaking import Filter
from harvester.mechanics.kernels.trajectory_batch import Batch, Schedule


class OwnCircuit(Protocol):
    """A circuit of a room above that brings kernels of its own: how many rows its states and sums have, and these."""

    sums: int
    has_own_kernel: bool

    @property
    def rows(self) -> int:
        """Rows of its states."""

    @property
    def mu(self) -> float:
        """The load's power over the squared voltage of the storage capacitor, nondimensional."""

    @property
    def memory(self) -> float:
        """Time constant of the smoothing capacitor with the load."""

    def begin(self, state: Floats) -> None:
        """Fill the rows below x, x' and V of states at the beginning, shape (blocks, rows, BATCH)."""

    def advance(
        self,
        batch: Batch,
        state: Floats,
        schedule: Schedule,
        h: float,
        eqs: Equations,
        shaker: Filter | None,
    ) -> None:
        """Advance a batch, whose states are all in ``state``, by a schedule of steps of h."""

    @property
    def has_counts(self) -> bool:
        """Whether its functions count, as those of clocks."""

    def stored(self, state: Floats) -> Floats:
        """Energy in storage in states, shape (blocks, rows, BATCH), in the unit of mu U^2 t: shape (blocks BATCH,)."""

    def check_sums(self, sums: Floats, state: Floats) -> None:
        """Raise an error if too many circuit steps failed.

        ``sums`` are those that are of it alone.
        """

    def trace(
        self,
        eqs: Equations,
        noise: Floats,
        h: float,
        stride: int,
        start: Floats,
        state: Floats,
        shaking: Floats | None,
        kicked: bool,
    ) -> Path:
        """One trajectory from y, y' and a state of the circuit, the rows of states from `MASS_ROWS` on.

        ``kicked`` states that the start is after a kick.
        """

    def mid_drift(
        self, state: Floats, out: Floats, h: float, eqs: Equations, shaker: Filter | None
    ) -> None:
        """Go from the states of a block after a kick to x, x' and V half a step later."""
