"""The prediction of a bistable plate (D25) from its inputs, and its judgement.

    python benchmarks/unseen_plates.py           # prints it, half a minute
    python benchmarks/unseen_plates.py --write   # also into benchmarks/predicted.csv
    python benchmarks/unseen_plates.py --judge   # against benchmarks/measured_later.csv; --page: into the page

Arrieta, Hagedorn, Erturk and Inman 2010, doi 10.1063/1.3487780 (text in the public dataset VEHBench): a carbon-epoxy
plate [90_2-0_2] of 200 mm by 200 mm, held at its centre, with masses on its corners and four flexible patches of
PZT-5A in parallel on a resistor.  At 0.05 g it resonates at 10.9 Hz in one state and at 9.4 Hz in the other, in which
the runs at 2 g begin.  The source gives the mean power at the best load of three motions, all of which cross between
the states: devices of the priors that do not cross at a frequency count nothing there.

What the source leaves open (`RANGES` and the priors of the package) was chosen before the first run, by one who had
read the measured powers, and not changed after it: the prediction is not blind.  The coordinate is the displacement
of a corner; with phi = (2 x/L)^2, plate M and corners Mc, the mass is (M/3 + Mc)^2/(M/5 + Mc).
"""

import math
import sys
from collections.abc import Iterator

import numpy as np
import unseen
from scipy.stats import norm
from unseen_cantilevers import Sample, judge, judged, judgement
from unseen_scenes import TURN, linear
from unseen_wells import tilted

import harvester as hv
from harvester.studies.prediction.priors import data, prior_of
from harvester.studies.tolerance.design import sobol_points

G = 9.80665
DRAWS = 128
STATES = 10.9, 9.4  # Hz; the runs begin in the second
MOTIONS = (8.6, 9.8, 12.5)  # Hz: a limit cycle, intermittency and chaos
LEVEL = 2.0 * G
RMS = 0.2  # the share of devices whose level is an rms value, as in unseen_cantilevers
# Ends of what is open, uniform in the logarithm.
RANGES = {
    "ply": (0.125e-3, 0.25e-3),  # m, of four plies of 1570 kg/m^3
    "corners": (10e-3, 200e-3),  # kg, all four
    "radius": (0.2, 1.0),  # m, of such laminates at room temperature
}
SIDE, DENSITY = 0.2, 1570.0
# theta^2/(K Cp): k31^2 of PZT-5A, 0.12, times the fraction of the strain energy in the patches, 2 to 30 %.
COUPLED = 0.12 * math.sqrt(0.02 * 0.30)
CAPACITANCE = 1e-7  # F; at the best load the power does not depend on it
LOADS = tuple(2.0**k for k in range(-4, 5))  # over 1/(w C)
PERIODS = 60
CROSSINGS = 6  # of the saddle in the second half, the fewest of a motion between the states


def plate(of: dict[str, float]) -> tuple[hv.Scene, float]:
    """The scene of a device of the priors about its saddle, and the base's acceleration amplitude (m/s^2)."""
    kilograms = 4.0 * of["ply"] * DENSITY * SIDE**2
    first, second = kilograms / 3.0 + of["corners"], kilograms / 5.0 + of["corners"]
    mass = first**2 / second
    well = SIDE**2 / (8.0 * of["radius"]) * second / first  # half of the distance of the states
    damping = prior_of("damping", "unknown", "bulk")
    coupling = prior_of("coupling", "unknown", "bulk")
    assert damping is not None and damping.median and damping.sigma, "the class has a median"
    assert coupling is not None and coupling.sigma, "lognormal"
    ratio = damping.median * math.exp(damping.sigma * of["damping"])
    middle = math.sqrt(STATES[0] * STATES[1])
    stiffness = mass * (TURN * middle) ** 2
    theta = math.sqrt(COUPLED * stiffness * CAPACITANCE) * math.exp(coupling.sigma * of["coupling"])
    scene = linear(mass, middle, ratio, theta, CAPACITANCE)
    level = LEVEL * (math.sqrt(2.0) if of["rms"] < RMS else 1.0)
    return tilted(scene, *STATES, well, mass, at_left=False), level


def power(scene: hv.Scene, level: float, frequency: float, seed: int) -> float:
    """The mean power (W) at the best of `LOADS`; 0 if no load leaves a motion between the states."""
    most = 0.0
    shaken = scene.varied(
        {"excitation.acceleration_amplitude": level, "excitation.frequency": frequency}
    )
    for factor in LOADS:
        resistance = factor / (TURN * frequency * CAPACITANCE)
        run = hv.motion(
            shaken.with_load(resistance=resistance), duration=PERIODS / frequency, seed=seed
        )
        half = len(run.voltage) // 2
        if np.count_nonzero(np.diff(np.sign(run.displacement[half:]))) >= CROSSINGS:
            most = max(most, float(np.mean(run.voltage[half:] ** 2)) / resistance)
    return most


def drawn(seed: int) -> list[dict[str, float]]:
    """The numbers of each device of the priors."""
    normals = ("damping", "coupling", "model")
    u = sobol_points(DRAWS, len(RANGES) + len(normals) + 1, seed)
    logs = [np.log(ends) for ends in RANGES.values()]
    wide = {
        name: np.exp(low + (high - low) * u[:, at])
        for at, (name, (low, high)) in enumerate(zip(RANGES, logs, strict=True))
    }
    spread = {name: norm.ppf(u[:, len(RANGES) + at]) for at, name in enumerate(normals)}
    every = {**wide, **spread, "rms": u[:, -1]}
    return [{name: float(values[at]) for name, values in every.items()} for at in range(DRAWS)]


def samples(seed: int = 1) -> Iterator[Sample]:
    """Each quantity, over the devices that cross between the states."""
    draws = drawn(seed)
    model = float(data()["model"]["nonlinear"])
    made = [plate(of) for of in draws]
    for frequency in MOTIONS:
        watts = np.array(
            [power(scene, level, frequency, at) for at, (scene, level) in enumerate(made)]
        )
        errors = np.exp(model * np.array([of["model"] for of in draws]))
        crosses = watts > 0.0
        yield Sample(
            f"D25.p_{frequency}Hz", "mW", 1e3 * (watts * errors)[crosses], np.ones(crosses.sum())
        )


def main() -> None:
    """Compute, print, and with --write write the rows; with --judge compare them with the measured values."""
    if "--judge" in sys.argv:
        judge("plates", [*judgement(judged(["D25"]))], "--page" in sys.argv)
        return
    made = []
    for one in samples():
        cells = [f"{x:.4g}" for x in one.quantiles()]
        share = f"{len(one.values)} of {DRAWS} cross"
        print(f"{one.quantity:14} {cells[0]} ({cells[1]} to {cells[2]}) {one.unit}, {share}")
        made.append(["D25", one.quantity, *cells, one.unit])
    if "--write" in sys.argv:
        unseen.write(made)


if __name__ == "__main__":
    main()
