"""All predicted numbers that have a measured value, judged together: how many intervals hold, and how wide they are.

    python benchmarks/priors_judged.py           # the tables, a minute
    python benchmarks/priors_judged.py --page    # into docs/prediction.md

The seven devices of benchmarks/measured.csv and D9 have the fit of benchmarks/priors_kinds.py that leaves the device
out.  All others are in no fit and keep the interval of their prediction.

The second table bounds any design of intervals about the same medians.  A median width of 3 gives at least half of the
numbers a width of 3 or less.  Even if that half has every number that such an interval holds, and all others hold, the
rest of the half does not.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import unseen_cantilevers
from cantilevers import table
from common import print_block
from priors_fit import HERE, holds, wilson
from priors_kinds import left_out, with_later
from priors_limits import has_width, two_digits, width

PAGE = HERE.parent / "docs" / "prediction.md"
BEGIN, END = "<!-- by benchmarks/priors_judged.py --page -->", "<!-- end -->"
FIXED = 3.0  # high over low of a power
SHARE = 0.9
ALONE = {"D25": "bistable plate, D25, in no fit", "D26": "recorded sweeps, D26, in no fit"}


@dataclass(frozen=True)
class Outcome:
    """A number that was judged; ``width`` and ``off``, the logarithm of measured over predicted, are of a power.

    Both are None for a frequency, a load and a displacement.
    """

    group: str
    device: str
    linear: bool
    holds: bool
    width: float | None
    off: float | None


def fitted() -> Iterator[Outcome]:
    """The devices of the fit, each left out of its own."""
    some = with_later()
    fits = left_out(some)
    for number in some:
        kinds = fits[number.device]
        moved, pair = kinds.moved(number), kinds.ends(number)
        wide = has_width(number)
        assert number.measured is not None, "with_later leaves out the others"
        off = math.log(number.measured / moved.predicted)
        yield Outcome(
            group="seven devices and D9, each left out of the fit",
            device=number.device,
            linear=number.linear,
            holds=holds(moved, pair),
            width=width(number, pair) if wide else None,
            off=off / number.exponents[3] if wide else None,
        )


def unfitted() -> Iterator[Outcome]:
    """The devices that are in no fit."""
    films = table()
    for one in unseen_cantilevers.judged([*films, *ALONE]):
        wide = one.unit[-1] in "WV" or "V peak" in one.unit
        off = math.log(float(one.measured) / one.predicted)
        yield Outcome(
            group=ALONE.get(one.device, "fifteen cantilevers, D10 to D24, in no fit"),
            device=one.device,
            linear=one.device in films,
            holds=one.holds,
            width=one.width if wide else None,
            off=off * (1.0 if one.unit.endswith("W") else 2.0) if wide else None,
        )


def coverage(met: int, count: int) -> str:
    """``79 of 85 | 93 % (85 to 97)``: the share, and the interval of the binomial."""
    low, high = wilson(met, count)
    return (
        f"{met} of {count} | {100.0 * met / count:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"
    )


def held_by(off: Sequence[float], wide: float) -> int:
    """How many of the logarithms an interval about the median holds, whose high end over low is ``wide``."""
    return sum(2.0 * abs(x) <= math.log(wide) for x in off)


def least_width(off: Sequence[float], share: float) -> float:
    """The least width that, common to all, holds a share of them."""
    return math.exp(2.0 * sorted(map(abs, off))[math.ceil(share * len(off)) - 1])


def most_held(off: Sequence[float], median: float) -> int:
    """The most that intervals about their medians can hold if the median of their widths is ``median``."""
    half = (len(off) + 1) // 2
    return len(off) - max(half - held_by(off, median), 0)


def groups(every: Sequence[Outcome]) -> dict[str, list[Outcome]]:
    """The numbers by their origin, all, and by whether the device is linear."""
    made = {title: [one for one in every if one.group == title] for title in _titles(every)}
    return {
        **made,
        "all": [*every],
        "all linear numbers": [one for one in every if one.linear],
        "all nonlinear numbers": [one for one in every if not one.linear],
    }


def _titles(every: Sequence[Outcome]) -> list[str]:
    return list(dict.fromkeys(one.group for one in every))


def block() -> list[str]:
    """The generated lines of the page."""
    every = [*fitted(), *unfitted()]
    lines = [
        "| numbers | devices | hold | coverage (95 % of the binomial) | median width |",
        "|---|---|---|---|---|",
    ]
    for title, some in groups(every).items():
        devices = len({one.device for one in some})
        wide = two_digits(float(np.median([one.width for one in some if one.width is not None])))
        met = sum(one.holds for one in some)
        lines.append(f"| {title} | {devices} | {coverage(met, len(some))} | {wide} |")
    lines += [
        "",
        "| powers and voltages | a width of 3 holds | at a median width of 3 at most | least common width"
        f" that holds {100.0 * SHARE:.0f} % |",
        "|---|---|---|---|",
    ]
    for title, some in [*groups(every).items()][-3:]:
        off = [one.off for one in some if one.off is not None]
        met, most = held_by(off, FIXED), most_held(off, FIXED)
        share = f"{100.0 * most / len(off):.0f} %"
        least = two_digits(least_width(off, SHARE))
        lines.append(f"| {title} | {met} of {len(off)} | {most} of {len(off)}, {share} | {least} |")
    return lines


def main() -> None:
    """Print the tables, and with --page write them into the page."""
    print_block(block(), PAGE, BEGIN, END)


if __name__ == "__main__":
    main()
