"""Predictions of fifteen measured cantilevers (D10 to D24) from their inputs alone, and later their judgement.

    python benchmarks/unseen_cantilevers.py            # prints them, half a minute
    python benchmarks/unseen_cantilevers.py D13 D18    # these devices alone
    python benchmarks/unseen_cantilevers.py --write    # also into benchmarks/predicted.csv
    python benchmarks/unseen_cantilevers.py --judge    # against benchmarks/measured_later.csv; --page: into the page

The inputs and the geometry: benchmarks/cantilevers.py.  The spreads are the priors of the package, by class and by
the origin of each number; the model error is that of a linear device.  Each device is shaken at the frequency of its
largest power at that load, as the source tuned it, and the measured resonance with the mass sets the stiffness:

- a tip mass that the source states is that; another follows from the stiffness of the geometry and the resonance,
  and inherits the spread of that stiffness;
- where stated mass and resonance ask for another stiffness than the geometry gives (``frequency_ratio``), length or
  thickness differ, and the coupling has the cube root of that of the stiffnesses, as k ~ h^3/L^3 and theta ~ h/L;
- a damping that was measured is from the width of a resonance, of the power or of the voltage, with or without the
  load, each with half of the devices where the source leaves that open.

What the source leaves open is a prior (`CHOICES`).  Where it calls its load the best, devices count by how little more
they give at half or twice that load: 1/(1 + (d/0.1)^2), with d the logarithm of the most power over that at the load.
"""

import math
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import unseen
from cantilevers import TURN, built, mode, table, wired
from priors_fit import rows, wilson
from priors_limits import two_digits
from scipy.stats import norm

from harvester.arrays import Floats
from harvester.linear.single_points import LinearDevice
from harvester.quantities.kinds import ACCELERATION, RESISTANCE
from harvester.studies.prediction.priors import data, prior_of
from harvester.studies.tolerance.design import sobol_points

PAGE = Path(__file__).parent.parent / "docs" / "prediction_width.md"
BEGIN, END = "<!-- by benchmarks/unseen_{}.py --page -->", "<!-- end -->"
DRAWS = 1024
FLAT = 0.1  # of the logarithm of a power: how well a best load is known
LEAST_LEFT = 0.2  # of a measured loss that the load does not explain
NORMALS = ("frequency", "damping", "coupling", "capacitance", "model")
# Uniform numbers for what is open, and the share of the devices that the second of two cases has.
CHOICES = {
    "power": 0.5,  # the largest instantaneous power, twice the mean
    "acceleration": 0.2,  # an rms value
    "wiring": 0.5,  # two layers in parallel
    "loaded": 0.5,  # a resonance's width is at the load
    "curve": 0.5,  # it is that of the voltage at half of its peak, not of the power
    "mass": 0.5,  # the stated mass is not the tip's
}
PLACES = ("swap", "block", "reach", "begin", "piezo", "piezo_um")
SCALES = {"uW": 1e6, "V": 1.0, "V peak to peak": 2.0, "mV peak to peak": 2e3, "mm": 1e3}


@dataclass(frozen=True)
class Device:
    """A device of the priors at its source's load: the linear mode, and the mass's displacement over the mode's."""

    linear: LinearDevice
    resistance: float
    acceleration: float
    tip: float

    def peak(self) -> float:
        """The voltage amplitude at the load (V)."""
        return math.sqrt(
            2.0 * self.resistance * self.linear.power(self.resistance, self.acceleration)
        )

    def amplitude(self) -> float:
        """The displacement amplitude of the mass (m) at the load: |V| |1/R + i w C| = theta w |X|."""
        one = self.linear
        current = self.peak() * math.hypot(1.0 / self.resistance, one.frequency * one.capacitance)
        return self.tip * current / (one.coupling * one.frequency)

    def flatness(self) -> float:
        """The logarithm of the most power at half, once and twice the load, over that at the load."""
        powers = [
            self.linear.power(factor * self.resistance, self.acceleration)
            for factor in (1.0, 0.5, 2.0)
        ]
        return math.log(max(powers) / powers[0])


def sigma(row: Mapping[str, str], quantity: str) -> float:
    """The standard deviation of the logarithm of a quantity, by the class and the origin in the table."""
    prior = prior_of(quantity, row.get(f"{quantity}_known", "geometry"), row["class"])
    assert prior is not None and prior.sigma is not None, quantity
    return prior.sigma


def device(row: Mapping[str, str], of: Mapping[str, float]) -> Device:
    """A device of a row; ``of`` has a number for each of `NORMALS`, and whether or where, for what is open."""
    beam = built(row, of)
    shape = mode(beam)
    w = TURN * float(row["frequency_hz"])
    by_geometry = shape.stiffness * math.exp(2.0 * sigma(row, "frequency") * of["frequency"])
    if row["tip_mass_g"] and not ("mass" in row["open"] and of["mass"]):
        tip_mass = 1e-3 * float(row["tip_mass_g"])
    else:
        tip_mass = max(by_geometry / w**2 - shape.second, 0.0)
    modal = tip_mass + shape.second
    share = (tip_mass + shape.first) / modal
    theta, capacitance = wired(shape.couplings, beam.capacitances, bool(of["wiring"]))
    theta *= share * (modal * w**2 / shape.stiffness) ** (1.0 / 3.0)
    theta *= math.exp(sigma(row, "coupling") * of["coupling"])
    capacitance *= math.exp(sigma(row, "capacitance") * of["capacitance"])
    mass = share**2 * modal
    resistance = RESISTANCE.read(row["load"])
    loss = mechanical_loss(
        row, of, theta**2 / (mass * w**2 * capacitance), w * resistance * capacitance
    )
    acceleration = ACCELERATION.read(row["acceleration"])
    rms = "acceleration" in row["open"] and of["acceleration"]
    return Device(
        linear=LinearDevice(mass, w, 1.0 / loss, capacitance, theta),
        resistance=resistance,
        acceleration=acceleration * (math.sqrt(2.0) if rms else 1.0),
        tip=share,
    )  # fmt: skip


def mechanical_loss(
    row: Mapping[str, str], of: Mapping[str, float], beta: float, load: float
) -> float:
    """1/Q: of the prior of the class, or of the measured width without the part beta r/(1 + r^2) of a load r."""
    spread = math.exp(sigma(row, "damping") * of["damping"])
    if not row["bandwidth_hz"]:
        prior = prior_of("damping", "unknown", row["class"])
        assert prior is not None and prior.median is not None, "the class has a median"
        return 2.0 * prior.median * spread
    width = float(row["bandwidth_hz"]) / float(row["frequency_hz"])
    if "curve" in row["open"] and of["curve"]:
        width /= math.sqrt(3.0)
    by_load = beta * load / (1.0 + load**2) if of["loaded"] else 0.0
    return max(width - by_load, LEAST_LEFT * width) * spread


def drawn(seed: int) -> list[dict[str, float]]:
    """The numbers of each device of the priors."""
    u = sobol_points(DRAWS, len(NORMALS) + len(CHOICES) + len(PLACES), seed)
    normal = norm.ppf(u[:, : len(NORMALS)])
    chosen = u[:, len(NORMALS) : len(NORMALS) + len(CHOICES)] < np.array([*CHOICES.values()])
    values = np.concatenate([normal, chosen, u[:, len(NORMALS) + len(CHOICES) :]], axis=1)
    names = (*NORMALS, *CHOICES, *PLACES)
    return [dict(zip(names, map(float, line), strict=True)) for line in values]


def value(name: str, one: Device, twice: bool) -> float:
    """A quantity in SI units: a power, a voltage amplitude without load, or the amplitude of the tip."""
    if name.startswith("p_"):
        return one.linear.power(one.resistance, one.acceleration) * (2.0 if twice else 1.0)
    if name.startswith("v_open"):
        return one.linear.open_voltage(one.acceleration)
    return one.amplitude()


@dataclass(frozen=True)
class Sample:
    """The values of a quantity over the devices of the priors, and the weight of each device."""

    quantity: str
    unit: str
    values: Floats
    weights: Floats

    def quantiles(self, shares: Sequence[float] = (0.5, 0.025, 0.975)) -> list[float]:
        """Median, low and high end: the values below which a device has these shares of the weight."""
        order = np.argsort(self.values)
        weights = self.weights[order]
        below = (np.cumsum(weights) - 0.5 * weights) / weights.sum()
        return [float(math.exp(x)) for x in np.interp(shares, below, np.log(self.values[order]))]


def samples(row: Mapping[str, str], seed: int = 1) -> Iterator[Sample]:
    """Each quantity of a row."""
    draws = drawn(seed)
    devices = [device(row, of) for of in draws]
    weights = np.ones(len(devices))
    if row["load_known"] == "optimum":
        off = np.array([one.flatness() for one in devices])
        weights = 1.0 / (1.0 + (off / FLAT) ** 2)
    model = float(data()["model"]["linear"]) * np.array([of["model"] for of in draws])
    for text in row["quantities"].split("; "):
        name, _, unit = text.partition(" ")
        found = np.array(
            [
                value(name, one, "power" in row["open"] and bool(of["power"]))
                for one, of in zip(devices, draws, strict=True)
            ]
        )
        exponent = 1.0 if name.startswith("p_") else 0.5
        yield Sample(
            f"{row['device']}.{name}", unit, SCALES[unit] * found * np.exp(exponent * model), weights
        )  # fmt: skip


def frequency_ratio(row: Mapping[str, str]) -> str:
    """Resonance of the geometry with the stated mass over the measured one, as in the table: ``|`` if it is open.

    It is empty for a mass that follows from the resonance.
    """
    if row["mass_known"] != "stated":
        return ""
    ratios = []
    for swap in (0.75, 0.25) if "swap" in row["open"] else (0.75,):
        shape = mode(built(row, dict.fromkeys(PLACES, 0.5) | {"swap": swap}))
        modal = 1e-3 * float(row["tip_mass_g"]) + shape.second
        made = math.sqrt(shape.stiffness / modal) / TURN
        ratios.append(f"{made / float(row['frequency_hz']):.2f}")
    return "|".join(ratios)


# --- The judgement -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Judged:
    """A quantity with its prediction and its measured value."""

    device: str
    quantity: str
    unit: str
    predicted: float
    low: float
    high: float
    measured: str

    @property
    def holds(self) -> bool:
        """Whether the measured value is in the interval, as far as its digits tell."""
        half_digit = 0.5 * 10.0 ** -len(self.measured.partition(".")[2])
        return self.low - half_digit <= float(self.measured) <= self.high + half_digit

    @property
    def width(self) -> float:
        """The high end over the low end, of an amplitude squared."""
        return (self.high / self.low) ** (1.0 if self.unit.endswith("W") else 2.0)


def judged(devices: Collection[str]) -> list[Judged]:
    """The quantities of devices that have a measured value; the script ends if there is none."""
    measured = {(one["device"], one["what"]): one["value"] for one in rows("measured_later.csv")}
    found = [
        Judged(
            device=one["device"],
            quantity=one["quantity"],
            unit=one["unit"],
            predicted=float(one["predicted"]),
            low=float(one["low"]),
            high=float(one["high"]),
            measured=measured[one["device"], one["quantity"]],
        )
        for one in rows("predicted.csv")
        if one["device"] in devices and measured.get((one["device"], one["quantity"]))
    ]
    if not found:
        sys.exit(
            f"benchmarks/measured_later.csv must have values of {', '.join(devices)}, but has none yet"
        )
    return found


def judgement(some: Sequence[Judged]) -> Iterator[str]:
    """The lines of the page: a row for each quantity."""
    yield "| number | predicted | 95 % of devices | measured | measured over predicted | holds |"
    yield "|---|---|---|---|---|---|"
    for one in some:
        cells = f"{one.predicted:g} {one.unit} | {two_digits(one.low)} to {two_digits(one.high)}"
        off = two_digits(float(one.measured) / one.predicted)
        holds = "yes" if one.holds else "no"
        yield f"| {one.quantity} | {cells} | {one.measured} | {off} | {holds} |"


def by_group(some: Sequence[Judged]) -> Iterator[str]:
    """The lines of the page: coverage and width of the cantilevers by class and by damping."""
    yield ""
    yield "| devices | hold | coverage (95 % of the binomial) | median width of a power |"
    yield "|---|---|---|---|"
    devices = table()
    groups = {"all": some}
    for name in ("class", "damping_known"):
        for key in dict.fromkeys(row[name] for row in devices.values()):
            title = f"damping {key}" if name == "damping_known" else key
            groups[title] = [one for one in some if devices[one.device][name] == key]
    for title, part in groups.items():
        if not part:
            continue
        met = sum(one.holds for one in part)
        low, high = wilson(met, len(part))
        width = two_digits(float(np.median([one.width for one in part])))
        coverage = f"{100.0 * met / len(part):.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f})"
        yield f"| {title} | {met} of {len(part)} | {coverage} | {width} |"


def judge(script: str, lines: Sequence[str], into_page: bool) -> None:
    """Print the lines of a judgement, and put them between the markers of the script in the page."""
    print(*lines, sep="\n")
    if into_page:
        begin = BEGIN.format(script)
        before, marker, rest = PAGE.read_text().partition(begin)
        if not marker:
            sys.exit(f"{PAGE.name} must have the line {begin}, but lacks it")
        PAGE.write_text("\n".join([f"{before}{begin}", *lines, f"{END}{rest.partition(END)[2]}"]))


def main() -> None:
    """Compute, print, and with --write write the rows; with --judge compare them with the measured values."""
    if "--judge" in sys.argv:
        some = judged(table())
        judge("cantilevers", [*judgement(some), *by_group(some)], "--page" in sys.argv)
        return
    names = [name for name in sys.argv[1:] if not name.startswith("-")]
    made = []
    for row in table().values():
        if names and row["device"] not in names:
            continue
        for one in samples(row):
            cells = [f"{x:.4g}" for x in one.quantiles()]
            print(f"{one.quantity:24} {cells[0]} ({cells[1]} to {cells[2]}) {one.unit}", flush=True)
            made.append([row["device"], one.quantity, *cells, one.unit])
    if "--write" in sys.argv:
        unseen.write(made)


if __name__ == "__main__":
    main()
