"""What is known of a response whose search was cut short: the means over the later half of the way."""

from collections.abc import Sequence

Known = tuple[float, float, float]
"""Mean power of Rload (W), mean square of the terminals' voltage (V^2), and the seconds that they cover."""


def later_half(runs: Sequence[Known]) -> Known | None:
    """The means over the last runs that make half of the time of all; None where nothing was covered.

    The first half is the way from rest.  A response that settles is near its end in the second; one that never does,
    such as a chip's that goes on and off, has both in it.
    """
    half, covered, sums = sum(seconds for *_, seconds in runs) / 2.0, 0.0, [0.0, 0.0]
    for power, square, seconds in reversed(runs):
        if covered >= half:
            break
        sums = [sums[0] + power * seconds, sums[1] + square * seconds]
        covered += seconds
    return (sums[0] / covered, sums[1] / covered, covered) if covered > 0.0 else None
