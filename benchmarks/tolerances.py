"""Yield and quantiles of `tolerance` beside 20,000 random devices, each computed by the same engine; z-scores of both.

Three designs: the plate without a stop by `exact`, the plate with a stop and the paper's scene by
`averaged`.  The response surface stands for most samples of `tolerance`; the random devices have
none.
"""

import time

import numpy as np

import harvester as hv
from harvester.studies.tolerance.spreads import spreads

COUNT, TOGETHER = 20_000, 2_000
PARTS = {"piezo.capacitance": "10%", "oscillator.damping": "normal:5%", "load.resistance": "E24:5%"}
DESIGNS = [
    ("examples/plate.toml", hv.Exact(), PARTS, "mean_power > 9.4 uW"),
    (
        "examples/plate_with_stop.toml",
        hv.Averaged(),
        PARTS | {"stop.restitution": ".94:.98"},
        "mean_power > 8 uW",
    ),
    (
        "examples/paper_figure3.toml",
        hv.Averaged(),
        {
            "nondimensional.mu": "20%",
            "nondimensional.restitution": "triangular:.93:.96:.99",
            "nondimensional.c2": "10%",
        },
        "mean_power > 0.0002",
    ),
]


def brute(scene, vary, engine):
    """The powers of random devices, shape (COUNT,)."""
    u = np.random.default_rng(1).random((COUNT, len(vary)))
    parts = spreads(vary, scene)
    x = np.stack([one.at(u[:, k]) for k, one in enumerate(parts)], axis=1)
    powers = []
    for begin in range(0, COUNT, TOGETHER):
        some = [
            scene.varied(dict(zip(vary, map(float, row), strict=True)))
            for row in x[begin : begin + TOGETHER]
        ]
        powers += [answer.mean_power.value for answer in engine.run_many(some)]
    return np.array(powers)


def main():
    for path, engine, vary, limit in DESIGNS:
        scene = hv.load(path)
        begin = time.perf_counter()
        found = hv.tolerance(
            scene,
            vary=vary,
            limits=[limit],
            engine=engine,
            checks=0,
            execution=hv.Execution(workers=1),
        )
        seconds = time.perf_counter() - begin
        begin = time.perf_counter()
        power = brute(scene, vary, engine)
        took = time.perf_counter() - begin
        p = float(found.limits[0].met(power).mean())
        error = np.sqrt(p * (1.0 - p) * (1.0 / COUNT + 1.0 / len(found.power)))
        print(f"{path}, {found.engine}: {seconds:.1f} s against {took:.0f} s")
        print(
            f"  {limit}: {found.met.value:.4f} and {p:.4f}, z = {(found.met.value - p) / error:.2f}"
        )
        for q, one in found.quantiles.items():
            z = ((power < one.value).mean() - q) / np.sqrt(q * (1.0 - q) / COUNT)
            print(f"  quantile {q:g}: {one.value:.5g} and {np.quantile(power, q):.5g}, z = {z:.2f}")


if __name__ == "__main__":
    main()
