"""The interval of a real device after an impedance curve, and after one measured power, on five devices.

    python benchmarks/narrowed.py           # the table, some minutes
    python benchmarks/narrowed.py --page    # into docs/prediction.md

Each device is driven at its resonance, which the excitation follows (``tuned``); all else comes from its dimensions and
a data sheet.  The impedance curve is at a low level (``measured_low``).  The power is measured within 5 % at the load
of the scene, and the interval is that of the power at three times the load: devices from the priors, weighted by the
likelihood of the measured power, with a model error at either load that is independent of the other.
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from common import print_block
from unseen_scenes import linear, shaken

import harvester as hv
from harvester.arrays import Floats
from harvester.devices import materials
from harvester.devices.beam import Beam, lumped
from harvester.equations.problem import Problem
from harvester.studies.prediction.predict import ENDS, Devices
from harvester.studies.prediction.priors import in_modal_keys, priors_of

HERE = Path(__file__).parent
SCENES = HERE.parent / "examples" / "published"
PAGE = HERE.parent / "docs" / "prediction.md"
BEGIN, END = "<!-- by benchmarks/narrowed.py --page -->", "<!-- end -->"
METER = 0.05  # relative error of a measured power
SAMPLES = 128
TUNED = {"frequency": "tuned"}
CURVE = TUNED | dict.fromkeys(("damping", "coupling", "capacitance"), "measured_low")


def d1() -> hv.Scene:
    """The bimorph D1 of benchmarks/unseen.py, whose damping is open, on 470 ohm."""
    materials.PIEZOS["D1"] = materials.Piezoceramic(
        60.6e9, 7500.0, -16.6 / 60.6e9, 25.55e-9, "doi 10.1177/0959651810396280"
    )
    made = lumped(Beam(24.53e-3, 6.4e-3, 0.14e-3, 0.265e-3, "D1", "brass", layers=2))
    scene = linear(made.mass, 502.5, 0.012, made.coupling, made.capacitance)
    return shaken(scene, 9.80665, 502.5, 470.0)


def devices() -> Iterator[tuple[str, str, hv.Scene]]:
    """Title, class and scene of each device."""
    yield "bimorph, Erturk and Inman 2009", "bulk", hv.load(SCENES / "erturk_inman_2009.toml")
    yield "bimorph, D1", "bulk", d1()
    yield "bridge, Peigney and Siegert 2013", "bulk", hv.load(SCENES / "peigney_siegert_2013.toml")
    yield "viaduct, Koga 2017", "film", hv.load(SCENES / "koga_2017.toml")
    yield "hardening spring, Yang 2015", "bulk", hv.load(SCENES / "yang_2015.toml")


def drawn(scene: hv.Scene, device_class: str, known: dict[str, str]) -> Devices:
    """Many devices of a scene, the same at every load."""
    problem = Problem.of(scene)
    modal = in_modal_keys(problem.scene)
    priors = priors_of(modal, device_class, known)
    vary = {entry.key: entry.written for entry in priors}
    return Devices(priors, hv.tolerance(modal, vary=vary, samples=SAMPLES, checks=0), problem, 0)


def ratio(values: Floats, weights: Floats) -> float:
    """The high end of the interval with 95 % of weighted values over its low end."""
    order = np.argsort(values)
    shares = np.cumsum(weights[order]) / weights.sum()
    low, high = np.interp((ENDS[0], ENDS[-1]), shares, values[order])
    return float(math.exp(high - low))


def widths(scene: hv.Scene, device_class: str) -> tuple[float, float, float]:
    """High over low of the power at three times the load: before, after an impedance curve, after a power."""
    at_load = drawn(scene, device_class, TUNED)
    elsewhere = scene.vary("load.resistance", 3.0 * scene.load.resistance)
    here, there = at_load, drawn(elsewhere, device_class, TUNED)
    (measured, _, _), (asked, _, model) = here.logarithms(), there.logarithms()
    sigma = math.hypot(METER, here.model.sigma)
    weights = np.exp(-0.5 * ((measured - np.median(measured)) / sigma) ** 2)
    curve, _, its_model = drawn(elsewhere, device_class, CURVE).logarithms()
    equal = np.ones_like(weights)
    return (
        ratio(asked + model, equal),
        ratio(curve + its_model, equal),
        ratio(asked + model, weights),
    )


def block() -> Iterator[str]:
    """The rows of the table."""
    yield "| device | class | from geometry | after an impedance curve | after one power |"
    yield "|---|---|---|---|---|"
    for title, device_class, scene in devices():
        cells = [f"{value:.1f}" for value in widths(scene, device_class)]
        row = f"| {title} | {device_class} | {' | '.join(cells)} |"
        print(row, file=sys.stderr, flush=True)
        yield row


def main() -> None:
    """Print the table, and with --page write it into the page."""
    print_block(list(block()), PAGE, BEGIN, END)


if __name__ == "__main__":
    main()
