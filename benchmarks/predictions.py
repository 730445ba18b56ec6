"""Measured devices that nobody fitted here: what the package predicts, with an interval, beside what was measured.

    .venv/bin/python benchmarks/predictions.py              # predictions computed now, beside the measured values
    .venv/bin/python benchmarks/predictions.py jiang        # of one device
    .venv/bin/python benchmarks/predictions.py --write      # into benchmarks/predicted.csv
    .venv/bin/python benchmarks/predictions.py --table      # those beside benchmarks/measured.csv, at once
    .venv/bin/python benchmarks/predictions.py --page       # the same, into docs/validation.md

What a source leaves open (a restitution, a damping that it prints to one digit) is a spread, not a choice: the scene is
computed for `DRAWS` points of a Latin square over all of them; the prediction is their median, the interval has 95 % of
their values.  It has no other error of the model in it.  benchmarks/predicted.csv keeps the predictions as they were
before the measured values (benchmarks/measured.csv) were written down.  docs/validation.md says what each source gave.
"""

import csv
import dataclasses
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import viaduct
from scipy.stats import qmc

import harvester as hv
from harvester.arrays import Floats

HERE = Path(__file__).parent
SCENES = HERE.parent / "examples" / "published"
PAGE = HERE.parent / "docs" / "validation.md"
BEGIN, END = "<!-- by benchmarks/predictions.py --page -->", "<!-- end -->"
G = 9.80665
DRAWS = 12
Spreads = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Prediction:
    """A quantity of a device: the median, and the interval with 95 % of what the open parameters allow."""

    device: str
    what: str
    unit: str
    value: float
    low: float
    high: float


def drawn(spreads: Spreads, count: int = DRAWS) -> list[dict[str, float]]:
    """Points of a Latin square over the spreads, evenly between the ends of each."""
    unit = qmc.LatinHypercube(len(spreads), rng=np.random.default_rng(1)).random(count)
    return [
        {
            key: low + u * (high - low)
            for (key, (low, high)), u in zip(spreads.items(), row, strict=True)
        }
        for row in unit
    ]


def predicted(
    device: str,
    spreads: Spreads,
    units: Mapping[str, str],
    of: Callable[[dict[str, float]], Mapping[str, float]],
) -> Iterator[Prediction]:
    """A prediction for each quantity that ``of`` computes from a draw."""
    found = [of(draw) for draw in drawn(spreads)]
    for what, unit in units.items():
        low, value, high = np.nanquantile([one[what] for one in found], (0.025, 0.5, 0.975))
        yield Prediction(device, what, unit, float(value), float(low), float(high))


@dataclass(frozen=True)
class Branch:
    """Ascending frequencies, and the amplitude of the voltage there, sqrt(2) times rms, on the way up or down."""

    frequency: Floats
    voltage: Floats

    @property
    def end(self) -> float:
        """The highest frequency of its upper branch: before its steepest fall."""
        return float(self.frequency[int(np.argmin(np.diff(self.voltage)))])


def branches(scene: hv.Scene, frequencies: Floats) -> dict[str, Branch]:
    """The response up the frequencies and down again."""
    curve = hv.response(scene, tuple(float(f) for f in frequencies))
    return {
        way: Branch(
            np.array([point.frequency for point in curve.sweep(way)]),
            math.sqrt(2.0) * np.array([point.voltage_rms.value for point in curve.sweep(way)]),
        )
        for way in ("up", "down")
    }


# --- Peigney and Siegert 2013: a bridge, its traffic, and a storage capacitor -----------------------------------------

# lorries a second by day, and the mean peak of one (m/s^2); of each the length is 1 s
RATE = 1.0 / 3.6
PEAK = 0.58


def traffic_density(frequency: Floats) -> Floats:
    """One-sided density ((m/s^2)^2/Hz) of the source's random train of lorries (its Eq. 27).

    A lorry is a triangle of half-length M = 1 s times a sine of 14.5 Hz and of peak A, and there
    are ``RATE`` a second: 2 rate A^2 (M/2)^2 sinc^4(M (f - 14.5 Hz)), whose mean square is rate A^2
    M/3.
    """
    return 0.5 * RATE * PEAK**2 * np.sinc(frequency - 14.5) ** 4


def rectified_current(damping: float) -> Callable[[float], float]:
    """Mean current (A) of an ideal bridge against its voltage (V), in the traffic of `traffic_density`."""
    scene = hv.load(SCENES / "peigney_siegert_2013_store.toml").varied(
        {"oscillator.damping": damping}
    )
    at = []
    for resistance in (1e5, 2e5, 4e5):
        power = (
            hv.Ideal(within=0.03)
            .run(scene.varied({"load.parameters.R": resistance}))
            .mean_power.value
        )
        at.append((math.sqrt(power * resistance), math.sqrt(power / resistance)))
    voltages, currents = zip(*at, strict=True)
    line = np.polyfit(voltages, currents, 1)
    return lambda voltage: float(np.polyval(line, voltage))


def peigney() -> Iterator[Prediction]:
    """A sine on a resistor; then traffic, a bridge of diodes and a store between 1.8 and 3.6 V."""
    scene = hv.load(SCENES / "peigney_siegert_2013.toml")
    dampings = (0.015, 0.02, 0.025)
    currents = [rectified_current(damping) for damping in dampings]
    rms = math.sqrt(RATE * PEAK**2 / 3.0)

    def of(draw: dict[str, float]) -> dict[str, float]:
        top = hv.response(
            scene.varied({"oscillator.damping": draw["damping"]}), "13.5Hz:15.5Hz:41"
        ).peak("up")
        # an ideal bridge on a linear device: I(U; level) = level I(U/level; 1)
        level = draw["rms"] / rms
        middle = 2.7
        some = [level * current((middle + draw["drop"]) / level) for current in currents]
        return {
            "most power on 100 kohm, sine": 1e3 * top.mean_power.value,
            "its frequency": top.frequency,
            "power into the storage, traffic": 1e6
            * middle
            * float(np.interp(draw["damping"], dampings, some)),
        }

    # The damping has one digit in the source; the traffic's rms is that of its model (0.177) or of
    # its records (0.30); two diodes in series drop 0.2 (Schottky) to 1.2 V.
    spreads = {"damping": (0.015, 0.025), "rms": (0.177, 0.30), "drop": (0.2, 1.2)}
    units = {
        "most power on 100 kohm, sine": "mW",
        "its frequency": "Hz",
        "power into the storage, traffic": "uW",
    }
    yield from predicted("peigney", spreads, units, of)


# --- Liu et al. 2011 and Jiang et al. 2020: a mass that hits a stop ---------------------------------------------------


def liu() -> Iterator[Prediction]:
    """How far up in frequency the mass goes on hitting its package, and the voltage there."""
    scene = hv.load(SCENES / "liu_2011.toml")

    def of(draw: dict[str, float]) -> dict[str, float]:
        here = scene.varied(draw)
        up = branches(here, np.arange(30.0, 56.1, 1.0))["up"]
        weak = branches(
            here.vary("excitation.acceleration_amplitude", 0.4 * G), np.arange(34.0, 46.1, 0.5)
        )["up"]
        return {
            "end of hitting, up, 0.4 g": weak.end,
            "end of hitting, up, 1 g": up.end,
            "voltage at 36 Hz, 1 g": 1e3
            * float(np.interp(36.0, up.frequency, up.voltage))
            / math.sqrt(2.0),
            "most voltage, 1 g": 1e3 * float(up.voltage.max()) / math.sqrt(2.0),
        }

    # The source says nothing of the impacts; 5 % of the spacer's thickness is our guess of what
    # assembling leaves.
    spreads = {"stop.restitution": (0.1, 0.9), "stop.gap": (0.764e-3, 0.844e-3)}
    units = dict.fromkeys(("end of hitting, up, 0.4 g", "end of hitting, up, 1 g"), "Hz")
    yield from predicted(
        "liu", spreads, units | {"voltage at 36 Hz, 1 g": "mV", "most voltage, 1 g": "mV"}, of
    )


def jiang() -> Iterator[Prediction]:
    """The largest voltage that the stopper leaves, and the band with 5 V or more, at 0.4 g; the best load at 0.1 g."""
    scene = hv.load(SCENES / "jiang_2020.toml")

    def of(draw: dict[str, float]) -> dict[str, float]:
        here = scene.varied(draw)
        up = branches(here, np.arange(7.0, 17.1, 1.0))["up"]
        enough = up.frequency[up.voltage >= 5.0]
        loads = np.geomspace(5e3, 2e5, 41)
        linear = dataclasses.replace(here, stop=None).vary(
            "excitation.acceleration_amplitude", 0.08 * G
        )
        powers = [
            hv.run(linear.with_load(resistance=float(R)), "exact").mean_power.value for R in loads
        ]
        return {
            "most voltage, 0.4 g": float(up.voltage.max()),
            "band of 5 V or more, end, 0.4 g": float(enough.max()),
            "best load at 12 Hz, 0.1 g": 1e-3 * float(loads[int(np.argmax(powers))]),
        }

    # Coupling: of its two resonances and as printed.  Damping: at 0.1 g, by its fit at 0.4 g.  Gap:
    # simulated, built.
    spreads = {
        "piezo.coupling": (2.66e-3, 3.8e-3), "oscillator.damping": (0.0876, 0.13),
        "stop.restitution": (0.1, 0.9), "stop.gap": (3.5e-3, 4.0e-3),
    }  # fmt: skip
    band = {f"band of 5 V or more, {which}, 0.4 g": "Hz" for which in ("begin", "end")}
    yield from predicted(
        "jiang",
        spreads,
        {"most voltage, 0.4 g": "V", **band, "best load at 12 Hz, 0.1 g": "kohm"},
        of,
    )


# --- Yang et al. 2015: hardening -------------------------------------------------------------------------------------


def yang() -> Iterator[Prediction]:
    """Where the upper branch ends on the way up, and the power there."""
    scene = hv.load(SCENES / "yang_2015.toml")

    def of(draw: dict[str, float]) -> dict[str, float]:
        found = {}
        for level, far in ((0.2, 46.0), (0.5, 66.0)):
            here = scene.varied(draw).vary("excitation.acceleration_amplitude", level * G)
            up = branches(here, np.arange(16.0, far, 1.0))["up"]
            found[f"end of the upper branch, {level} g"] = up.end
            found[f"most power on 100 kohm, {level} g"] = 1e3 * float(up.voltage.max()) ** 2 / 1e5
        return found

    units = {"end of the upper branch": "Hz", "most power on 100 kohm": "mW"}
    names = {f"{what}, {level} g": unit for what, unit in units.items() for level in (0.2, 0.5)}
    # its Figure 8 has both
    yield from predicted("yang", {"oscillator.damping_ratio": (0.005, 0.04)}, names, of)


# --- Norenberg et al. 2025: two wells --------------------------------------------------------------------------------

# Fundamental of the measured base acceleration (g) of each run, by its name: what the shaker did.
SHAKEN = {
    "6.3 Hz, 25 mV": 0.03268, "6.3 Hz, 50 mV": 0.06741, "6.3 Hz, 100 mV": 0.13910, "6.3 Hz, 150 mV": 0.21390,
    "9.1 Hz, 25 mV": 0.07559, "9.1 Hz, 50 mV": 0.16961, "9.1 Hz, 100 mV": 0.36304,
}  # fmt: skip
# To learn from: the sweep of 5 mV in either well, and 9.1 Hz at 150 mV (0.5604 g), 83.9 mV rms at
# the end.
LEARNED, LEARNED_LEVEL = 83.9e-3, 0.5604


def two_wells(well: float, frequency: float, q: float, gain: float) -> hv.Scene:
    """A double well with minima at +-``well`` (m), of a resonance in either; ``gain`` (V/g) is the sweep's peak.

    The load and the capacitance are those of the sweep's phase, 5 degrees before the displacement.  The mass cancels.
    """
    mass = 0.03
    w = 2.0 * math.pi * frequency
    capacitance = 190e-9
    return hv.Scene(
        title="A bistable beam, Norenberg et al. 2025",
        oscillator=hv.Oscillator(
            mass=mass,
            stiffness=-0.5 * mass * w**2,
            cubic_stiffness=0.5 * mass * w**2 / well**2,
            damping=mass * w / q,
        ),
        piezo=hv.Piezo(coupling=capacitance * gain * w**2 / (G * q), capacitance=capacitance),
        excitation=hv.Excitation(acceleration_amplitude=0.1 * G, frequency=9.1),
        load=hv.Load(resistance=1e6),
    )


def settled(scene: hv.Scene, frequency: float, level: float, seed: int) -> float:
    """Rms voltage of the second half of 64 s, as long as the source's runs are."""
    shaken = scene.varied(
        {"excitation.acceleration_amplitude": level * G, "excitation.frequency": frequency}
    )
    voltage = hv.motion(shaken, duration=64.0, seed=seed).voltage
    return float(np.std(voltage[len(voltage) // 2 :]))


def candidates() -> list[hv.Scene]:
    """Devices that the sweeps and any distance of the wells allow; the index of each is its seed."""
    # The wells' distance is not in the source; resonance, Q and gain are as wide as the sweeps of
    # both wells are.
    spreads = {
        "well": (math.log(2e-3), math.log(40e-3)),
        "f": (9.17, 9.24),
        "q": (95.0, 145.0),
        "gain": (4.0, 4.4),
    }
    return [
        two_wells(math.exp(draw["well"]), draw["f"], draw["q"], draw["gain"])
        for draw in drawn(spreads, 60)
    ]


def nearest_to_learned() -> list[tuple[int, hv.Scene]]:
    """Seed and scene of the devices that agree best with the run that is not held out."""
    devices = [
        (abs(math.log(settled(scene, 9.1, LEARNED_LEVEL, seed) / LEARNED)), seed, scene)
        for seed, scene in enumerate(candidates())
    ]
    return [one[1:] for one in sorted(devices, key=lambda one: one[:2])[:DRAWS]]


def held_out(devices: list[tuple[int, hv.Scene]]) -> dict[str, list[float]]:
    """Rms voltages (mV) of each run that was held out, one for each of the ``devices``."""
    return {
        what: [1e3 * settled(scene, float(what[:3]), level, seed) for seed, scene in devices]
        for what, level in SHAKEN.items()
    }


def responses(values: Sequence[float]) -> list[list[float]]:
    """Values in ascending order, apart where the next is more than twice as large: coexisting responses."""
    ordered = sorted(values)
    apart = [k for k in range(1, len(ordered)) if ordered[k] > 2.0 * ordered[k - 1]]
    ends = [0, *apart, len(ordered)]
    return [ordered[begin:end] for begin, end in itertools.pairwise(ends)]


def norenberg() -> Iterator[Prediction]:
    """Rms voltage of the runs that were held out, of the devices that agree with the one that was not."""
    for what, rms in held_out(nearest_to_learned()).items():
        low, value, high = np.quantile(rms, (0.025, 0.5, 0.975))
        yield Prediction(
            "norenberg", f"rms voltage, {what}", "mV", float(value), float(low), float(high)
        )


# --- Koga et al. 2017: a viaduct, its traffic, and a store -----------------------------------------------------------


def koga() -> Iterator[Prediction]:
    """A sine on a resistor; then a record of the viaduct, a bridge of diodes and 44 uF (benchmarks/viaduct.py)."""
    yield from predicted("koga", viaduct.SPREADS, viaduct.UNITS, viaduct.of)


DEVICES = {one.__name__: one for one in (liu, jiang, yang, norenberg, peigney, koga)}
COLUMNS = ("device", "quantity", "predicted", "low", "high", "unit")


def kept() -> list[Prediction]:
    """The predictions of these devices in benchmarks/predicted.csv, as they were first made."""
    with (HERE / "predicted.csv").open(newline="") as file:
        return [
            Prediction(
                row["device"],
                row["quantity"],
                row["unit"],
                *(float(row[end]) for end in ("predicted", "low", "high")),
            )
            for row in csv.DictReader(file)
            if row["device"] in DEVICES
        ]


@dataclass(frozen=True)
class Measured:
    """A measured value, half a unit of the last digit that its source prints, and why a prediction missed it."""

    value: float
    half_digit: float
    why: str

    def is_inside(self, one: Prediction) -> bool:
        """Whether it is in the interval, as far as its digits tell."""
        return one.low - self.half_digit <= self.value <= one.high + self.half_digit


def measured() -> dict[tuple[str, str], Measured]:
    """The measured values of benchmarks/measured.csv, by device and quantity."""
    with (HERE / "measured.csv").open(newline="") as file:
        return {
            (device, what): Measured(float(text), 0.5 * 10.0 ** -len(text.partition(".")[2]), why)
            for device, what, text, _, why in list(csv.reader(file))[1:]
        }


def sources() -> dict[str, dict[str, str]]:
    """The rows of benchmarks/devices.csv: title, class, source, parameters of the source, and open parameters."""
    with (HERE / "devices.csv").open(newline="") as file:
        return {row["device"]: row for row in csv.DictReader(file)}


def table() -> list[str]:
    """The table of docs/validation.md: device, predicted and its interval, measured, ratio, inside or not."""
    found = measured()
    rows = [
        "| device | quantity | predicted | measured | ratio | inside |",
        "|---|---|---|---|---|---|",
    ]
    for device, about in sources().items():
        title = f"**{about['title']}**"
        for one in (one for one in kept() if one.device == device and (device, one.what) in found):
            real = found[device, one.what]
            cells = [
                title,
                one.what,
                f"{one.value:.3g} ({one.low:.3g} to {one.high:.3g}) {one.unit}",
                f"{real.value:.4g} {one.unit}",
                f"{real.value / one.value:.2f}",
                "yes" if real.is_inside(one) else f"no: {real.why}",
            ]
            rows.append(f"| {' | '.join(cells)} |")
            title = ""
    return rows


def summary() -> str:
    """How many intervals hold, and the median deviation of what was measured from what was predicted."""
    found = measured()
    pairs = [
        (one, found[one.device, one.what]) for one in kept() if (one.device, one.what) in found
    ]
    inside = sum(real.is_inside(one) for one, real in pairs)
    off = float(np.median([abs(real.value / one.value - 1.0) for one, real in pairs]))
    devices = len({one.device for one, _ in pairs})
    return f"{devices} devices: {inside} of {len(pairs)} intervals hold; the median deviation is {100.0 * off:.0f} %"


def by_device() -> list[str]:
    """A row per device: how many intervals hold, and measured over predicted (median, least, most)."""
    found = measured()
    rows = []
    for device, about in sources().items():
        pairs = [(one, found[device, one.what]) for one in kept() if one.device == device]
        ratios = [real.value / one.value for one, real in pairs]
        holds = f"{sum(real.is_inside(one) for one, real in pairs)} of {len(pairs)}"
        spread = f"{np.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        rows.append(f"| {about['title']} | {about['source']} | {holds} | {spread} |")
    return rows


def parameters() -> list[str]:
    """A row per device: the parameters of its source, and those that the source leaves open."""
    head = ["| device | from the source | open, with its range |", "|---|---|---|"]
    return [
        *head,
        *(
            f"| {about['title']} | {about['taken']} | {about['open']} |"
            for about in sources().values()
        ),
    ]


def block() -> list[str]:
    """The generated lines of docs/validation.md: the summary in all and by device, the parameters, and the table."""
    devices = [
        "| device | source | intervals that hold | measured over predicted |",
        "|---|---|---|---|",
        *by_device(),
    ]
    return [f"**{summary()}.**", "", *devices, "", *table(), "", *parameters()]


def main() -> None:
    if "--table" in sys.argv:
        print(*block(), sep="\n")
        return
    if "--page" in sys.argv:
        before, _, rest = PAGE.read_text().partition(BEGIN)
        PAGE.write_text("\n".join([f"{before}{BEGIN}", *block(), f"{END}{rest.partition(END)[2]}"]))
        return
    asked = [name for name in sys.argv[1:] if name != "--write"]
    made = (
        {}
        if "--write" not in sys.argv or not asked
        else {(one.device, one.what): one for one in kept()}
    )
    for name in asked or DEVICES:
        for one in DEVICES[name]():
            print(
                f"{one.device:10} {one.what:40} {one.value:.4g} ({one.low:.4g} to {one.high:.4g}) {one.unit}",
                flush=True,
            )
            made[one.device, one.what] = one
    if "--write" in sys.argv:
        with (HERE / "predicted.csv").open(newline="") as file:
            rows = {(row["device"], row["quantity"]): row for row in csv.DictReader(file)}
        for one in made.values():
            texts = [
                one.device,
                one.what,
                *(f"{x:.4g}" for x in (one.value, one.low, one.high)),
                one.unit,
            ]
            rows.setdefault((one.device, one.what), {}).update(zip(COLUMNS, texts, strict=True))
        names = list(dict.fromkeys(name for row in rows.values() for name in row))
        with (HERE / "predicted.csv").open("w", newline="") as file:
            out = csv.DictWriter(file, names, restval="", lineterminator="\n")
            out.writeheader()
            out.writerows(rows.values())


if __name__ == "__main__":
    main()
