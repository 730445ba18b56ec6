"""Sweeps: do they survive, do they scale, what does a point cost?

1. A sweep of 200 points with three engines is killed 20 times (`kill -9` of the program, a worker or an ngspice) at
   random moments; after `--resume` its table must be that of an undisturbed run.
2. Points a second: one process of one thread, a pool of two processes, Dask with two workers of one thread, in turn,
   once all are warm.  Other work on the machine shares its cores: the best of three turns counts.
3. Overhead: points that fail at once, so that all that is left is what the sweep itself costs; and the memory of the
   program while it runs 10,000 of them.
4. 100,000 points of `averaged` on two processes, start-up, table, dataset and plot included.
"""

import argparse
import contextlib
import json
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import kills
from common import report

import harvester as hv
from harvester.errors import HarvesterError
from harvester.machine.cores import THREADS_VARIABLE
from harvester.machine.progress import CallingBack
from harvester.studies.sweep.cluster import dask_client
from harvester.studies.sweep.points import read_axis

PLATE = hv.load("examples/plate_with_stop.toml")
QUICK = hv.loads(kills.SCENE)
ADDRESS = "tcp://127.0.0.1:18786"


def survival(count, points):
    """Tables after a kill and a resume that equal the undisturbed one."""
    rng = random.Random(7)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole"
        kills.start(kills.command(folder, points, whole)).communicate()
        expected = kills.table(whole)
        for k in range(count):
            out = Path(folder) / f"{k}"
            who = kills.WHO[k % 3]
            least = rng.randrange(0 if who == "program" else 1, 3 * points)
            found, table = kills.trial(kills.command(folder, points, out), out, who, least, rng)
            rows.append({"what": "killed", **found, "same": table == expected})
            print(rows[-1], flush=True)
    return rows


class Clock:
    """When each row was done, and the processor time of this process and those that it has waited for."""

    def __init__(self):
        self.at = []

    def __call__(self, _):
        self.at.append(time.perf_counter())

    def rate(self, skipped):
        """Rows a second after the first ``skipped``."""
        return (len(self.at) - 1 - skipped) / (self.at[-1] - self.at[skipped])


def processor():
    """User and system seconds of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def told(clock, **how):
    """An execution that tells the clock of each row."""
    return hv.Execution(progress=CallingBack(lambda _, engine: clock(engine)), **how)


def swept(scene, axis, engine, **how):
    """A sweep's clock, its wall time and its processor time; that every point fails is no matter here."""
    clock = Clock()
    begin = time.perf_counter()
    used = processor()
    with tempfile.TemporaryDirectory() as out, contextlib.suppress(HarvesterError):
        hv.sweep(
            scene, vary=[read_axis(axis)], engines=[engine], execution=told(clock, out=out, **how)
        )
    return clock, time.perf_counter() - begin, processor() - used


@contextlib.contextmanager
def cluster():
    """A Dask scheduler and two workers of one thread each."""
    dask = [str(Path(sys.executable).with_name("dask"))]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    ran = [
        subprocess.Popen(
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "18786", "--no-dashboard"],
            **quiet,
        )
    ]
    time.sleep(3)
    worker = [*dask, "worker", ADDRESS, "--nthreads", "1", "--nworkers", "2", "--no-dashboard"]
    ran.append(subprocess.Popen(worker, **quiet))
    try:
        yield
    finally:
        for one in reversed(ran):
            one.terminate()
            one.wait()


def scaling(turns):
    """Points a second: pool over one process, Dask over pool."""
    rows = []
    # one thread here; the workers of a pool have one each anyway
    os.environ[THREADS_VARIABLE] = "1"
    cases = {
        "ensemble": (hv.Ensemble(trajectories=1024, duration=300.0), "load.resistance=100k:1M:60"),
        "spice": (hv.Spice(trajectories=8, duration=30.0), "load.resistance=300k:1M:16"),
    }
    with cluster(), dask_client(ADDRESS) as client:
        for name, (engine, axis) in cases.items():
            best = {"one process": 0.0, "pool of 2": 0.0, "dask, 2 workers": 0.0}
            ways = ({"workers": 1}, {"workers": 2}, {"executor": client})
            for _ in range(turns):
                for way, how in zip(best, ways, strict=True):
                    clock, _, _ = swept(PLATE, axis, engine, **how)
                    best[way] = max(best[way], clock.rate(6))
            one, pool, dask = best.values()
            rows.append(
                {
                    "what": f"points/s, {name}",
                    **best,
                    "pool/one": pool / one,
                    "dask/pool": dask / pool,
                }
            )
            print(rows[-1], flush=True)
    del os.environ[THREADS_VARIABLE]
    return rows


def resident():
    """MB of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def overhead(points):
    """Milliseconds a point that fails at once, and the memory of the program from the 1,000th point on."""
    memory = []

    class Watching(Clock):
        def __call__(self, engine):
            super().__call__(engine)
            if len(self.at) % 500 == 0:
                memory.append(resident())

    netlist = PLATE.with_load(hv.Load(netlist="bridge", parameters={"R": 1e6}))
    rows = []
    for workers in (1, 2):
        memory.clear()
        clock, used = Watching(), processor()
        with tempfile.TemporaryDirectory() as out, contextlib.suppress(HarvesterError):
            axis = read_axis(f"load.parameters.R=1k:1M:{points}")
            hv.sweep(
                netlist,
                vary=[axis],
                engines=[hv.Ensemble()],
                execution=told(clock, out=out, workers=workers),
            )
        row = {
            "what": "overhead",
            "workers": workers,
            "points": points,
            "ms a point": 1e3 / clock.rate(100),
        }
        row |= {"processor ms a point": 1e3 * (processor() - used) / points}
        rows.append(row | {"MB at 1,000": memory[1], "MB at the end": memory[-1]})
        print(rows[-1], flush=True)
    return rows


def many(points):
    """A whole sweep of `averaged`."""
    _, wall, used = swept(PLATE, f"load.resistance=1k:10M:{points}", hv.Averaged(), workers=2)
    return [
        {
            "what": "averaged",
            "points": points,
            "wall s": wall,
            "processor s": used,
            "on 2 idle cores s": used / 2,
        }
    ]


PARTS = {
    "survival": lambda: survival(20, 200),
    "scaling": lambda: scaling(3),
    "overhead": lambda: overhead(10_000),
    "many": lambda: many(100_000),
}


def main(parts):
    """The parts asked for; the rows of the others stay as they were."""
    path = Path(__file__).parent / "results" / "sweeps.json"
    rows = json.loads(path.read_text())["rows"] if path.exists() else []
    for part in parts:
        rows = [row for row in rows if row["part"] != part] + [
            {"part": part, **row} for row in PARTS[part]()
        ]
    report("sweeps", rows, ("distributed", "xarray", "loky"))


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument(
        "parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: all"
    )
    main(arguments.parse_args().parts or list(PARTS))
