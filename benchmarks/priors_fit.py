"""The fit of the priors of real devices, leave one device out: coverage, widths, figure and table.

    python benchmarks/priors_fit.py            # coverage and widths of each version of the priors
    python benchmarks/priors_fit.py --write    # the fitted columns into benchmarks/predicted.csv
    python benchmarks/priors_fit.py --page     # table and figure of docs/prediction_fit.md

The logarithm of measured over predicted is a sum of normal numbers: the spread that the first prediction had from the
open ranges of its source, coupling and damping, which all quantities of a device share, the frequency, and a model
error of each quantity.  Three numbers are fitted by maximum likelihood on all devices but one: ``factor``, by which
the spreads of coupling and damping in priors.toml are multiplied, and the standard deviations of the logarithm of a
power, ``linear`` for a linear device on a resistor or a bridge, and ``nonlinear`` for one with a stop, a nonlinear
spring or a store.  The device left out judges them.  The exponents of a quantity follow from its unit (`EXPONENTS`); a
device is in the fit as soon as benchmarks/measured.csv has its values.
"""

import csv
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from harvester.arrays import Floats
from harvester.studies.prediction import priors
from harvester.studies.prediction.priors import prior_of

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "prediction_fit.md"
FIGURE = HERE.parent / "docs" / "predicted.png"
BEGIN = "<!-- by benchmarks/priors_fit.py --page -->"
END = "<!-- end -->"
HALF = 1.96  # standard deviations of a 95 % interval
FIRST_MODEL = 0.15
LEAST_OWN = 0.005  # of an interval that has no width, as a frequency's
# Exponents of coupling, damping, frequency and model error, by the end of the unit.
EXPONENTS = {
    "Hz": (0.0, 0.0, 1.0, 0.0),
    "V": (1.0, -0.5, 0.0, 0.5),
    "V/g": (1.0, -0.5, 0.0, 0.5),
    "V peak to peak": (1.0, -0.5, 0.0, 0.5),
    "W": (2.0, -1.0, 0.0, 1.0),
    "ohm": (0.0, 0.5, 0.0, 0.5),
}


@dataclass(frozen=True)
class Number:
    """A quantity with its first prediction, its measured value (None: not public) and its exponents."""

    device: str
    quantity: str
    unit: str
    predicted: float
    own: float  # standard deviation of the logarithm in the first prediction
    linear: bool
    with_priors: bool  # whether the first prediction has the first priors in it
    measured: float | None
    half_digit: float
    exponents: tuple[float, float, float, float]
    sigmas: tuple[float, float, float]


def sigma_of(quantity: str, origin: str, device_class: str) -> float:
    """The prior's standard deviation; 0 for a number that is given."""
    prior = prior_of(quantity, origin, device_class)
    return 0.0 if prior is None or prior.sigma is None else prior.sigma


def rows(name: str) -> list[dict[str, str]]:
    """The rows of a file here."""
    with (HERE / name).open(newline="") as file:
        return list(csv.DictReader(file))


def numbers() -> list[Number]:
    """Every predicted quantity whose unit has exponents."""
    measured = {(row["device"], row["what"]): row["value"] for row in rows("measured.csv")}
    devices = {row["device"]: row for row in rows("real_devices.csv")}
    made = []
    for row in rows("predicted.csv"):
        kind = max((end for end in EXPONENTS if row["unit"].endswith(end)), key=len, default=None)
        if kind is None:
            continue
        about = devices[row["device"]]
        sigmas = tuple(
            sigma_of(name, about[name], about["class"])
            for name in ("coupling", "damping", "frequency")
        )
        text = measured.get((row["device"], row["quantity"]))
        low, high = float(row["low"]), float(row["high"])
        made.append(
            Number(
                device=row["device"],
                quantity=row["quantity"],
                unit=row["unit"],
                predicted=float(row["predicted"]),
                own=max(math.log(high / low) / (2.0 * HALF), LEAST_OWN),
                linear=any(
                    part == "all" or part in row["quantity"] for part in about["linear"].split(";")
                ),
                with_priors=row["device"].startswith("D"),
                measured=None if text is None else float(text),
                half_digit=0.0 if text is None else 0.5 * 10.0 ** -len(text.partition(".")[2]),
                exponents=EXPONENTS[kind],
                sigmas=(sigmas[0], sigmas[1], sigmas[2]),
            )
        )
    return made


@dataclass(frozen=True)
class Fit:
    """The factor of the spreads of coupling and damping, and the model errors of a power."""

    factor: float
    linear: float
    nonlinear: float

    def model(self, number: Number) -> float:
        """The standard deviation of the logarithm of a number for the model error."""
        return number.exponents[3] * (self.linear if number.linear else self.nonlinear)


FIRST = Fit(1.0, FIRST_MODEL, FIRST_MODEL)


def shared(number: Number, fit: Fit) -> tuple[float, float]:
    """The standard deviations that a quantity shares with the others of its device, of coupling and damping."""
    coupling, damping = (
        fit.factor * exponent * sigma
        for exponent, sigma in zip(number.exponents[:2], number.sigmas[:2], strict=True)
    )
    return coupling, damping


def alone(number: Number, fit: Fit) -> float:
    """The variance that a quantity has for itself: open ranges, frequency, model error."""
    frequency = number.exponents[2] * number.sigmas[2]
    return number.own**2 + frequency**2 + fit.model(number) ** 2


def sigma(number: Number, fit: Fit) -> float:
    """The standard deviation of the logarithm of measured over predicted."""
    if number.with_priors:  # its first interval has the priors and the first model error
        first = (number.exponents[3] * FIRST_MODEL) ** 2
        rest = max(number.own**2 - first, 0.0)
        scale = fit.factor if number.exponents[0] else 1.0
        return math.hypot(scale * math.sqrt(rest), fit.model(number))
    return math.sqrt(alone(number, fit) + sum(part**2 for part in shared(number, fit)))


def log_likelihood(some: Sequence[Number], fit: Fit) -> float:
    """The measured values, each device a normal vector."""
    total = 0.0
    for device in {number.device for number in some}:
        own = [number for number in some if number.device == device]
        off = np.array([math.log((number.measured or 1.0) / number.predicted) for number in own])
        if own[0].with_priors:
            covariance = np.diag([sigma(number, fit) ** 2 for number in own])
        else:
            parts = np.array([shared(number, fit) for number in own])
            covariance = parts @ parts.T + np.diag([alone(number, fit) for number in own])
        total -= 0.5 * float(off @ np.linalg.solve(covariance, off))
        total -= 0.5 * float(np.linalg.slogdet(covariance)[1])
    return total


def fitted(some: Sequence[Number]) -> Fit:
    """The fit with the highest likelihood, with a lognormal prior of a factor 2 about the first numbers."""
    first = np.log([FIRST.factor, FIRST.linear, FIRST.nonlinear])

    def loss(logs: Floats) -> float:
        fit = Fit(*map(float, np.exp(logs)))
        return 0.5 * float(np.sum(((logs - first) / math.log(2.0)) ** 2)) - log_likelihood(
            some, fit
        )

    return Fit(*map(float, np.exp(minimize(loss, first, method="Nelder-Mead").x)))


def interval(number: Number, fit: Fit) -> tuple[float, float]:
    """The ends of the interval of 95 %."""
    reach = math.exp(HALF * sigma(number, fit))
    return number.predicted / reach, number.predicted * reach


def holds(number: Number, ends: tuple[float, float]) -> bool:
    """Whether the measured value is in the interval, as far as its digits tell."""
    assert number.measured is not None, "it has a measured value"
    return ends[0] - number.half_digit <= number.measured <= ends[1] + number.half_digit


def wilson(met: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927)."""
    share, z2 = met / count, HALF**2
    middle = share + 0.5 * z2 / count
    width = HALF * math.sqrt(share * (1.0 - share) / count + 0.25 * z2 / count**2)
    return (middle - width) / (1.0 + z2 / count), (middle + width) / (1.0 + z2 / count)


def left_out(some: Sequence[Number]) -> dict[str, Fit]:
    """The fit for each device, on all others."""
    return {
        device: fitted([number for number in some if number.device != device])
        for device in dict.fromkeys(number.device for number in some)
    }


def summary(title: str, some: Sequence[Number], fits: Mapping[str, Fit]) -> list[str]:
    """A row of the table: how many intervals hold, and the median widths of power and voltage."""
    ends = [interval(number, fits[number.device]) for number in some]
    return _summary(title, some, ends)


def _summary(title: str, some: Sequence[Number], ends: Sequence[tuple[float, float]]) -> list[str]:
    met = sum(holds(number, pair) for number, pair in zip(some, ends, strict=True))
    low, high = wilson(met, len(some))
    # The width of a voltage counts as that of its power, squared.
    widths = [
        (pair[1] / pair[0]) ** (2.0 / (2.0 * number.exponents[3]) if number.exponents[3] else 1.0)
        for number, pair in zip(some, ends, strict=True)
        if number.exponents[3] and not number.unit.endswith("ohm")
    ]
    return [
        title,
        f"{met} of {len(some)}",
        f"{100.0 * met / len(some):.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})",
        f"{np.median(widths):.2g}",
    ]


def table(some: Sequence[Number], fits: Mapping[str, Fit]) -> list[str]:
    """Coverage and widths: open ranges alone, the first priors, and the fit that leaves each device out."""
    first = dict.fromkeys((number.device for number in some), FIRST)
    reach = [math.exp(HALF * number.own) for number in some]
    as_made = [
        (number.predicted / far, number.predicted * far)
        for number, far in zip(some, reach, strict=True)
    ]
    model = priors.data()["model"]
    of_package = dict.fromkeys(first, Fit(1.0, model["linear"], model["nonlinear"]))
    kinds = (
        _summary("open ranges of the source alone", some, as_made),
        summary("first priors", some, first),
        summary(
            "version 2 of the package, not independent: fitted on these devices", some, of_package
        ),
        summary("fitted, each device left out", some, fits),
        *(
            summary(f"the same, {name} numbers", part, fits)
            for name, part in (
                ("linear", [number for number in some if number.linear]),
                ("nonlinear", [number for number in some if not number.linear]),
            )
        ),
    )
    return [
        "| intervals | hold | coverage (95 % of the binomial) | median width of a power, high over low |",
        "|---|---|---|---|",
        *(f"| {' | '.join(cells)} |" for cells in kinds),
    ]


def by_device(some: Sequence[Number], fits: Mapping[str, Fit]) -> Iterator[str]:
    """A row for each device: the fit on the others, and how many of its intervals hold."""
    yield "| device | factor | model error, linear | model error, nonlinear | hold |"
    yield "|---|---|---|---|---|"
    for device, fit in fits.items():
        own = [number for number in some if number.device == device]
        met = sum(holds(number, interval(number, fit)) for number in own)
        errors = f"{100.0 * fit.linear:.0f} % | {100.0 * fit.nonlinear:.0f} %"
        yield f"| {device} | {fit.factor:.2f} | {errors} | {met} of {len(own)} |"


def draw(some: Sequence[Number], fits: Mapping[str, Fit]) -> None:
    """Measured over predicted, with the interval of each number: docs/predicted.png."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 5.0), layout="constrained")
    scale = {"uW": 1e-6, "mW": 1e-3, "mV": 1e-3, "V": 1.0, "Hz": 1.0, "kohm": 1e3}
    kinds = {"Hz": "frequency (Hz)", "V": "voltage (V)", "W": "power (W)", "ohm": "load (ohm)"}
    for at, (end, label) in enumerate(kinds.items()):
        own = [number for number in some if number.unit.endswith(end)]
        if not own:
            continue
        factors = np.array([scale.get(number.unit, 1.0) for number in own])
        values = np.array([number.predicted for number in own]) * factors
        ends = np.array([interval(number, fits[number.device]) for number in own])
        ends *= factors[:, None]
        measured = np.array([number.measured or math.nan for number in own]) * factors
        errors = np.abs(ends.T - values)
        axes.errorbar(
            measured, values, errors, fmt="osD^"[at], ms=4, lw=0.8, color=f"C{at}", label=label
        )
    ends_of = np.array(axes.get_xlim())
    axes.plot([1e-7, 1e6], [1e-7, 1e6], color="0.5", lw=0.8)
    axes.set(xscale="log", yscale="log", xlabel="measured", ylabel="predicted, 95 % interval")
    axes.set_xlim(1e-5, max(ends_of[1], 3e5))
    axes.set_ylim(1e-5, max(ends_of[1], 3e5))
    axes.legend()
    figure.savefig(FIGURE, dpi=110, metadata={"Software": None})


def write(fits: Mapping[str, Fit], final: Fit) -> None:
    """The columns of the fit: a device with measured values has the fit on the others, another the fit on all."""
    by_name = {(number.device, number.quantity): number for number in numbers()}
    kept = rows("predicted.csv")
    for row in kept:
        number = by_name.get((row["device"], row["quantity"]))
        ends = None if number is None else interval(number, fits.get(row["device"], final))
        texts = [
            row["predicted"],
            *([row["low"], row["high"]] if ends is None else [f"{end:.4g}" for end in ends]),
        ]
        row.update(zip(("predicted_2", "low_2", "high_2"), texts, strict=True))
    with (HERE / "predicted.csv").open("w", newline="") as file:
        out = csv.DictWriter(file, list(kept[0]), lineterminator="\n")
        out.writeheader()
        out.writerows(kept)


def main() -> None:
    """Print the table; with --write and --page also write the columns, the page and the figure."""
    some = [number for number in numbers() if number.measured is not None]
    fits, final = left_out(some), fitted(some)
    lines = [
        *table(some, fits),
        "",
        *by_device(some, fits),
        "",
        f"Fit on all devices: factor {final.factor:.2f}; model error {100.0 * final.linear:.0f} % "
        f"(linear) and {100.0 * final.nonlinear:.0f} % (nonlinear).",
    ]
    print(*lines, sep="\n")
    if "--write" in sys.argv:
        write(fits, final)
    if "--page" in sys.argv:
        before, _, rest = PAGE.read_text().partition(BEGIN)
        PAGE.write_text("\n".join([f"{before}{BEGIN}", *lines, f"{END}{rest.partition(END)[2]}"]))
        draw(some, fits)


if __name__ == "__main__":
    main()
