"""Seconds per point of a map: each scene alone, and many through one call; then the map whole.

    python benchmarks/many_designs.py points|map|z|memory|scaling

``points``: engines and kinds of scenes, both ways in turn on one core.  ``map``: 100 x 100 points
to 1 %, by 1 and 2 processes.  ``z``: 1,000 points against runs of other seeds.  ``memory``: the
largest memory of a sweep of 5,000, 20,000 and 100,000 points.
"""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import harvester as hv

WHITE = {"c1": -0.05, "beta": 0.05, "mu": 1.0, "D11": 0.01}
BRIDGE = hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
EXAMPLES = Path(__file__).parent.parent / "examples"
COUNT = 64
FEW = 8  # scenes of an engine that takes them one by one, a second each


def table(**more):
    """A scene by its nondimensional numbers."""
    return hv.Scene(nondimensional=hv.Nondimensional(**WHITE | more))


STOP = table(restitution=0.9)
# engine, scene, and the key that is varied
KINDS = {
    "ensemble, stop": (hv.Ensemble(within="1%"), STOP, "nondimensional.mu", 0.1, 2.0),
    "ensemble, strong impacts": (
        hv.Ensemble(within="1%"),
        table(restitution=0.3),
        "nondimensional.mu",
        0.1,
        2.0,
    ),
    "ensemble, hardening": (
        hv.Ensemble(within="1%"),
        table(alpha=3.0, D11=0.2),
        "nondimensional.mu",
        0.1,
        2.0,
    ),
    "ideal, bridge and stop": (
        hv.Ideal(within="1%", judged=False),
        hv.load(EXAMPLES / "plate_with_stop.toml").with_load(BRIDGE),
        "load.parameters.R",
        1e5,
        1e7,
    ),
    "compiled, bridge": (
        hv.Compiled(within="1%", judged=False),
        hv.load(EXAMPLES / "plate_with_stop.toml").with_load(BRIDGE).replace(stop=None),
        "load.parameters.R",
        1e5,
        1e7,
    ),
    "averaged, stop": (hv.Averaged(), STOP, "nondimensional.mu", 0.1, 2.0),
    "exact, linear": (hv.Exact(), table(), "nondimensional.mu", 0.1, 2.0),
    "density, stop": (hv.Density(within="1%"), STOP, "nondimensional.mu", 0.5, 2.0),
}


def points():
    """CPU seconds per point of both ways, in turn, after a call of each that is not counted."""
    print(f"{'':26} {'alone':>10} {'together':>10} {'times':>6}")
    for name, (engine, scene, key, low, high) in KINDS.items():
        count = FEW if isinstance(engine, hv.Compiled) else COUNT
        scenes = [scene.varied({key: value}) for value in np.geomspace(low, high, count)]
        seconds = {"alone": [], "together": []}
        for k in range(4):
            for way, times in seconds.items():
                begin = time.process_time()
                if way == "together":
                    engine.run_many(scenes)
                else:
                    for part in scenes[:16]:
                        engine.run(part)
                spent = time.process_time() - begin
                if k:
                    times.append(spent / (count if way == "together" else min(count, 16)))
        alone = 1e3 * float(np.median(seconds["alone"]))
        together = 1e3 * float(np.median(seconds["together"]))
        print(f"{name:26} {alone:7.2f} ms {together:7.2f} ms {alone / together:6.1f}", flush=True)


def swept(count, workers, executor=None):
    """Sweep count x count points of load and restitution."""
    axes = {
        "nondimensional.mu": [*map(float, np.geomspace(0.02, 2.0, count))],
        "nondimensional.restitution": [*map(float, np.linspace(0.5, 0.98, count))],
    }
    execution = hv.Execution(workers=workers, executor=executor)
    engines = [hv.Ensemble(within="1%")]
    return hv.sweep(STOP, vary=axes, engines=engines, execution=execution)


def whole_map():
    """Wall seconds of 100 x 100 points."""
    swept(4, 1)
    for workers in (2, 1):
        begin = time.perf_counter()
        result = swept(100, workers)
        seconds = time.perf_counter() - begin
        errors = [row.mean_power.known_error95 / row.mean_power.value for row in result.rows]
        failed = sum(bool(row.error) for row in result.rows)
        print(
            f"{workers} processes: {seconds:.1f} s, largest error {100 * max(errors):.3g} %, "
            f"{failed} failed",
            flush=True,
        )


def scores():
    """The distribution of z of 1,000 points against runs of each alone by other seeds."""
    rng = np.random.default_rng(0)
    mus, rs = np.exp(rng.uniform(np.log(0.02), np.log(2.0), 1000)), rng.uniform(0.5, 0.98, 1000)
    scenes = [table(mu=float(mu), restitution=float(r)) for mu, r in zip(mus, rs, strict=True)]
    engine = hv.Ensemble(within="1%")
    together = engine.run_many(scenes, range(1000))
    alone = [engine.with_seed(5000 + k).run(scene) for k, scene in enumerate(scenes)]
    z = np.array(
        [
            (a.mean_power.value - b.mean_power.value)
            / np.hypot(a.mean_power.stderr, b.mean_power.stderr)
            for a, b in zip(together, alone, strict=True)
        ]
    )
    print(
        f"z of 1,000 points: mean {z.mean():.3f}, spread {z.std():.3f}, largest {abs(z).max():.2f}"
    )


def memory():
    """The largest memory of sweeps of so many points, each in a process of its own."""
    for count in (70, 141, 316):
        command = f"import many_designs as m; m.small({count})"
        subprocess.run([sys.executable, "-c", command], cwd=Path(__file__).parent, check=True)


def small(count):
    """Sweep count x count points to 5 %, and print the largest memory of this process."""
    axes = {
        "nondimensional.mu": [*map(float, np.geomspace(0.5, 2.0, count))],
        "nondimensional.restitution": [*map(float, np.linspace(0.8, 0.98, count))],
    }
    engines = [hv.Ensemble(within="5%")]
    hv.sweep(STOP, vary=axes, engines=engines, execution=hv.Execution(workers=2))
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{count * count} points: {most:.0f} MiB", flush=True)


def scaling():
    """CPU and wall seconds of 48 x 48 points, of this process and its workers; all begin with imports.

    Wall seconds are worth something on a quiet machine with a core for each worker only.
    """
    heads = f"{'this process':>13} {'workers':>9} {'sum':>9} {'over one':>9} {'wall':>9}"
    print(f"{'':16} {heads}")
    alone = None
    for name, way in {"pool": _by_pool, "Dask": _by_dask}.items():
        for count in (1, 2, 4):
            here, there, wall = way(count)
            alone = alone or here + there
            sums = f"{here + there:7.2f} s {(here + there) / alone:9.2f}"
            print(
                f"{name:8} {count:7} {here:11.2f} s {there:7.2f} s {sums} {wall:7.2f} s", flush=True
            )


def _by_pool(workers):
    """CPU seconds here and in the processes of a pool, from their start to their end, and wall seconds."""
    begin = time.perf_counter()
    here = time.process_time()
    there = _of_children()
    swept(48, workers)
    wall = time.perf_counter() - begin
    return time.process_time() - here, _of_children() - there, wall


def _of_children():
    """CPU seconds of the processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _by_dask(workers):
    """As `_by_pool`, in new workers of Dask with one thread each."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        Client(cluster) as client,
    ):
        begin = time.perf_counter()
        here = time.process_time()
        swept(48, None, client)
        here = time.process_time() - here
        wall = time.perf_counter() - begin
        return here, sum(client.run(time.process_time).values()), wall


if __name__ == "__main__":
    os.environ.setdefault("HARVESTER_THREADS", "1")
    parts = {"points": points, "map": whole_map, "z": scores, "memory": memory, "scaling": scaling}
    parts[sys.argv[1]]()
