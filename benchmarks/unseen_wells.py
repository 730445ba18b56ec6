"""The predictions of benchmarks/unseen.py with two wells: a buckled beam (D5), and a tilted or rotated one (D8)."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import predictions

import harvester as hv
from harvester.arrays import Floats

G, TURN = 9.80665, 2.0 * math.pi
# D5: the force of its first branch has a zero at 5.7 mm, with a slope of 745 N/m, hence 0.121 kg at 78.35 rad/s, and
# does 18.5 mJ of work from there to its other zero at -13.6 mm.  A polynomial of two wells has barrier m w^2 W^2/8:
WELL, FREQUENCY = 14.1e-3, 78.35 / TURN


def d5(drawn: Any, row: Any) -> Iterator[Any]:
    """A beam with two states, doi 10.1016/j.apenergy.2020.115518: equation and units were not at hand.

    The potential is a polynomial of the fourth degree with the barrier and the resonance of the first branch of the
    force; the distance of the wells is open by 20 %, and the power by a factor of twenty either way.
    """
    of = drawn({"well": 0.20, "frequency": 0.08, "damping": 0.5})
    draws = range(10)
    edges: dict[float, list[tuple[float, float]]] = {0.6: [], 2.0: [], 3.0: [], 4.0: []}
    for at in draws:
        well, w0 = WELL * of["well"][at], TURN * FREQUENCY * of["frequency"][at]
        scene = hv.Scene(
            oscillator=hv.Oscillator(
                mass=0.1, stiffness=-0.05 * w0**2, cubic_stiffness=0.05 * w0**2 / well**2,
                damping=0.2 * 5.6e-3 * of["damping"][at] * w0,
            ),
            piezo=hv.Piezo(coupling=2.821e-5, capacitance=48e-9),
            excitation=hv.Excitation(acceleration_amplitude=G, frequency=10.0),
            load=hv.Load(resistance=8.2e3),
        )  # fmt: skip
        for level, found in edges.items():
            crossing = [f for f in np.arange(4.0, 26.0, 1.0) if crosses(scene, float(f), level, at)]
            found.append((min(crossing), max(crossing)) if crossing else (math.nan, math.nan))
    # The current is theta X' in a load far below 1/(w C): 3 uW with theta in N/V; the normalisation is not known.
    yield row("D5.p_10Hz_4g_8.2k", "mW", 0.05 * np.exp(1.5 * np.log(of["well"]) / 0.20))
    for level in (2, 3, 4):
        for at, name in enumerate(("low", "high")):
            ends = np.array([pair[at] for pair in edges[float(level)]])
            middle = float(np.nanmedian(ends))
            spread = 0.15 + float(np.nanstd(np.log(ends)))
            values = middle * np.exp(spread * np.log(of["frequency"]) / 0.08)
            yield row(f"D5.band_{name}_{level}g", "Hz", values)
    share = float(np.mean(np.isfinite([pair[0] for pair in edges[0.6]])))
    yield (
        "D5",
        "D5.crosses_0.6g",
        float(share > 0.5),
        0.0 if share < 0.975 else 1.0,
        1.0 if share > 0.025 else 0.0,
        "1",
    )


def crosses(scene: hv.Scene, frequency: float, level: float, seed: int) -> bool:
    """Whether the displacement crosses between the wells in each period of the settled motion, all but one of ten."""
    here = scene.varied(
        {"excitation.acceleration_amplitude": level * G, "excitation.frequency": frequency}
    )
    x = hv.motion(here, duration=20.0 / frequency, seed=seed).displacement
    return int(np.count_nonzero(np.diff(np.sign(x)))) >= 36


# --- D8: BistableX -----------------------------------------------------------------------------

# Resonances (Hz) in the left and right well in the sweeps without tilt, by rotation (degrees) of the left magnet (< 0)
# or of the right one.  At 10 and 60 degrees no sweep exists: about as the square of the angle.
SWEPT = {0: (9.22, 9.19), -30: (7.55, 9.19), 30: (9.61, 7.00)}
LEVELS = {6.3: {25: 0.03268, 50: 0.06741, 100: 0.13910, 150: 0.21390, 200: 0.2886},
          9.1: {25: 0.07559, 50: 0.16961, 100: 0.36304, 150: 0.5604, 200: 0.760}}  # fmt: skip
OPEN = {"6.3": (25, 50, 100, 150), "9.1": (25, 50, 100, 150)}  # of the device without rotation
NAMED = {0: "mag_vr=0_vl=0", -10: "mag_vr=0_vl=10", -30: "mag_vr=0_vl=30", -60: "mag_vr=0_vl=60",
         10: "mag_vr=10_vl=0", 30: "mag_vr=30_vl=0", 60: "mag_vr=60_vl=0"}  # fmt: skip
RMS = {"6.3 Hz, 25 mV": 2.264, "6.3 Hz, 50 mV": 4.159, "6.3 Hz, 100 mV": 9.711, "6.3 Hz, 150 mV": 15.03,
       "9.1 Hz, 25 mV": 51.19, "9.1 Hz, 50 mV": 63.71, "9.1 Hz, 100 mV": 76.33, "9.1 Hz, 150 mV": 83.9}  # fmt: skip


def tilted(
    scene: hv.Scene, left: float, right: float, well: float, mass: float, at_left: bool
) -> hv.Scene:
    """Force K x (x + A)(x - B) about the saddle, with the resonances of either well and a distance of 2 ``well``.

    K (A + B) B = m wR^2 and K (A + B) A = m wL^2: the deeper well is the stiffer and the farther from the saddle.
    """
    kl, kr = mass * (TURN * left) ** 2, mass * (TURN * right) ** 2
    cubic = (kl + kr) / (2.0 * well) ** 2
    a, b = kl / (2.0 * well * cubic), kr / (2.0 * well * cubic)
    sign = (
        -1.0 if at_left else 1.0
    )  # a mirror image: a motion begins in the right well, or in its image
    oscillator = dataclasses.replace(
        scene.oscillator,
        stiffness=-cubic * a * b,
        quadratic_stiffness=sign * cubic * (a - b),
        cubic_stiffness=cubic,
    )
    return dataclasses.replace(scene, oscillator=oscillator)


def resonances(angle: int, u: float) -> tuple[float, float]:
    """Resonances of both wells at an angle; ``u`` from 0 to 1 places those of which no sweep exists."""
    if angle in SWEPT:
        return SWEPT[angle]
    left, right = SWEPT[-30] if angle < 0 else SWEPT[30]
    turned, other = (left, right) if angle < 0 else (right, left)
    rest, far = (SWEPT[0][0], SWEPT[0][1]) if angle < 0 else (SWEPT[0][1], SWEPT[0][0])
    share = (0.05 + 0.25 * u) if abs(angle) == 10 else (1.2 + 2.0 * u)
    weaker = math.sqrt(max(rest**2 + share * (turned**2 - rest**2), 0.02 * rest**2))
    stronger = far + share * (other - far)
    return (weaker, stronger) if angle < 0 else (stronger, weaker)


def nearest(of: Any) -> list[tuple[float, int, hv.Scene, float]]:
    """The twelve devices that agree best with the eight open runs: deviation, number, scene and well (m)."""
    devices: list[tuple[float, int, hv.Scene, float]] = []
    for at in range(48):
        well = math.exp(
            math.log(3e-3) + (math.log(40e-3) - math.log(3e-3)) * ((at * 0.618034) % 1.0)
        )
        q = 150.0 * of["q"][at]
        gain = (
            6.45 / 150.0 * q * of["static"][at]
        )  # 0.098 V/g at 6.3 Hz: 4.2 V/g times 1.54 at Q = 150
        scene = predictions.two_wells(well, 9.205, q, gain)
        off = [
            math.log(
                1e3
                * predictions.settled(
                    scene, float(what[:3]), LEVELS[float(what[:3])][int(what[8:-3])], at
                )
                / v
            )
            for what, v in RMS.items()
        ]
        devices.append((float(np.mean(np.clip(np.abs(off), 0.0, 1.0))), at, scene, well))
    best = sorted(devices, key=lambda one: one[:2])[:12]
    print("D8 wells (mm):", [f"{1e3 * one[3]:.1f} ({one[0]:.2f})" for one in best])
    return best


def d8(drawn: Any, row: Any) -> Iterator[Any]:
    """BistableX (Norenberg et al. 2025), rms voltage of the runs without tilt that are not among the eight open ones.

    The wells' distance is that of the devices that agree best with the eight; far from the resonance the sweeps have
    0.098 V/g at 6.3 Hz, which places the product of peak and width.  The well of the start is not known.
    """
    best = nearest(drawn({"q": 0.25, "static": 0.08}))
    mass = best[0][2].oscillator.mass
    for angle, name in NAMED.items():
        for frequency, levels in LEVELS.items():
            for level, acceleration in levels.items():
                if frequency == 9.1 and level == 200 and angle != 0:
                    continue
                if angle == 0 and level in OPEN[str(frequency)]:
                    continue
                values = [
                    1e3 * predictions.settled(
                        tilted(scene, *resonances(angle, (at * 0.754878) % 1.0), well, mass, which),
                        frequency, acceleration, at,
                    )
                    for _, at, scene, well in best
                    for which in (False, True)
                ]  # fmt: skip
                model = np.exp(
                    np.array([-0.5, 0.0, 0.5]) * 0.4
                )  # 0.16: the error of one mode, in voltage
                yield row(
                    f"D8.freq_{frequency}Hz/{name}/amplitude_{level}mV.csv",
                    "mV",
                    with_model(values, model),
                )


def with_model(values: list[float], factors: Floats) -> Floats:
    """All values times all factors."""
    return np.outer(values, factors).ravel()
