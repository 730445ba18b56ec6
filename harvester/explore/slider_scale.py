"""The place of a value on a slider: by ratio for quantities over decades, evenly for a share of 1."""

import math
from dataclasses import dataclass

from harvester.scene.keys import key_kind, split_key

STEPS = 300  # places of a slider, from 0
# on either side
_DECADES = {"load.resistance": 2.5, "nondimensional.mu": 2.0, "load.parameters.R": 2.5}
_NARROW = ("oscillator.mass", "oscillator.stiffness")


@dataclass(frozen=True)
class Slide:
    """The values from ``low`` to ``high`` at the places 0 to `STEPS`.

    By ratio, times ``sign``, if ``by_ratio``.
    """

    low: float
    high: float
    by_ratio: bool
    sign: float = 1.0

    def value(self, position: int) -> float:
        """The value at a place, of three digits."""
        share = position / STEPS
        if self.by_ratio:
            return self.sign * float(f"{self.low * (self.high / self.low) ** share:.3g}")
        return float(f"{self.low + (self.high - self.low) * share:.4g}")

    def position(self, value: float) -> int:
        """The place that is nearest to a value; an end for a value outside."""
        if self.by_ratio:
            size = max(self.sign * value, self.low)
            share = math.log(size / self.low) / math.log(self.high / self.low)
        else:
            share = (value - self.low) / (self.high - self.low)
        return round(STEPS * min(max(share, 0.0), 1.0))

    def holds(self, value: float) -> bool:
        """Whether a value is within the ends (and of the sign)."""
        size = self.sign * value if self.by_ratio else value
        return self.low * (1.0 - 1e-9) <= size <= self.high * (1.0 + 1e-9)

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value."""
        first, last = (
            (self.sign * self.low, self.sign * self.high)
            if self.by_ratio
            else (self.low, self.high)
        )
        return min(first, last), max(first, last)


def slide(key: str, value: float) -> Slide:
    """The slider of a key about a value in SI units."""
    kind = key_kind(*split_key(key))
    if kind is not None and (kind.least, kind.most) == (0.0, 1.0):
        return Slide(0.0, 1.0, False)
    if key == "nondimensional.linear":
        return Slide(-1.0, 1.0, False)
    size = abs(value) or 1.0
    factor = 10.0 ** _DECADES.get(
        key, 0.75 if key in _NARROW else 0.3 if key.endswith("frequency") else 1.5
    )
    low = float(f"{size / factor:.2g}")
    high = float(f"{size * factor:.2g}")
    return Slide(low, high, True, -1.0 if value < 0.0 else 1.0)
