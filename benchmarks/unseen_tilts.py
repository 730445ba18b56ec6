"""The prediction of the device D8 on a tilted base (D9), with which the priors of later versions are judged.

    python benchmarks/unseen_tilts.py          # into benchmarks/predicted.csv

BistableX has runs with a base that is tilted by 10, 25 and 45 degrees (base_rotation_phi).  Gravity
then bends the beam: m g sin(phi) is added to the force of the two wells, by the same share of the
mode as the shaking.  Taken from those runs: the amplitude of the base's acceleration (channel 1).
Open: whether the shaking is along the beam's motion or at the angle of the tilt to it, the well of
the start, and all that D8 leaves open.
"""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import predictions
from unseen_wells import nearest, with_model

import harvester as hv

G = 9.80665
# Acceleration amplitude (g) by tilt (degrees), frequency (Hz) and setting (mV).
TILTED = {
    10: {6.3: {25: 0.03279, 50: 0.06745, 100: 0.13938, 150: 0.21413, 200: 0.28477},
         9.1: {25: 0.08704, 50: 0.17860, 100: 0.36796, 150: 0.56139}},
    25: {6.3: {25: 0.03262, 50: 0.06737, 100: 0.13858, 150: 0.20862, 200: 0.27741},
         9.1: {25: 0.08779, 50: 0.17969, 100: 0.36818, 150: 0.55834}},
    45: {6.3: {25: 0.02982, 50: 0.06218, 100: 0.12910, 150: 0.19928, 200: 0.26572},
         9.1: {25: 0.08229, 50: 0.16834, 100: 0.34621, 150: 0.52653}},
}  # fmt: skip
MODEL = 0.4  # of the logarithm of a power, as D8 has it


def leaning(scene: hv.Scene, tilt: float, at_left: bool) -> hv.Scene:
    """The two wells with gravity along the motion, about the saddle, or about the only rest if one well is gone.

    k1 x + k2 x^2 + k3 x^3 = m g sin(tilt): about a root r the force is
    (k1 + 2 k2 r + 3 k3 r^2) y + (k2 + 3 k3 r) y^2 + k3 y^3.
    """
    one = scene.oscillator
    k1, k3 = one.stiffness, one.cubic_stiffness
    assert k1 is not None and k3 is not None, "two_wells gives both"
    k2 = one.quadratic_stiffness or 0.0
    force = one.mass * G * math.sin(math.radians(tilt))
    roots = np.roots([k3, k2, k1, -force])
    real = sorted(float(root.real) for root in roots if abs(root.imag) < 1e-9 * abs(root))
    middle = real[len(real) // 2]
    sign = -1.0 if at_left else 1.0
    oscillator = dataclasses.replace(
        one,
        stiffness=k1 + 2.0 * k2 * middle + 3.0 * k3 * middle**2,
        quadratic_stiffness=sign * (k2 + 3.0 * k3 * middle),
        cubic_stiffness=k3,
    )
    return dataclasses.replace(scene, oscillator=oscillator)


def d9(drawn: Any, row: Any) -> Iterator[Any]:
    """BistableX (Norenberg et al. 2025), rms voltage of the runs on a tilted base without rotated magnets."""
    best = nearest(drawn({"q": 0.25, "static": 0.08}))
    model = np.exp(np.array([-0.5, 0.0, 0.5]) * MODEL)
    for tilt, frequencies in TILTED.items():
        along = math.cos(math.radians(tilt))
        for frequency, levels in frequencies.items():
            for level, amplitude in levels.items():
                values = [
                    1e3
                    * predictions.settled(
                        leaning(scene, tilt, which), frequency, amplitude * share, at
                    )
                    for at, (_, _, scene, _) in enumerate(best)
                    for which, share in ((False, 1.0), (True, along))
                ]
                name = f"D9.phi={tilt}/freq_{frequency}Hz/amplitude_{level}mV.csv"
                yield row(name, "mV", with_model(values, model))


def main() -> None:
    """Compute, print and write the rows."""
    import unseen

    made = []
    for one in d9(unseen.drawn, unseen.row):
        print(f"{one[1]:60} {one[2]:.4g} ({one[3]:.4g} to {one[4]:.4g}) {one[5]}", flush=True)
        made.append([*one[:2], *(f"{value:.4g}" for value in one[2:5]), one[5]])
    unseen.write(made)


if __name__ == "__main__":
    main()
