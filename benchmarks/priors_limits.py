"""The width of the intervals of real devices: designs, unknowns, origins, and the width after one measurement.

    python benchmarks/priors_limits.py           # the tables, some seconds
    python benchmarks/priors_limits.py --page    # into docs/prediction_fit.md

Each device is left out of the fit that judges it, as in benchmarks/priors_fit.py, and the width is that of a power.
Designs of an interval:

- ``sum``: about the predicted median, the variances of `priors_fit.sigma`;
- ``middle``: the same about the geometric middle of the first interval, which two coexisting responses share;
- ``one factor``: no prior at all, the factor that 95 % of the other devices' numbers need about their predictions;
- ``least``: the narrowest factor for 90 % of these numbers themselves, below which no common factor can hold them.

One measured number conditions the others of its device: a share of each variance, which is fitted as well, is common
to the device's numbers.
"""

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from common import print_block
from priors_fit import (
    FIRST,
    HALF,
    PAGE,
    Fit,
    Number,
    alone,
    fitted,
    holds,
    interval,
    left_out,
    numbers,
    rows,
    shared,
    sigma,
    wilson,
)
from scipy.optimize import minimize

from harvester.arrays import Floats

BEGIN = "<!-- by benchmarks/priors_limits.py --page -->"
END = "<!-- end -->"
ENDS = ("low_2", "high_2")
HEAD = ("| hold | coverage (95 % of the binomial) | median width |", "|---|---|---|")
Ends = tuple[float, float]


def has_width(number: Number) -> bool:
    """Whether it is a power or a voltage, whose widths are compared."""
    return number.exponents[3] > 0.0 and not number.unit.endswith("ohm")


def off(number: Number) -> float:
    """The logarithm of measured over predicted."""
    assert number.measured is not None, "it has a measured value"
    return math.log(number.measured / number.predicted)


def two_digits(value: float) -> str:
    """The value with two digits."""
    return f"{float(f'{value:.2g}'):g}"


def width(number: Number, ends: Sequence[float]) -> float:
    """The high end over the low end, of a voltage squared."""
    return float((ends[1] / ends[0]) ** (1.0 / number.exponents[3]))


def judged(some: Sequence[Number], ends: Sequence[Ends]) -> str:
    """The cells of a row: intervals that hold, coverage and median width."""
    met = sum(holds(number, pair) for number, pair in zip(some, ends, strict=True))
    low, high = wilson(met, len(some))
    widths = [
        width(number, pair) for number, pair in zip(some, ends, strict=True) if has_width(number)
    ]
    coverage = f"{100.0 * met / len(some):.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"
    return f"{met} of {len(some)} | {coverage} | {two_digits(float(np.median(widths)))}"


def at_middle(some: Sequence[Number]) -> list[Number]:
    """The numbers with the geometric middle of their first interval as the prediction."""
    ends = {
        (row["device"], row["quantity"]): (row["low"], row["high"]) for row in rows("predicted.csv")
    }
    return [
        dataclasses.replace(
            number,
            predicted=math.sqrt(
                math.prod(float(end) for end in ends[number.device, number.quantity])
            ),
        )
        for number in some
    ]


def of_fits(some: Sequence[Number]) -> list[Ends]:
    """Intervals of the fit that leaves each device out."""
    fits = left_out(some)
    return [interval(number, fits[number.device]) for number in some]


def in_powers(number: Number) -> float:
    """The deviation of a number as that of a power; for a frequency as it is."""
    return abs(off(number)) / (number.exponents[3] or 1.0)


def by_factor(some: Sequence[Number], factor: Callable[[str, bool], float]) -> list[Ends]:
    """Intervals within a factor of a power, which depends on the device and on whether the number is a frequency."""
    made = []
    for number in some:
        is_frequency = number.unit.endswith("Hz")
        reach = factor(number.device, is_frequency) ** (number.exponents[3] or 1.0)
        made.append((number.predicted / reach, number.predicted * reach))
    return made


def of_one_factor(some: Sequence[Number], share: float, leave_out: bool) -> list[Ends]:
    """Intervals of the factor that a share of the numbers needs, with or without the device itself."""

    def factor(device: str, is_frequency: bool) -> float:
        used = [
            in_powers(number)
            for number in some
            if number.unit.endswith("Hz") is is_frequency
            and not (leave_out and number.device == device)
        ]
        at = min(math.ceil(share * (len(used) + (1 if leave_out else 0))), len(used)) - 1
        return math.exp(sorted(used)[at])

    return by_factor(some, factor)


def of_three(device: str, is_frequency: bool) -> float:
    """Half of the width of 3 that is asked of a power; 5 % of a frequency."""
    return 1.05 if is_frequency else math.sqrt(3.0)


def designs(some: Sequence[Number]) -> Iterator[str]:
    """A row for each design of an interval."""
    yield f"| design {HEAD[0]}"
    yield f"|---{HEAD[1]}"
    middle = at_middle(some)
    for title, part, ends in (
        ("sum of variances about the median", some, of_fits(some)),
        ("sum of variances about the middle", middle, of_fits(middle)),
        ("one factor about the median", some, of_one_factor(some, 0.95, leave_out=True)),
        ("one factor about the middle", middle, of_one_factor(middle, 0.95, leave_out=True)),
        ("least about the median", some, of_one_factor(some, 0.9, leave_out=False)),
        ("least about the middle", middle, of_one_factor(middle, 0.9, leave_out=False)),
        ("a factor of 3 about the median", some, by_factor(some, of_three)),
        ("a factor of 3 about the middle", middle, by_factor(middle, of_three)),
    ):
        yield f"| {title} | {judged(part, ends)} |"


def without(number: Number, fit: Fit, name: str) -> float:
    """The standard deviation of a number if one unknown were known."""
    coupling, damping, frequency = number.sigmas
    if name == "open ranges":
        return sigma(dataclasses.replace(number, own=0.0), fit)
    if name == "coupling":
        return sigma(dataclasses.replace(number, sigmas=(0.0, damping, frequency)), fit)
    if name == "damping":
        return sigma(dataclasses.replace(number, sigmas=(coupling, 0.0, frequency)), fit)
    return sigma(number, dataclasses.replace(fit, linear=0.0, nonlinear=0.0))


def unknowns(some: Sequence[Number]) -> Iterator[str]:
    """A row for each unknown: its fraction of the variance of a power, and the median width without it."""
    fits = left_out(some)
    yield "| unknown | fraction of the variance, linear | nonlinear | median width without it, linear | nonlinear |"
    yield "|---|---|---|---|---|"
    parts = [
        [number for number in some if has_width(number) and number.linear is linear]
        for linear in (True, False)
    ]
    for name in ("open ranges", "coupling", "damping", "model error"):
        cells = []
        for part in parts:
            least = [without(number, fits[number.device], name) for number in part]
            whole = [sigma(number, fits[number.device]) for number in part]
            shares = [1.0 - (a / b) ** 2 for a, b in zip(least, whole, strict=True)]
            widths = [
                math.exp(2.0 * HALF * a / number.exponents[3])
                for a, number in zip(least, part, strict=True)
            ]
            cells.append((f"{100.0 * np.mean(shares):.0f} %", two_digits(float(np.median(widths)))))
        yield f"| {name} | {cells[0][0]} | {cells[1][0]} | {cells[0][1]} | {cells[1][1]} |"


@dataclass(frozen=True)
class Common:
    """A fit, and the share of a number's own variance that is common to the powers and voltages of its device."""

    fit: Fit
    share: float

    def covariance(self, some: Sequence[Number]) -> Floats:
        """Covariance of the logarithms of measured over predicted, for numbers of one device."""
        parts = np.array([shared(number, self.fit) for number in some])
        own = np.array([alone(number, self.fit) for number in some])
        both = np.array(
            [math.sqrt(x) if has_width(n) else 0.0 for n, x in zip(some, own, strict=True)]
        )
        common = self.share * np.outer(both, both)
        return np.asarray(parts @ parts.T + common + np.diag(own - np.diag(common)))


def with_share(some: Sequence[Number]) -> Common:
    """The fit of highest likelihood with the share, and the lognormal prior of `priors_fit.fitted`."""
    devices = [
        [number for number in some if number.device == device]
        for device in {number.device for number in some}
    ]
    first = np.log([FIRST.factor, FIRST.linear, FIRST.nonlinear])

    def of(x: Floats) -> Common:
        return Common(Fit(*map(float, np.exp(x[:3]))), float(1.0 / (1.0 + math.exp(-x[3]))))

    def loss(x: Floats) -> float:
        total = 0.5 * float(np.sum(((x[:3] - first) / math.log(2.0)) ** 2)) + 0.125 * x[3] ** 2
        for own in devices:
            covariance = of(x).covariance(own)
            d = np.array([off(number) for number in own])
            total += 0.5 * float(d @ np.linalg.solve(covariance, d))
            total += 0.5 * float(np.linalg.slogdet(covariance)[1])
        return total

    start = np.array([*np.log([*dataclasses.astuple(fitted(some))]), 0.0])
    return of(minimize(loss, start, method="Nelder-Mead").x)


def conditioned(own: Sequence[Number], known: int, common: Common) -> dict[int, Ends]:
    """Intervals of the powers and voltages of a device after one of them was measured."""
    covariance = common.covariance(own)
    weight = covariance[:, known] / covariance[known, known]
    made = {}
    for at, number in enumerate(own):
        if at == known or not has_width(number):
            continue
        middle = number.predicted * math.exp(weight[at] * off(own[known]))
        rest = covariance[at, at] - weight[at] * covariance[at, known]
        reach = math.exp(HALF * math.sqrt(max(rest, 0.0)))
        made[at] = (middle / reach, middle * reach)
    return made


def after_one(some: Sequence[Number]) -> Iterator[str]:
    """A row for each device with two powers or more: widths before and after one of them was measured."""
    yield "| device | powers and voltages | median width before | after one of them | hold before | after |"
    yield "|---|---|---|---|---|---|"
    totals = np.zeros((2, 2))
    every: list[list[float]] = [[], []]
    for device in dict.fromkeys(number.device for number in some):
        own = [number for number in some if number.device == device]
        powers = [at for at, number in enumerate(own) if has_width(number)]
        if len(powers) < 2:
            continue
        common = with_share([number for number in some if number.device != device])
        variances = np.diag(common.covariance(own))
        reaches = [math.exp(HALF * math.sqrt(x)) for x in variances]
        before = {
            at: (own[at].predicted / reaches[at], own[at].predicted * reaches[at]) for at in powers
        }
        after = [pair for known in powers for pair in conditioned(own, known, common).items()]
        widths = (
            [width(own[at], ends) for at, ends in before.items()],
            [width(own[at], ends) for at, ends in after],
        )
        held = (
            [holds(own[at], ends) for at, ends in before.items()],
            [holds(own[at], ends) for at, ends in after],
        )
        for which in (0, 1):
            totals[which] += sum(held[which]), len(held[which])
            every[which] += widths[which]
        cells = [two_digits(float(np.median(one))) for one in widths]
        cells += [f"{sum(one)} of {len(one)}" for one in held]
        yield f"| {device} | {len(powers)} | {' | '.join(cells)} |"
    cells = [two_digits(float(np.median(one))) for one in every]
    cells += [f"{met:.0f} of {count:.0f}" for met, count in totals]
    yield f"| all | | {' | '.join(cells)} |"


def by_device() -> Iterator[str]:
    """A row for each device: the origins of its numbers, and the median width of the fitted interval."""
    yield "| device | class | coupling | damping | numbers | median width |"
    yield "|---|---|---|---|---|---|"
    kept = {(row["device"], row["quantity"]): row for row in rows("predicted.csv")}
    some = [number for number in numbers() if has_width(number)]
    for about in rows("real_devices.csv"):
        for kind, linear in (("linear", True), ("nonlinear", False)):
            widths = [
                width(
                    number, tuple(float(kept[number.device, number.quantity][end]) for end in ENDS)
                )
                for number in some
                if number.device == about["device"] and number.linear is linear
            ]
            if widths:
                origins = f"{about['coupling']} | {about['damping']}".replace("_", " ")
                found = f"{len(widths)}, {kind} | {two_digits(float(np.median(widths)))}"
                yield f"| {about['device']} | {about['class']} | {origins} | {found} |"


def block() -> list[str]:
    """The generated lines of docs/prediction_fit.md."""
    some = [number for number in numbers() if number.measured is not None]
    return [*designs(some), "", *unknowns(some), "", *by_device(), "", *after_one(some)]


def main() -> None:
    """Print the tables, and with --page write them into the page."""
    print_block(block(), PAGE, BEGIN, END)


if __name__ == "__main__":
    main()
