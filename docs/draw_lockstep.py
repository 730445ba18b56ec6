"""Draws docs/lockstep.png: a few steps of the lock-step, from a real run of ngspice with its callbacks in Python.

    .venv/bin/python docs/draw_lockstep.py

Left a load resistor, where one step of ngspice leads from landing to landing; right a bridge, where
ngspice takes smaller steps of its own.  The same noise moves both masses.
"""

import argparse
import sys
import warnings
from pathlib import Path
from typing import ClassVar

import numpy as np

import harvester as hv
from harvester.cosimulation import runs as worker
from harvester.engines.selection import ENGINES
from harvester.engines.spice.setup import set_up
from harvester.equations.problem import Problem
from harvester.figures.style import legend, new
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.presentation.plot import image, styled

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
from tests.support.python_callbacks import PythonCallbacks, run_in_python  # noqa: E402

EXAMPLES = HERE.parent / "examples"
# large enough a step to be seen
STEP = 0.25
KICKS = 400
SHOWN = 4  # drifts, one of them with an impact
INK = "0.25"
STOP = ENGINES["published"].LOOK.colour
POINTS = {
    "markerfacecolor": ENGINES["spice"].LOOK.colour,
    "markeredgecolor": ENGINES["spice"].LOOK.colour,
}


class Recorder(PythonCallbacks):
    """The lock-step in Python, which writes down each accepted point: phase, x, x' before it acts, V."""

    points: ClassVar[list[tuple[float, ...]]] = []

    def data(self, ident, t, v, power, current, smooth):
        s = self.state
        now = t * s.w0
        x = float(s.x + s.v * (now - s.leg_t * s.w0))
        before = float(s.v), int(s.impacts)
        status = super().data(ident, t, v, power, current, smooth)
        self.points.append(
            (now, x, before[0], float(s.v), v / float(s.volts), float(s.impacts) - before[1])
        )
        return status


def recorded(scene: hv.Scene) -> tuple[np.ndarray, float]:
    """Accepted points (n, 6): t, x, velocities before and after, V, whether an impact; and the step."""
    device = set_up(Problem(scene), hv.Spice(dt=STEP / 20.0)).device
    Recorder.points = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # 0 times the infinite distance of a stop that is not there
        noise = gaussian_grid(np.random.SeedSequence(3), KICKS)
        run_in_python(device, worker.new_drive(device, noise), Recorder)
    return np.array(Recorder.points), device.h


def window(points: np.ndarray, h: float, skipped: int = 150) -> tuple[float, float]:
    """From the kick before the second last drift ahead of an impact to `SHOWN` drifts later."""
    hits = points[(points[:, 5] > 0.0) & (points[:, 0] > skipped * h), 0]
    for hit in hits:  # an impact that is well inside its drift
        if 0.3 < hit / h % 1.0 < 0.45:
            first = (np.floor(hit / h) - SHOWN // 2 + 1) * h
            return first, first + SHOWN * h
    raise SystemExit("no impact well inside a drift: take another seed")


def panel(
    axes: np.ndarray, points: np.ndarray, h: float, span: tuple[float, float], title: str
) -> None:
    """x, x' and V over the window."""
    first, last = span
    here = points[(points[:, 0] > first - 1.01 * h) & (points[:, 0] < last + 1.01 * h)]
    t = (here[:, 0] - first) / h
    after = here[:, 3]
    curves = [
        (t, here[:, 1], "o"),
        (np.repeat(t, 2)[1:], np.repeat(after, 2)[:-1], ""),
        (t, here[:, 4], "o"),
    ]
    for axis, (at, values, mark), name in zip(axes, curves, ("x", "x'", "V"), strict=True):
        label = "drift, and the points that ngspice accepted" if mark else "_"
        axis.plot(
            at, values, color=INK, marker=mark, markersize=4.5, linewidth=1.2, label=label, **POINTS
        )
        for kick in range(SHOWN + 1):
            axis.axvline(kick, color="0.6", linestyle=":", linewidth=1.0, zorder=0, label="kick")
        for hit in t[here[:, 5] > 0.0]:
            axis.axvline(hit, color=STOP, linewidth=1.2, zorder=1, label="impact")
        axis.set_ylabel(f"{name} (nondimensional)")
        axis.set_xlim(-0.15, SHOWN + 0.15)
        inside = values[(at >= -0.3) & (at <= SHOWN + 0.3)]
        margin = 0.12 * np.ptp(inside)
        axis.set_ylim(inside.min() - margin, inside.max() + margin)
    axes[0].axhline(0.0, color=STOP, linewidth=1.0, zorder=0)
    axes[0].set_title(title, fontsize=10)
    axes[-1].set_xlabel("time (steps)")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--out", type=Path, default=HERE / "lockstep.png")
    given = options.parse_args()
    scene = hv.load(EXAMPLES / "plate_with_stop.toml")
    bridge = scene.with_load(hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "1 uF"}))
    with styled():
        figure, axes = new(3, 2, (9.0, 6.4), sharex=True)
        for column, (one, title) in enumerate(
            ((scene, "load resistor"), (bridge, "bridge rectifier"))
        ):
            points, h = recorded(one)
            panel(axes[:, column], points, h, window(points, h), title)
        legend(figure)
    given.out.write_bytes(image(figure, "png"))


if __name__ == "__main__":
    main()
