"""Whether an effect that a scene lacks could explain the predictions that missed: restitution that depends on speed.

    .venv/bin/python benchmarks/missed.py     # a minute

Impacts that take a different part of the speed at each speed leave a response between those of
constants.  So the quantities that missed at the two devices with impacts are computed over all
constants from 0 to 0.9.
"""

from collections.abc import Iterator

import numpy as np
import predictions

import harvester as hv
from harvester.arrays import Floats

CONSTANTS = (0.0, 0.3, 0.5, 0.7, 0.9)
SWEEPS: dict[str, Floats] = {"liu": np.arange(30.0, 56.1, 1.0), "jiang": np.arange(7.0, 17.1, 1.0)}
YEARS = {"liu": "liu_2011", "jiang": "jiang_2020"}


def quantities(device: str, restitution: float) -> dict[str, float]:
    """What missed at a device, in the units of the table, at a constant restitution."""
    scene = hv.load(predictions.SCENES / f"{YEARS[device]}.toml").vary(
        "stop.restitution", restitution
    )
    up = predictions.branches(scene, SWEEPS[device])["up"]
    if device == "jiang":
        return {"most voltage, 0.4 g": float(up.voltage.max())}
    rms = 1e3 * up.voltage / np.sqrt(2.0)
    at_36 = float(np.interp(36.0, up.frequency, rms))
    return {"voltage at 36 Hz, 1 g": at_36, "most voltage, 1 g": float(rms.max())}


def rows() -> Iterator[str]:
    """A row for each quantity: measured, and computed at each constant."""
    found = predictions.measured()
    units = {(one.device, one.what): one.unit for one in predictions.kept()}
    for device in SWEEPS:
        each = [quantities(device, restitution) for restitution in CONSTANTS]
        for what in each[0]:
            values = " | ".join(f"{one[what]:.3g}" for one in each)
            yield f"| {what}, {device} | {found[device, what].value:.4g} {units[device, what]} | {values} |"


if __name__ == "__main__":
    print(*rows(), sep="\n")
