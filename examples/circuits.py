"""Six load circuits on one weakly coupled device, with and without a stop: power against the load.

    .venv/bin/python examples/circuits.py            # some ten minutes; docs/circuits.png and a table
    .venv/bin/python examples/circuits.py --quick    # two minutes; less yet: --circuit, --loads, --duration

All runs share their noise paths, so that gains are known better than powers.  The smoothing
capacitor is R C = 10/w0: it is charged within the burn-in and follows the random amplitude, at the
price of a ripple of a quarter of its voltage. The amplitude lasts for some three half periods (2/c
= 10/w0), about as long as parallel SSHI's voltage takes to build up, 1/(1 - q): that is probably
why its gain is half of what a steady amplitude would give.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np

import harvester as hv
from harvester import figures
from harvester.equations.scales import scales
from harvester.figures.quantities import logarithm
from harvester.figures.style import legend, styled
from harvester.scene.physical import Stop

HERE = Path(__file__).parent
CIRCUITS = {  # Okabe and Ito's palette, told apart without colour by line and marker
    "resistor": {"color": "#000000", "linestyle": "-", "marker": "o", "label": "resistor"},
    "bridge": {"color": "#0072B2", "linestyle": "--", "marker": "s", "label": "bridge"},
    "doubler": {"color": "#009E73", "linestyle": "-.", "marker": "^", "label": "voltage doubler"},
    "parallel_sshi": {
        "color": "#D55E00",
        "linestyle": "-",
        "marker": "D",
        "label": "parallel SSHI",
    },
    "series_sshi": {"color": "#CC79A7", "linestyle": "--", "marker": "v", "label": "series SSHI"},
    "sece": {"color": "#E69F00", "linestyle": ":", "marker": "X", "label": "SECE"},
}


def load(scene: hv.Scene, circuit: str, resistance: float) -> hv.Load:
    """The circuit with a load resistance; diodes that stand the voltage, and R C = 10/w0."""
    if circuit == "resistor":
        return hv.Load(resistance=resistance)
    smoothing = 10.0 / (scales(scene).frequency * resistance)
    # wound to order: q = .71
    coil = {"L": 2.0, "Rcoil": 1.2e3, "Rcore": 500e3} if "sshi" in circuit else {}
    return hv.Load(netlist=circuit, parameters={"R": resistance, "C": smoothing, "Bv": 1e3} | coil)


def best(resistances: np.ndarray, powers: np.ndarray) -> tuple[float, float]:
    """Load and power at the top of the parabola in log R through the highest point and its neighbours."""
    k = min(max(int(powers.argmax()), 1), len(powers) - 2)
    x = np.log(resistances[k - 1 : k + 2])
    y = powers[k - 1 : k + 2]
    a, b, c = np.polyfit(x - x[1], y, 2)
    top = np.clip(-0.5 * b / a, x[0] - x[1], x[2] - x[1]) if a < 0.0 else (x - x[1])[y.argmax()]
    return float(np.exp(x[1] + top)), float(np.polyval([a, b, c], top))


def main() -> None:
    """Sweep, print, draw."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--quick", action="store_true", help="few loads, short runs")
    options.add_argument(
        "--circuit", action="append", choices=CIRCUITS, help="only this one; repeatable"
    )
    options.add_argument("--loads", type=int, help="how many, 3 or more")
    options.add_argument("--duration", type=float, help="of a run after its burn-in, s")
    options.add_argument("--out", type=Path, default=HERE.parent / "docs" / "circuits.png")
    given = options.parse_args()
    resistances = np.geomspace(1e5, 3e7, given.loads or (4 if given.quick else 7))
    duration = given.duration or (2.0 if given.quick else 20.0)
    engine = hv.Spice(duration=duration, trajectories=4 if given.quick else 8)
    circuits = {name: CIRCUITS[name] for name in given.circuit or CIRCUITS}
    scene = hv.load(HERE / "plate_weak.toml")
    panels = {
        "without a stop": scene,
        "with a stop, r = 0.96": dataclasses.replace(scene, stop=Stop(restitution=0.96)),
    }

    figure, axes = figures.new(1, 2, (7.0, 4.2), sharey=True)
    for (title, here), panel in zip(panels.items(), axes, strict=True):
        print(
            f"{title:24}best load (Mohm)   power (uW, 95 %)      gain over the resistor", flush=True
        )
        reference = None
        for circuit, style in circuits.items():
            runs = [
                engine.run(here.with_load(load(here, circuit, float(r)))).mean_power
                for r in resistances
            ]
            power = 1e6 * np.array([one.value for one in runs])
            error = 1.96e6 * np.array([one.stderr for one in runs])
            at, most = best(resistances, power)
            reference = reference or most
            around = error[power.argmax()]
            print(
                f"  {circuit:22}{at / 1e6:12.2g}{most:16.4g} +- {around:<8.2g}{most / reference:16.2f}",
                flush=True,
            )
            with styled():
                panel.errorbar(resistances, power, error, elinewidth=1.0, **style)
        with styled():
            logarithm(panel.xaxis, prefixes=True)
            logarithm(panel.yaxis)
            panel.set(title=title, xlabel="load resistance (Ω)")
    with styled():
        axes[0].set_ylabel("mean power of the load (µW)")
        legend(figure, "Bars: 95 % sampling intervals.")
    figure.savefig(given.out)
    print(f"{given.out}")


if __name__ == "__main__":
    main()
