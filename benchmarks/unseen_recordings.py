"""The prediction of the device D8 on a tilted base under recorded sweeps (D26), and its judgement.

    python benchmarks/unseen_recordings.py           # prints it, half a minute
    python benchmarks/unseen_recordings.py --write   # also into benchmarks/predicted.csv
    python benchmarks/unseen_recordings.py --judge   # against benchmarks/measured_later.csv; --page: into the page

BistableX has recordings of 64 s of sweeps from 0 to 25 Hz on a base that is tilted by 25 and 45 degrees, each from rest
in one of the two wells.  Taken from them: the acceleration of the base (channel 1), as the law of its frequency, which
is linear in time, and its amplitude by frequency (`RECORDINGS`).  Predicted: the rms voltage over the whole recording.
Devices and gravity are those of D9 (benchmarks/unseen_tilts.py), rotated magnets those of D8, and the model error is
that of the package for a nonlinear spring.  Open besides: the side to which gravity bends the beam.
"""

import dataclasses
import math
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import unseen
from scipy.stats import norm
from unseen_cantilevers import Sample, judge, judged, judgement
from unseen_tilts import G, leaning
from unseen_wells import nearest, resonances, tilted

import harvester as hv
from harvester.arrays import Floats
from harvester.studies.prediction.priors import data

LENGTH = 64.0  # s
RATE = 512.0  # 1/s, of the samples here
FREQUENCIES = np.arange(2.0, 26.0, 2.0)  # Hz
ERRORS = norm.ppf((np.arange(16) + 0.5) / 16.0)  # standard deviations of the model


@dataclass(frozen=True)
class Recording:
    """A sweep of the data set: its place there, the tilt (degrees), the rotation of a magnet as `resonances` has it.

    The frequency is ``first`` + ``rate`` t (Hz, Hz/s), downwards from the end with ``down``; ``amplitudes``
    (g) are those at `FREQUENCIES`.
    """

    place: str
    tilt: float
    angle: int
    at_left: bool
    first: float
    rate: float
    amplitudes: tuple[float, ...]
    down: bool = False

    def acceleration(self, time: Floats) -> Floats:
        """The acceleration (m/s^2) at times (s) within the recording."""
        t = LENGTH - time if self.down else time
        frequency = self.first + self.rate * t
        phase = 2.0 * math.pi * (self.first * t + 0.5 * self.rate * t**2)
        amplitude = np.interp(np.abs(frequency), FREQUENCIES, self.amplitudes)
        return np.asarray(G * amplitude * np.sin(phase))


RECORDINGS = (
    Recording("phi=25/mag_vr=0_vl=30/left_eq_point.mat", 25.0, -30, True, 0.489, 0.3909, (
        0.0021, 0.0033, 0.0057, 0.0120, 0.0215, 0.0236, 0.0288, 0.0321, 0.0315, 0.0307, 0.0292, 0.0286)),
    Recording("phi=25/mag_vr=0_vl=30/right_eq_point.mat", 25.0, -30, False, 0.489, 0.3909, (
        0.0025, 0.0037, 0.0061, 0.0112, 0.0209, 0.0233, 0.0286, 0.0320, 0.0316, 0.0309, 0.0294, 0.0287)),
    Recording("phi=25/mag_vr=60_vl=0/left_eq_point.mat", 25.0, 60, True, 0.489, 0.3909, (
        0.0017, 0.0040, 0.0057, 0.0115, 0.0211, 0.0237, 0.0288, 0.0320, 0.0315, 0.0307, 0.0293, 0.0285)),
    Recording("phi=25/mag_vr=60_vl=0/right_eq_point.mat", 25.0, 60, False, -0.480, 0.3903, (
        0.0022, 0.0088, 0.0243, 0.0467, 0.0893, 0.0921, 0.1157, 0.1261, 0.1242, 0.1211, 0.1161, 0.1120), True),
    Recording("phi=45/mag_vr=0_vl=0/left_eq_point.mat", 45.0, 0, True, 0.510, 0.3909, (
        0.0026, 0.0026, 0.0054, 0.0109, 0.0200, 0.0248, 0.0312, 0.0338, 0.0331, 0.0322, 0.0299, 0.0280)),
    Recording("phi=45/mag_vr=0_vl=0/right_eq_point.mat", 45.0, 0, False, -2.873, 0.3903, (
        0.0018, 0.0027, 0.0056, 0.0108, 0.0201, 0.0243, 0.0311, 0.0339, 0.0333, 0.0324, 0.0306, 0.0306), True),
)  # fmt: skip


def shaken(scene: hv.Scene, one: Recording, share: float, folder: str, seed: int) -> float:
    """The rms voltage (V) from rest over the length of a recording, of which the motion gets a ``share``."""
    time = np.arange(int(LENGTH * RATE)) / RATE
    file = Path(folder) / f"{RECORDINGS.index(one)}_{share:.3f}.csv"
    if not file.exists():
        lines = np.column_stack([time, share * one.acceleration(time)])
        np.savetxt(file, lines, "%.9g", ",", header="time (s),acceleration (m/s^2)", comments="")
    scene = dataclasses.replace(scene, excitation=hv.Excitation(acceleration_file=str(file)))
    return float(np.std(hv.motion(scene, duration=LENGTH, seed=seed, from_rest=True).voltage))


def samples(seed: int = 1) -> Iterator[Sample]:
    """Each quantity, over the devices, both sides of gravity, and both directions of the shaking."""
    best = nearest(unseen.drawn({"q": 0.25, "static": 0.08}, seed))
    factors = np.exp(0.5 * float(data()["model"]["nonlinear"]) * ERRORS)
    with tempfile.TemporaryDirectory() as folder:
        for one in RECORDINGS:
            volts = []
            for _, at, upright, well in best:
                ends = resonances(one.angle, (at * 0.754878) % 1.0)
                scene = tilted(upright, *ends, well, upright.oscillator.mass, at_left=False)
                for side in (1.0, -1.0):
                    bent = leaning(scene, side * one.tilt, not one.at_left)
                    along = math.cos(math.radians(one.tilt))
                    volts += [shaken(bent, one, share, folder, at) for share in (1.0, along)]
            values = 1e3 * np.outer(volts, factors).ravel()
            yield Sample(f"D26.{one.place}", "mV", values, np.ones(len(values)))


def main() -> None:
    """Compute, print, and with --write write the rows; with --judge compare them with the measured values."""
    if "--judge" in sys.argv:
        judge("recordings", [*judgement(judged(["D26"]))], "--page" in sys.argv)
        return
    made = []
    for one in samples():
        cells = [f"{x:.4g}" for x in one.quantiles()]
        print(f"{one.quantity:48} {cells[0]} ({cells[1]} to {cells[2]}) {one.unit}", flush=True)
        made.append(["D26", one.quantity, *cells, one.unit])
    if "--write" in sys.argv:
        unseen.write(made)


if __name__ == "__main__":
    main()
