"""A relative bias with its sign and its standard error."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Bias:
    """A relative bias with its sign, and its standard error."""

    value: float
    stderr: float

    @property
    def counted(self) -> float:
        """The part of a total error that this bias makes: max(|bias|, 2 stderr).

        A bias that is lost in its own error is counted at its upper limit, so that it is never zero
        by chance, and grows without a jump if it shows.
        """
        return max(abs(self.value), 2.0 * self.stderr)

    def scaled(self, factor: float) -> "Bias":
        """The bias and its error times ``factor`` > 0."""
        return Bias(factor * self.value, factor * self.stderr)

    def __add__(self, other: "Bias") -> "Bias":
        """The bias of two causes together, which were measured independently."""
        return Bias(self.value + other.value, math.hypot(self.stderr, other.stderr))


NONE = Bias(0.0, 0.0)  # of what the others are measured against
