"""Yield and quantiles of a board's `tolerance` next to random devices, each computed alone; z-scores and CPU time.

    python benchmarks/board_yield.py [DEVICES] [BUDGET] [judged]

The random devices (300 by default) are computed by the same engine without its judge, times the
ratio of the study: they test the law and its polynomial, without which each has its own run.
``judged``: each device has its own measured model error, which tests that ratio as well.
"""

import resource
import sys
import time

import numpy as np

import harvester as hv
from harvester.studies.tolerance.spreads import spreads

BOARD = "examples/bimorph_board.toml"
PARTS = {
    **{f"load.parameters.{name}": "5%" for name in ("R1", "R2", "R3", "R4")},
    **{f"load.parameters.{name}": "20%" for name in ("C1", "C2")},
    "piezo.capacitance": "10%",
    "piezo.coupling": "5%",
    "oscillator.damping_ratio": "10%",
    "oscillator.stiffness": "2%",
}
LIMIT = "mean_power > 180 uW"


def cpu():
    """The CPU time of this program and of its workers that have ended (s)."""
    kinds = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
    usage = [resource.getrusage(kind) for kind in kinds]
    return sum(each.ru_utime + each.ru_stime for each in usage)


def brute(scene, count, judged):
    """The powers of random devices (W), shape (count,)."""
    u = np.random.default_rng(11).random((count, len(PARTS)))
    x = np.stack([each.at(u[:, k]) for k, each in enumerate(spreads(PARTS, scene))], axis=1)
    scenes = [scene.varied(dict(zip(PARTS, map(float, row), strict=True))) for row in x]
    return np.array([answer.mean_power.value for answer in hv.Slow(judged=judged).run_many(scenes)])


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    budget = sys.argv[2] if len(sys.argv) > 2 else "60s"
    scene = hv.load(BOARD)
    begin = time.perf_counter()
    spent = cpu()
    found = hv.tolerance(scene, vary=PARTS, limits=[LIMIT], runs=budget)
    took = time.perf_counter() - begin
    print(f"tolerance: {took:.1f} s, {cpu() - spent:.1f} s of CPU time; {found.check}")
    begin = time.process_time()
    judged = "judged" in sys.argv[3:]
    powers = brute(scene, count, judged)
    if not judged:
        powers *= found.nominal / hv.Slow(judged=False).run(scene).mean_power.value
    print(f"{count} devices: {time.process_time() - begin:.1f} s of CPU time")
    for share, quantile in found.quantiles.items():
        below = (powers < quantile.value).mean()
        z = (below - share) / np.sqrt(share * (1.0 - share) / count)
        print(f"  {share:4.0%} quantile {1e6 * quantile.value:7.2f} uW  z {z:5.2f}")
    good = (powers > 180e-6).mean()
    z = (good - found.met.value) / np.sqrt(good * (1.0 - good) / count)
    print(f"  yield {found.met.value:.3f}, of devices alone {good:.3f}, z {z:.2f}")


if __name__ == "__main__":
    main()
