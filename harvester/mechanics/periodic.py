"""Periodic states: where a map of a period comes back to, with far fewer periods than it takes to settle.

A mass and its circuit settle in their slowest mode, which for a large capacitor takes hundreds of periods; a state has
a few such modes only.  Anderson's acceleration finds the fixed point y = f(y) from what the last periods did: of all
combinations of the last f(y_i), of weights that add up to 1, it takes the one whose residuals f(y_i) - y_i leave least.
(Anderson, J. ACM 12, 547, 1965; Walker and Ni, SIAM J. Numer. Anal. 49, 1715, 2011.)

Of a state y only the slow parts ``slow`` @ y count in a residual, and each group of them relative to its size; the rest
(nodes between diodes, say) goes along.  What is left of the way is estimated by the next step of the same rule.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from harvester.arrays import Floats
from harvester.errors import CircuitError

MEMORY = 6  # periods that are combined
MOST = 80  # periods
REACHED = 1e-6  # of the state's size: nothing more to win
ENOUGH = 1e-4  # the same, where ngspice's tolerance lets it come no nearer in `PATIENCE` periods
PATIENCE = 4
SHORTER, LEAST = 0.3, 1e-3  # of a step to a state that the circuit refuses; relative to the state, not worth a try
SMALLEST = 1e-8  # singular values of a combination, relative to the largest

Turn = Callable[[Floats], tuple[Floats, Floats]]  # a state -> the state a period later, and the means over that period


@dataclass
class Settling:
    """The way to a fixed point of ``turn``.

    ``slow``, shape (n, size of a state), picks what counts; ``groups``, shape (n,), numbers what has a size together.
    ``state`` is the last f(y), shape (size,), and ``means`` those of its period.
    """

    turn: Turn
    slow: Floats
    groups: Floats
    state: Floats
    means: Floats = field(default_factory=lambda: np.zeros(0))
    _states: list[Floats] = field(default_factory=list)
    _residuals: list[Floats] = field(default_factory=list)
    _means: list[Floats] = field(default_factory=list)

    def size(self, change: Floats) -> float:
        """The size of a change of the slow part, shape (n,), relative to that of the last state's groups."""
        return float(np.linalg.norm(self._weights() * change))

    def _weights(self) -> Floats:
        """One over the size of each slow part's group."""
        square = (self.slow @ self.state) ** 2
        sizes = np.sqrt([square[self.groups == one].sum() for one in self.groups])
        return np.asarray(1.0 / np.maximum(sizes, 1e-12))

    def plainly(self, turns: int, start: Floats | None = None) -> None:
        """Go on for so many periods as they come, from the last state or from another."""
        self.state = self.state if start is None else start
        for _ in range(turns):
            self.state, self.means = self.turn(self.state)

    def left(self, residual: Floats) -> tuple[Floats, Floats]:
        """How far f(y) and its means are from those of the fixed point, as the last periods say.

        ``residual`` is the slow part of f(y) - y, shape (n,).
        """
        if len(self._states) < 2:
            return np.zeros_like(self.state), np.zeros_like(self.means)
        weights = self._weights()
        changes = np.diff([weights * one for one in self._residuals], axis=0).T
        share = np.linalg.lstsq(changes, weights * residual, rcond=SMALLEST)[0]
        return share @ np.diff(self._states, axis=0), share @ np.diff(self._means, axis=0)

    def _forget(self) -> None:
        """Combine no periods before this one."""
        for values in (self._states, self._residuals, self._means):
            values.clear()

    def reach(self) -> bool:
        """Go on to the fixed point; whether it was reached, in `MOST` periods."""
        y, best, since, step = self.state, np.inf, 0, np.zeros_like(self.state)
        for _ in range(MOST):
            reached = self.state
            try:
                self.plainly(1, y)
            except CircuitError:  # which a combination may ask of a circuit, but no state that a period leads to
                if y is reached:
                    raise
                step *= SHORTER
                self.state, y = reached, reached - step
                if self.size(self.slow @ step) < LEAST:
                    y = reached
                    self._forget()
                continue
            residual = self.slow @ (self.state - y)
            for values, one in ((self._states, self.state), (self._residuals, residual), (self._means, self.means)):
                values.append(one)
                del values[:-MEMORY]
            step = self.left(residual)[0]
            size = self.size(residual) + self.size(self.slow @ step)
            best, since = (size, 0) if size < best else (best, since + 1)
            if len(self._states) > 1 and (size < REACHED or (since >= PATIENCE and size < ENOUGH)):
                return True
            y = self.state - step
        return False
