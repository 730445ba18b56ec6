"""Predictions of devices whose measured values the author had not seen (D1 to D8), and of the six older ones anew.

    python benchmarks/unseen.py            # into benchmarks/predicted.csv: the first priors, some minutes
    python benchmarks/unseen.py D2 D6      # these devices alone, printed

Each number of a source gets a prior: lognormal, and its width follows from the class of the device and from how the
number became known (`SIGMA`).  A prediction is the median of `DRAWS` devices, the interval has 95 % of them, and a
factor for the error of the model (`MODEL`) is in it.  The priors here are the first, chosen before any comparison with
a measured value of D1 to D8; they stay as they are, since the columns ``predicted``, ``low`` and ``high`` are theirs.
Sources and parameters of D1 to D8: the DOI in each docstring.
"""

import csv
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import unseen_beams
import unseen_films
import unseen_wells
from scipy.stats import qmc
from unseen_scenes import amplitudes, linear, shaken

import harvester as hv
from harvester.arrays import Floats
from harvester.devices import materials
from harvester.devices.beam import Beam, lumped

HERE = Path(__file__).parent
CSV = HERE / "predicted.csv"
G, TURN = 9.80665, 2.0 * math.pi
DRAWS = 256
FIRST = ("predicted_1", "low_1", "high_1")  # with the first priors, of all devices
COLUMNS = ("device", "quantity", "predicted", "low", "high", "unit", *FIRST)
MODEL = 0.15  # of the logarithm of a power; half of it of a voltage
# Standard deviations of the logarithm, the first priors.
SIGMA = {
    "coupling, bulk": 0.10,
    "coupling, composite": 0.35,
    "coupling, film": 0.30,
    "capacitance, data sheet": 0.10,
    "capacitance, measured": 0.02,
    "damping, unknown": 0.50,
    "damping, measured": 0.20,
    "frequency, geometry": 0.04,
    "frequency, bonded geometry": 0.08,
    "frequency, measured": 0.002,
}
Row = tuple[str, str, float, float, float, str]
Draws = dict[str, Floats]


def drawn(sigmas: Mapping[str, float], seed: int = 1) -> Draws:
    """Factors of each number: exp(sigma z) of quasi-random z, and ``model`` for a voltage."""
    names = [*sigmas, "model"]
    unit = qmc.Sobol(len(names), rng=np.random.default_rng(seed)).random(DRAWS)
    normal = qmc.MultivariateNormalQMC(
        np.zeros(len(names)), engine=qmc.Sobol(len(names), rng=seed)
    ).random(DRAWS)
    widths = [*sigmas.values(), 0.5 * MODEL]
    made = {
        name: np.exp(width * normal[:, at])
        for at, (name, width) in enumerate(zip(names, widths, strict=True))
    }
    return made | {"uniform": unit[:, 0]}


def row(quantity: str, unit: str, values: Floats) -> Row:
    """A row of the file: median, and the interval with 95 % of the values."""
    low, middle, high = np.quantile(values, (0.025, 0.5, 0.975))
    return quantity.partition(".")[0], quantity, float(middle), float(low), float(high), unit


def d1() -> Iterator[Row]:
    """PZT-5H bimorph without a tip mass, doi 10.1177/0959651810396280; X-poled, hence in series.

    Its damping is open: about 0.012 for a clamped bimorph.  502.5 Hz is taken as its resonance in short circuit.
    """
    materials.PIEZOS["D1"] = materials.Piezoceramic(
        60.6e9, 7500.0, -16.6 / 60.6e9, 25.55e-9, "the source"
    )
    beam = Beam(24.53e-3, 6.4e-3, 0.14e-3, 0.265e-3, "D1", "brass", layers=2)
    made = lumped(beam)
    short = math.sqrt(made.stiffness / made.mass) / TURN
    widths = {
        "frequency": SIGMA["frequency, geometry"],
        "coupling": SIGMA["coupling, bulk"],
        "capacitance": SIGMA["capacitance, data sheet"],
        "damping": SIGMA["damping, unknown"],
        "tuned": SIGMA["frequency, measured"],
    }
    of = drawn(widths)
    coupling, capacitance = made.coupling * of["coupling"], made.capacitance * of["capacitance"]
    k2 = coupling**2 / (made.stiffness * of["frequency"] ** 2 * capacitance)
    yield row("D1.f_short", "Hz", short * of["frequency"])
    yield row("D1.f_open", "Hz", short * of["frequency"] * np.sqrt(1.0 + k2))
    scenes = [
        shaken(linear(made.mass, 502.5 * f, 0.012 * z, theta, c), G, 502.5, 470.0)
        for f, z, theta, c in zip(of["tuned"], of["damping"], coupling, capacitance, strict=True)
    ]
    yield row("D1.v_470ohm", "V/g", amplitudes(scenes) * of["model"])


# --- D2: a bimorph of macro-fibre composite with a bridge --------------------------------------

MFC_E31, MFC_SIGMA, PAPER_SIGMA = (
    9.0,
    0.35,
    0.50,
)  # fibres of PZT-5A, 0.86 of the volume; and what a paper prints


def composite_e31(printed: float) -> tuple[float, float]:
    """|e31| (C/m^2) of a macro-fibre composite: the class and the paper's number, each with its weight; and sigma."""
    weights = np.array([MFC_SIGMA**-2, PAPER_SIGMA**-2])
    mean = float(np.average(np.log([MFC_E31, printed]), weights=weights))
    return math.exp(mean), float(weights.sum() ** -0.5)


def rectified(
    scene: hv.Scene, acceleration: float, frequency: float, resistance: float, drop: float
) -> float:
    """Voltage (V) on a smoothed resistor behind a bridge (Shu and Lien 2006), whose diodes take ``drop`` each.

    The piezo sees V + 2 drop and the mean current V/R: an ideal bridge on R (V + 2 drop)/V.
    """
    one, piezo = scene.oscillator, scene.piezo
    mass, w0 = one.mass, math.sqrt(one.stiffness / one.mass)
    theta, capacitance, omega = piezo.coupling, piezo.capacitance, TURN * frequency / w0
    k2 = theta**2 / (one.stiffness * capacitance)
    seen = resistance
    voltage = 0.0
    for _ in range(40):
        rho = capacitance * w0 * seen
        d = rho * omega + 0.5 * math.pi
        damping = 2.0 * one.damping_ratio + 2.0 * k2 * rho / d**2
        u = ((damping * omega) ** 2 + (1.0 - omega**2 + k2 * rho * omega / d) ** 2) ** -0.5
        voltage = max(mass * acceleration / theta * k2 * rho * omega / d * u - 2.0 * drop, 1e-6)
        seen = 0.5 * (seen + resistance * (voltage + 2.0 * drop) / voltage)
    return voltage


def d2() -> Iterator[Row]:
    """Two M2814-P2 on 0.80 mm of steel, a mass of 153.76 g, and a bridge W02G with 10 uF.

    Doi 10.1115/smasis2010-3708.  Open: the coupling, and where the active 28 mm begin (at the clamp to 4 mm from it).
    """
    e31, sigma = composite_e31(30.34 * 0.370)
    widths = {
        "frequency": SIGMA["frequency, measured"],
        "coupling": sigma,
        "capacitance": SIGMA["capacitance, measured"],
        "damping": SIGMA["damping, measured"],
    }
    of = drawn(widths)
    length, begin, mass = 49.25e-3, 4e-3 * of["uniform"], 0.15376
    end = begin + 28e-3
    # A tip load bends it: w'(x) = 3 X (L x - x^2/2)/L^3.
    slope = 3.0 * (length * (end - begin) - 0.5 * (end**2 - begin**2)) / length**3
    coupling = 2.0 * e31 * of["coupling"] * 14e-3 * 0.475e-3 * slope
    capacitance = 50.30e-9 * of["capacitance"]
    open_circuit = TURN * 26.250 * of["frequency"]
    stiffness = mass * open_circuit**2 - coupling**2 / capacitance
    keep = stiffness > 0.5 * mass * open_circuit**2
    scenes, models = [], of["model"][keep]
    for at in np.flatnonzero(keep):
        short = math.sqrt(stiffness[at] / mass)
        ratio = 0.00889 * of["damping"][at] * open_circuit[at] / short
        scenes.append(linear(mass, short / TURN, ratio, coupling[at], capacitance[at]))

    def level(frequency: float) -> float:
        return math.sqrt(2.0) * 0.71e-3 * TURN * frequency

    for name, f, kilo in (("ac", 26.13, (109.7, 287.6, 340.8)), ("ac26.1", 26.1, (109.7,))):
        for load in kilo:
            both = 1.0 / (1.0 / (1e3 * load) + 1.0 / 2e6)
            v = amplitudes([shaken(scene, level(f), f, both) for scene in scenes]) * models
            yield row(f"D2.{name}_{load}k", "uW", 1e6 * 0.5 * v**2 / (1e3 * load))
    for name, f, kilo in (("dc", 26.13, (109.7, 287.6, 340.8)), ("dc26.1", 26.1, (149.7,))):
        for load in kilo:
            both = 1.0 / (1.0 / (1e3 * load) + 1.0 / 10e6)
            v = np.array([rectified(scene, level(f), f, both, 0.55) for scene in scenes]) * models
            yield row(f"D2.{name}_{load}k", "uW", 1e6 * v**2 / (1e3 * load))


# --- The six older devices, widened ------------------------------------------------------------

# Exponents of a quantity in coupling, damping and capacitance; the sigma of a frequency; and the share of the model.
OLDER = {
    "Hz": (0.0, 0.0, 0.03, 0.0),
    "V": (1.0, 0.5, 0.0, 0.5),
    "W": (2.0, 1.0, 0.0, 1.0),
    "ohm": (0.0, 0.5, 0.0, 0.5),
}
OLDER_SIGMA = {"liu": (0.3, 0.5), "jiang": (0.1, 0.5), "yang": (0.1, 0.5), "norenberg": (0.1, 0.3),
               "peigney": (0.1, 0.3), "erturk": (0.1, 0.2), "koga": (0.1, 0.3)}  # fmt: skip


def widened(device: str, low: float, value: float, high: float, unit: str) -> tuple[float, float]:
    """Ends of the interval of an older device with the priors: each half-width with them, as a root of squares."""
    kind = next(name for name in OLDER if unit.endswith(name))
    coupling, damping, frequency, model = OLDER[kind]
    s_coupling, s_damping = OLDER_SIGMA[device]
    more = 1.96 * math.hypot(coupling * s_coupling, damping * s_damping, frequency, model * MODEL)
    return value * math.exp(-math.hypot(math.log(value / low), more)), value * math.exp(
        math.hypot(math.log(high / value), more)
    )


DEVICES: dict[str, Callable[[], Iterator[Row]]] = {
    "D1": d1,
    "D2": d2,
    "D3": lambda: unseen_beams.d3(drawn, row, composite_e31, SIGMA),
    "D4": lambda: unseen_beams.d4(drawn, row, SIGMA),
    "D5": lambda: unseen_wells.d5(drawn, row),
    "D6": lambda: unseen_films.d6(drawn, row, SIGMA),
    "D7": lambda: unseen_films.d7(drawn, row),
    "D8": lambda: unseen_wells.d8(drawn, row),
}


def main() -> None:
    """Compute, print, and without a name of a device write the file."""
    made = []
    for name in sys.argv[1:] or DEVICES:
        for one in DEVICES[name]():
            print(f"{one[1]:60} {one[2]:.4g} ({one[3]:.4g} to {one[4]:.4g}) {one[5]}", flush=True)
            made.append([*one[:2], *(f"{value:.4g}" for value in one[2:5]), one[5]])
    if not sys.argv[1:]:
        write(made)


def write(made: list[list[str]]) -> None:
    """The file: the rows of measured devices as they were, with these priors beside them, and the rows made now."""
    with CSV.open(newline="") as file:
        kept = {(row["device"], row["quantity"]): row for row in csv.DictReader(file)}
    for row in kept.values():
        if row["device"] in OLDER_SIGMA:
            value, low, high = (float(row[name]) for name in ("predicted", "low", "high"))
            ends = widened(row["device"], low, value, high, row["unit"])
            texts = [row["predicted"], *(f"{end:.4g}" for end in ends)]
            row.update(zip(FIRST, texts, strict=True))
    for cells in made:
        row = kept.setdefault((cells[0], cells[1]), {})
        row.update(zip(COLUMNS, [*cells, *cells[2:5]], strict=True))
    names = list(dict.fromkeys(name for row in kept.values() for name in row))
    with CSV.open("w", newline="") as file:
        out = csv.DictWriter(file, names, restval="", lineterminator="\n")
        out.writeheader()
        out.writerows(kept.values())


if __name__ == "__main__":
    main()
