"""Draws docs/export.png: the exported part with load circuits in `ngspice -b`, beside our engine `spice`.

    .venv/bin/python docs/draw_export.py

The circuits are those of tests/devices/test_export_circuits.py; the voltage is that of the store,
from empty.
"""

import sys
from pathlib import Path

import numpy as np

from harvester.engines.selection import ENGINES
from harvester.figures.style import legend, new
from harvester.machine import files
from harvester.presentation.plot import image, styled

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
from tests.support.exported import CASES, both  # noqa: E402

WORDS = {
    "bridge": "bridge, no stop",
    "bridge and stop": "bridge, and a stop with r = 0.9 at 0.1 mm",
    "chip": "a chip like the LTC3588-1",
}


def main() -> None:
    with styled():
        figure, axes = new(3, 1, (7.0, 6.4))
        for panel, name in zip(axes, CASES, strict=True):
            t, plain, ours = both(name)
            panel.plot(
                1e3 * t,
                plain,
                color="0.6",
                linewidth=3.0,
                label="the exported part, in ngspice alone",
            )
            panel.plot(
                1e3 * t,
                ours,
                color=ENGINES["spice"].LOOK.colour,
                linewidth=1.0,
                label="engine spice",
            )
            share = 100.0 * np.sqrt(np.mean((plain - ours) ** 2) / np.mean(plain**2))
            panel.set_title(f"{WORDS[name]}: {share:.2g} % apart (RMS)", loc="left")
            panel.set_ylabel("store (V)")
            print(name, f"{share:.2g} %")
        axes[-1].set_xlabel("time (ms)")
        legend(figure)
    files.write(HERE / "export.png", image(figure, "png"))


if __name__ == "__main__":
    main()
