"""Intervals of real devices with a model error of each kind of device, and the widths by what a source states.

    python benchmarks/priors_kinds.py            # the tables, a minute
    python benchmarks/priors_kinds.py --write    # the columns with _3 of benchmarks/predicted.csv
    python benchmarks/priors_kinds.py --page     # into docs/prediction_width.md

benchmarks/priors_fit.py has one model error for all devices that are not linear.  Here a device has one of three kinds
(column ``kind`` of benchmarks/real_devices.csv): ``linear``; ``loss``, with a stop or a storage capacitor, whose
further losses no source states; and ``spring``, with a nonlinear spring, which may have two responses.  Each kind
has a model error, and ``loss`` a median factor of the power, `Kinds.offset` its logarithm, which is a normal number
with a standard deviation of `OFFSET` before the fit.  The variance of the factor, by the curvature of the likelihood,
is part of an interval.
A device left out is in no number of its own fit; the kinds themselves were chosen with all devices known.
"""

import csv
import dataclasses
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from priors_fit import (
    FIRST_MODEL,
    HERE,
    LEAST_OWN,
    Fit,
    Number,
    alone,
    holds,
    interval,
    numbers,
    rows,
    shared,
    sigma,
    wilson,
)
from priors_limits import at_middle, has_width, judged, of_one_factor, two_digits, width
from scipy.optimize import minimize

from harvester.arrays import Floats
from harvester.studies.prediction import priors

PAGE = HERE.parent / "docs" / "prediction_width.md"
BEGIN, END = "<!-- by benchmarks/priors_kinds.py --page -->", "<!-- end -->"
KINDS = {row["device"]: row["kind"] for row in rows("real_devices.csv")}
TITLES = {"linear": "linear", "loss": "stop or storage capacitor", "spring": "nonlinear spring"}
OFFSET = 0.7
FIRST = np.log([1.0, 0.15, 0.5, 1.0])
Ends = tuple[float, float]


def kind_of(number: Number) -> str:
    """The kind of the device, or ``linear`` for a number of its linear part."""
    return "linear" if number.linear else KINDS[number.device]


@dataclass(frozen=True)
class Kinds:
    """The factor of the spreads, the model errors by kind, and the logarithm of the power's factor with its error."""

    factor: float
    linear: float
    loss: float
    spring: float
    offset: float
    offset_error: float

    def fit_of(self, number: Number) -> Fit:
        """The fit of priors_fit with the model error of the number's kind, which holds the factor's error."""
        loss = math.hypot(self.loss, self.offset_error)
        return Fit(self.factor, self.linear, loss if kind_of(number) == "loss" else self.spring)

    def moved(self, number: Number) -> Number:
        """The number with the factor of its kind in its median."""
        if kind_of(number) != "loss" or not has_width(number):
            return number
        factor = math.exp(self.offset * number.exponents[3])
        return dataclasses.replace(number, predicted=number.predicted * factor)

    def ends(self, number: Number) -> Ends:
        """The interval about the moved median."""
        return interval(self.moved(number), self.fit_of(number))


def loss(x: Floats, some: Sequence[Number], with_offset: bool) -> float:
    """Minus the logarithm of the posterior density of the fit's four logarithms and of the offset."""
    kinds = Kinds(*map(float, np.exp(x[:4])), float(x[4]) if with_offset else 0.0, 0.0)
    total = 0.5 * float(np.sum(((x[:4] - FIRST) / math.log(2.0)) ** 2))
    total += 0.5 * (float(x[4]) / OFFSET) ** 2
    for device in {number.device for number in some}:
        own = [kinds.moved(number) for number in some if number.device == device]
        off = np.array([math.log((number.measured or 1.0) / number.predicted) for number in own])
        parts = np.array([shared(number, kinds.fit_of(number)) for number in own])
        variances = [alone(number, kinds.fit_of(number)) for number in own]
        covariance = parts @ parts.T + np.diag(variances)
        total += 0.5 * float(off @ np.linalg.solve(covariance, off))
        total += 0.5 * float(np.linalg.slogdet(covariance)[1])
    return total


def fitted(some: Sequence[Number], with_offset: bool = True) -> Kinds:
    """The fit of the highest posterior density; the offset's error is that of its curvature."""
    done = minimize(
        loss,
        [*FIRST, 0.0],
        (some, with_offset),
        method="Nelder-Mead",
        options={"maxfev": 4000, "xatol": 1e-5, "fatol": 1e-7},
    )
    x = done.x
    if not with_offset:
        return Kinds(*map(float, np.exp(x[:4])), 0.0, 0.0)
    step = np.array([0.0, 0.0, 0.0, 0.0, 0.05])
    bends = loss(x + step, some, True) + loss(x - step, some, True) - 2.0 * done.fun
    error = 0.05 / math.sqrt(max(bends, 1e-12))
    return Kinds(*map(float, np.exp(x[:4])), float(x[4]), min(error, OFFSET))


def left_out(some: Sequence[Number], with_offset: bool = True) -> dict[str, Kinds]:
    """The fit for each device, on all others."""
    return {
        device: fitted([number for number in some if number.device != device], with_offset)
        for device in dict.fromkeys(number.device for number in some)
    }


def designs(some: Sequence[Number], fits: dict[str, dict[str, Kinds]]) -> Iterator[str]:
    """A row for each design and kind, the device left out, and the least common factor of each kind."""
    yield "| design | kind | hold | coverage (95 % of the binomial) | median width |"
    yield "|---|---|---|---|---|"
    for title, base, which in (
        ("model error by kind, about the median", some, "alone"),
        ("the same with the factor", some, "median"),
        ("with the factor, about the middle", at_middle(some), "middle"),
    ):
        chosen = [fits[which][number.device] for number in base]
        made = [
            (kinds.moved(number), kinds.ends(number))
            for kinds, number in zip(chosen, base, strict=True)
        ]
        yield from _by_kind(title, made)
        if which == "median":
            own = [(package().moved(number), package().ends(number)) for number in base]
            yield from list(_by_kind("the package, version 3, not independent", own))
        if which == "middle":
            ends = of_one_factor([number for number, _ in made], 0.9, leave_out=False)
            least = [(number, pair) for (number, _), pair in zip(made, ends, strict=True)]
            yield from list(_by_kind("the least factor that holds 90 % of them", least))[:1]


def package() -> Kinds:
    """The model errors of the data file of the package, which were fitted on these devices."""
    model = priors.data()["model"]
    offset = math.log(model["stop_factor"])
    return Kinds(1.0, model["linear"], model["stop"], model["nonlinear"], offset, 0.0)


def _by_kind(title: str, made: Sequence[tuple[Number, Ends]]) -> Iterator[str]:
    """A row of all numbers, and one of each kind."""
    for kind in ("", *TITLES):
        part = [pair for pair in made if kind in ("", kind_of(pair[0]))]
        cells = judged([number for number, _ in part], [ends for _, ends in part])
        yield f"| {title if not kind else ''} | {TITLES.get(kind, 'all')} | {cells} |"


def by_device(fits: dict[str, Kinds], some: Sequence[Number]) -> Iterator[str]:
    """A row for each device: the fit on the others, and the shares of the variance of its powers and voltages."""
    yield "| device | kind | factor of the power | open ranges | coupling | damping | model error | median width |"
    yield "|---|---|---|---|---|---|---|---|"
    for device, kinds in fits.items():
        for kind, title in TITLES.items():
            own = [n for n in some if n.device == device and kind_of(n) == kind and has_width(n)]
            if not own:
                continue
            shares = np.mean([_shares(number, kinds) for number in own], axis=0)
            factor = f"{math.exp(kinds.offset):.2f}" if kind == "loss" else ""
            cells = " | ".join(f"{100.0 * share:.0f} %" for share in shares)
            wide = two_digits(float(np.median([width(n, kinds.ends(n)) for n in own])))
            yield f"| {device} | {title} | {factor} | {cells} | {wide} |"


def _shares(number: Number, kinds: Kinds) -> list[float]:
    """Shares of the variance of a number: open ranges, coupling, damping, model error."""
    fit = kinds.fit_of(number)
    coupling, damping = shared(number, fit)
    whole = sigma(number, fit) ** 2
    return [x / whole for x in (number.own**2, coupling**2, damping**2, fit.model(number) ** 2)]


GROUPS = (
    ("resonance and damping at the level of use", ("measured",), ("measured", "given")),
    ("resonance; damping at a low level", ("measured",), ("measured_low",)),
    ("damping, but not the resonance", ("geometry",), ("measured", "given")),
    ("the resonance, but not the damping", ("measured",), ("unknown",)),
    ("neither", ("geometry",), ("unknown",)),
)


def by_source(fits: dict[str, Kinds], final: Kinds, every: Sequence[Number]) -> Iterator[str]:
    """A row for each degree of knowledge in the source: devices, numbers, held intervals and width."""
    about = {row["device"]: row for row in rows("real_devices.csv")}
    yield "| the source states | kind | devices | powers and voltages | hold | median width |"
    yield "|---|---|---|---|---|---|"
    for title, frequencies, dampings in GROUPS:
        for kind, kinds in (("linear", ("linear",)), ("nonlinear", ("loss", "spring"))):
            own = [
                number
                for number in every
                if about[number.device]["frequency"] in frequencies
                and about[number.device]["damping"] in dampings
                and kind_of(number) in kinds
                and has_width(number)
            ]
            if not own:
                continue
            ends = [fits.get(number.device, final).ends(number) for number in own]
            pairs = [pair for pair in zip(own, ends, strict=True) if pair[0].measured is not None]
            held = sum(holds(number, pair) for number, pair in pairs)
            wide = two_digits(
                float(np.median([width(n, pair) for n, pair in zip(own, ends, strict=True)]))
            )
            devices = ", ".join(dict.fromkeys(number.device for number in own))
            cells = f"{len(own)} | {held} of {len(pairs)} | {wide}"
            yield f"| {title} | {kind} | {devices} | {cells} |"


VERSIONS = {
    "first priors": "_1",
    "version 2: one model error for all nonlinear devices": "_2",
    "version 3: model error by kind, about the middle": "_3",
}


def measured_of_d9() -> dict[str, float]:
    """The measured values of the device D9 by their names."""
    kept = [row for row in rows("measured_later.csv") if row["device"] == "D9"]
    return {row["what"]: float(row["value"]) for row in kept}


def later() -> Iterator[str]:
    """A row for each version of the intervals, by the numbers of a device that is in no fit."""
    measured = measured_of_d9()
    kept = [row for row in rows("predicted.csv") if row["quantity"] in measured]
    yield "| intervals of D9 | hold | coverage (95 % of the binomial) | median width |"
    yield "|---|---|---|---|"
    for title, end in VERSIONS.items():
        ends = [(float(row[f"low{end}"]), float(row[f"high{end}"])) for row in kept]
        met = sum(
            low <= measured[row["quantity"]] <= high
            for row, (low, high) in zip(kept, ends, strict=True)
        )
        least, most = wilson(met, len(kept))
        wide = two_digits(float(np.median([(high / low) ** 2 for low, high in ends])))
        share = f"{100.0 * met / len(kept):.0f} % ({100.0 * least:.0f} to {100.0 * most:.0f})"
        yield f"| {title} | {met} of {len(kept)} | {share} | {wide} |"
    some = with_later()
    fits = left_out(some)
    moved = [fits[number.device].moved(number) for number in some]
    ends = [fits[number.device].ends(number) for number in some]
    yield f"| all devices with D9, each left out, about the median | {judged(moved, ends)} |"


def with_later() -> list[Number]:
    """All measured numbers, with those of the device that is in no other fit.

    Its first intervals have the priors and the first model error, which is taken out.
    """
    measured = measured_of_d9()
    some = [number for number in numbers() if number.measured is not None]
    for number in numbers():
        if number.quantity in measured:
            first = number.exponents[3] * FIRST_MODEL
            own = math.sqrt(max(number.own**2 - first**2, LEAST_OWN**2))
            value = measured[number.quantity]
            some.append(
                dataclasses.replace(
                    number, measured=value, own=own, with_priors=False, sigmas=(0.0, 0.0, 0.0)
                )
            )
    return some


def at_middles(every: Sequence[Number]) -> list[Number]:
    """The numbers about the middles of their first intervals; those of D1 to D8 as they are."""
    moved = at_middle(every)
    return [a if a.with_priors else b for a, b in zip(every, moved, strict=True)]


@dataclass(frozen=True)
class Everything:
    """All numbers about their middles, the fits that leave each device out, and the fit on all devices."""

    every: list[Number]
    some: list[Number]
    fits: dict[str, dict[str, Kinds]]
    final: Kinds


def computed() -> Everything:
    """All fits, which take half a minute."""
    every = at_middles(numbers())
    some = [number for number in numbers() if number.measured is not None]
    middle = at_middle(some)
    fits = {
        "alone": left_out(some, with_offset=False),
        "median": left_out(some),
        "middle": left_out(middle),
    }
    return Everything(every, some, fits, fitted(middle))


def block(results: Everything) -> list[str]:
    """The generated lines of the page."""
    final = results.final
    fits = results.fits["middle"]
    measured = [number for number in results.every if number.measured is not None]
    return [
        *designs(results.some, results.fits),
        "",
        *by_device(fits, measured),
        "",
        *by_source(fits, final, results.every),
        "",
        *later(),
        "",
        f"Fit on all devices: factor of the spreads {final.factor:.2f}; model error {100.0 * final.linear:.0f} % "
        f"(linear), {100.0 * final.loss:.0f} % (stop or storage capacitor) and "
        f"{100.0 * final.spring:.0f} % (nonlinear spring); "
        f"power with a stop or a storage capacitor {math.exp(final.offset):.2f} of the computed one, within "
        f"{100.0 * final.offset_error:.0f} % (standard deviation).",
    ]


def write(results: Everything) -> None:
    """The columns with _3: a device with measured values has the fit on the others, another the fit on all."""
    by_name = {(number.device, number.quantity): number for number in results.every}
    kept = rows("predicted.csv")
    for row in kept:
        number = by_name.get((row["device"], row["quantity"]))
        texts = [row["predicted"], row["low"], row["high"]]
        if number is not None:
            kinds = results.fits["middle"].get(row["device"], results.final)
            low, high = kinds.ends(number)
            texts = [f"{value:.4g}" for value in (kinds.moved(number).predicted, low, high)]
        row.update(zip(("predicted_3", "low_3", "high_3"), texts, strict=True))
    with (HERE / "predicted.csv").open("w", newline="") as file:
        out = csv.DictWriter(file, list(kept[0]), lineterminator="\n")
        out.writeheader()
        out.writerows(kept)


def main() -> None:
    """Print the tables; with --write and --page also write the columns and the page."""
    results = computed()
    lines = block(results)
    print(*lines, sep="\n")
    if "--write" in sys.argv:
        write(results)
    if "--page" in sys.argv:
        before, _, rest = PAGE.read_text().partition(BEGIN)
        PAGE.write_text("\n".join([f"{before}{BEGIN}", *lines, f"{END}{rest.partition(END)[2]}"]))


if __name__ == "__main__":
    main()
