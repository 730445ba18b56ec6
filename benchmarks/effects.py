"""Nanoseconds per step of a trajectory of the package's kernel, effect by effect, against kernels written by hand.

The bare scene is a linear undamped oscillator, open circuit, no stop, no noise.  Each effect is
added to it, and taken from the whole scene.  The package's kernel and the one written by hand for
exactly that scene (peers/by_hand.py, in both orders of its loops) run in turn on one core, many
times, and the thread's own seconds count; a ratio is the median of the ratios of neighbours, so
that other work on the machine cancels, and ``ratio`` that to the faster of the two by hand.

That the ratio is 1 says that what a scene does not have costs nothing, whatever else there is.  The
package's kernel has one body of a step for both steps of a draw, a loop each, which halves its
compilation; by hand in one loop the state stays in registers between the two, which shows where a
step is so short that storing it counts.  What the package can do beyond the paper's scene
(`BEYOND`) has no kernel by hand: each is added to that scene, in turn with it.
"""

import argparse
import dataclasses
import statistics
import time

import numpy as np
from common import PAPER, report
from peers import by_hand

from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.trajectories import Trajectories
from harvester.mechanics.kernels.coefficients import BATCH, coefficients
from harvester.mechanics.kernels.intervals import update_of
from harvester.mechanics.kernels.noise import random_words
from harvester.mechanics.kernels.trajectory_batch import SUMS, Batch, Schedule, advance
from harvester.records.records import Record

H = 0.1
PAIRS = 2
READINGS = 1500
EFFECTS = {
    "stop": {"restitution": PAPER.restitution},
    "cubic stiffness": {"alpha": PAPER.alpha},
    "linear damping": {"c1": -PAPER.c1},
    "nonlinear damping": {"c2": PAPER.c2, "c3": PAPER.c3},
    "external noise": {"n1": PAPER.n1},
    "parametric noise": {"n2": PAPER.n2},
    "back-coupling": {"beta": PAPER.beta},
    "load resistance": {"mu": PAPER.mu},
}
BEYOND = {
    "stop at a distance": {"gap": 0.3},
    "stop with preload": {"gap": -0.1},
    "opposite stop": {"opposite_restitution": 0.96, "opposite_gap": 1.0},
    "compliant stop": {"restitution": None, "stop_stiffness": 400.0, "stop_damping": 1.0},
    "negative stiffness": {"linear": -1.0},
    "quadratic stiffness": {"alpha2": 0.1},
    "quadratic damping": {"cv": 0.1},
    "harmonic excitation": {"drive": 0.1, "drive_frequency": 1.1},
    "coloured noise": {"coloured": 0.01, "correlation_time": 1.0},
    "band-limited noise": {"coloured": 0.01, "centre": 1.1, "bandwidth": 0.2},
    "recorded acceleration": {
        "record": Record(0.1, 0.1 * np.random.default_rng(1).standard_normal(5000))
    },
}


def scenes():
    """Name -> equations.  Without external noise the mass may rest on the stop, a rule of its own: not compared."""
    yield "none", Equations()
    for name, values in EFFECTS.items():
        yield f"{name} alone", Equations(**values)
    for name, values in EFFECTS.items():
        if name != "external noise":
            yield f"all without {name}", dataclasses.replace(PAPER, **dict.fromkeys(values))
    yield "all", PAPER


def arrays():
    """State, generators and sums of a block, on the boundaries of cache lines: else chance decides the speed."""
    state, sums, words = (
        aligned((rows, BATCH), kind)
        for rows, kind in ((3, float), (len(SUMS), float), (2, np.uint64))
    )
    restart(state, words, sums)
    return state, words, sums


def restart(state, words, sums):
    """Back to the start: a motion that has died out to subnormal numbers is slow in any kernel."""
    state[:] = 0.1
    sums[:] = 0.0
    words[:] = random_words(np.random.SeedSequence(1), BATCH)


def aligned(shape, kind):
    raw = np.empty(8 * int(np.prod(shape)) + 64, dtype=np.uint8)
    skip = -raw.ctypes.data % 64
    return raw[skip : skip + 8 * int(np.prod(shape))].view(kind).reshape(shape)


def prepared(e, held, readings=READINGS):
    """A call of the package's kernel on these arrays."""
    state, words, sums = held
    shaker = Trajectories(e, BATCH, np.random.SeedSequence(2), H).shakers[0]
    batch, schedule = Batch(state, *words, sums), Schedule(readings, 2 * PAIRS, 0)
    c = coefficients(e)
    update = update_of(e, H)
    return lambda: advance(batch, schedule, H, None, c, shaker, update)


def prepared_by_hand(e, split, held, readings=READINGS):
    """A call of the kernel by hand, where an absent coefficient is a zero that is not read."""
    state, words, sums = held
    present = (e.mu, e.restitution, e.alpha, e.beta, e.c1, e.c2, e.c3, e.n1, e.n2)
    values = tuple(0.0 if value is None else value for value in present)
    lines = tuple((0.0, 0.0) if e.mu is None else by_hand.line(e.mu, h) for h in (H, 0.5 * H))
    function = by_hand.kernel(e, split)
    return lambda: function(*state, *words, sums, readings, PAIRS, H, *values, *lines)


def timed(call, held):
    restart(*held)
    begin = time.thread_time()
    call()
    return (time.thread_time() - begin) / (READINGS * PAIRS * 2 * BATCH) * 1e9


def compared(e, repeats):
    """The row of a scene: nanoseconds of the package's kernel and of both by hand, and the ratios of neighbours."""
    held = arrays()
    calls = [prepared(e, held), *(prepared_by_hand(e, split, held) for split in (False, True))]
    for call in calls:
        call()
    times = np.array([[timed(call, held) for call in calls] for _ in range(repeats)])
    ours, *hands = (float(one) for one in np.median(times, axis=0))
    ratios = {
        name: statistics.median(times[:, 0] / times[:, k])
        for k, name in ((1, "one loop"), (2, "two loops"))
    }
    row = {"ns/step": ours, "by hand": min(hands), "ratio": max(ratios.values())}
    return row | {f"ratio to {name}": ratio for name, ratio in ratios.items()}


def added(e, repeats):
    """Nanoseconds of the package's kernel for a scene, and what it takes more than for the paper's."""
    held = arrays()
    calls = [prepared(one, held) for one in (e, PAPER)]
    for call in calls:
        call()
    times = np.array([[timed(call, held) for call in calls] for _ in range(repeats)])
    return float(np.median(times[:, 0])), statistics.median(times[:, 0] - times[:, 1])


def plot(rows, path):
    """Draw the time of both kernels, effect by effect."""
    from harvester.figures.quantities import logarithm
    from harvester.figures.style import entitle, legend, new
    from harvester.presentation.plot import styled

    figure, axes = new(1, 1, (7.0, 6.4))
    place = np.arange(len(rows))[::-1]
    with styled():
        hand = [
            (at, row["by hand"]) for at, row in zip(place, rows, strict=True) if row.get("by hand")
        ]
        axes.plot(
            [ns for _, ns in hand],
            [at for at, _ in hand],
            "D",
            color="0.65",
            markersize=7,
            label="written by hand for the scene",
        )
        axes.plot([row["ns/step"] for row in rows], place, "o", color="0.15", label="harvester")
        axes.set_yticks(place, [row["what"] for row in rows])
        logarithm(axes.xaxis)
        axes.set_xlabel("CPU time per step of a trajectory (ns)")
        entitle(
            figure,
            "Cost of each effect: alone, left out of the scene of the Entropy 2026 paper, or added to it",
        )
        legend(figure)
    figure.savefig(path)


def main(repeats):
    rows = []
    for name, e in scenes():
        rows.append({"what": name} | compared(e, repeats))
    by_name = {row["what"]: row["ns/step"] for row in rows}
    for row in rows:
        if row["what"].startswith("all without "):
            row["its cost, ns"] = by_name["all"] - row["ns/step"]
        elif row["what"] != "none":
            row["its cost, ns"] = row["ns/step"] - by_name["none"]
    for name, values in BEYOND.items():
        ours, more = added(dataclasses.replace(PAPER, **values), repeats)
        rows.append({"what": f"all with {name}", "ns/step": ours, "its cost, ns": more})
    report("effects", rows)
    plot(rows, "docs/effects.png")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--repeats", type=int, default=101)
    main(arguments.parse_args().repeats)
