"""Trajectory-steps a second on the paper's scene: this package's ensemble and the same step in vectorised NumPy.

Both run here, one after the other, with the same step length and number of trajectories; the ratio
is what counts.
"""

import numpy as np
from common import best_of, report

from harvester.mechanics.ensemble import Ensemble
from harvester.scaling import Equations

PAPER = Equations(alpha=0.5, beta=0.05, mu=0.05, c1=0.01, c2=0.05, c3=0.1, restitution=0.96, n1=0.01, n2=0.01)
H, TRAJECTORIES = 0.1, 4096


def numpy_steps(steps, e=PAPER, h=H, n=TRAJECTORIES):
    """The step of harvester.mechanics.step on whole arrays, with Gaussian noise."""
    rng = np.random.default_rng(1)
    x, v, V = np.zeros((3, n))
    decay = np.exp(-e.mu * h)
    for _ in range(steps):
        x1 = x + h * v
        hit = x1 < 0
        after = np.where(hit, x1 / np.where(hit, v, 1.0), 0.0)
        V = decay * V + v * ((1 - decay) - (1 + e.restitution) * -np.expm1(-e.mu * after)) / e.mu
        x = np.where(hit, -e.restitution * x1, x1)
        v = np.where(hit, -e.restitution * v, v)
        x2 = x * x
        dv = h * (-x - e.alpha * x * x2 - e.beta * V) + rng.standard_normal(n) * np.sqrt(2 * h * (e.n1 + e.n2 * x2))
        y = h * (e.c3 * x2 * x2 - e.c2 * x2 - e.c1)
        v = (v + (1 + 0.5 * y) * dv) / (1 + y + 0.5 * y * y)
    return (V**2).mean()


def ours(steps):
    many = Ensemble(PAPER, TRAJECTORIES, np.random.SeedSequence(1), H)
    return lambda: many.run(steps * H)


if __name__ == "__main__":
    rows = []
    for name, steps, call in (("harvester", 20_000, ours(20_000)), ("numpy", 500, lambda: numpy_steps(500))):
        median, best = best_of(call)
        rows.append({"what": name, "million steps/s, median": steps * TRAJECTORIES / median / 1e6})
        rows[-1]["best"] = steps * TRAJECTORIES / best / 1e6
    rows.append(
        {"what": "ratio of medians", "": rows[0]["million steps/s, median"] / rows[1]["million steps/s, median"]}
    )
    report("ensemble", rows)
