"""What grows with the number of ngspice runs: memory, descriptors, threads, processes, files; and a day of it.

Short runs of three circuits in turn, in this process and the ngspice processes that it keeps, as a
long sweep has them.
"""

import os
import tempfile
import time
from pathlib import Path
from unittest import mock

from attacks.tally import below

import harvester as hv
from harvester.machine.folders import cache_folder
from tests.support.paths import EXAMPLES

TOGETHER = 20  # runs of one estimate
LOOKS = 20  # at what has grown, evenly spread
SCENES = [
    hv.load(EXAMPLES / f"{name}.toml") for name in ("plate_with_stop", "plate", "paper_figure3")
]
DAY = 86_400.0


def attack(tally, seed):
    """`measured` with a temporary folder of its own."""
    variable = mock.patch.dict(os.environ)
    with (
        tempfile.TemporaryDirectory() as name,
        mock.patch.object(tempfile, "tempdir", name),
        variable,
    ):
        os.environ["TMPDIR"] = name  # of its processes
        return measured(tally, seed)


def measured(tally, seed):
    """Runs for the tally, and what has grown meanwhile, with what a day would add at that rate."""
    looks = []
    for number in tally.numbers(TOGETHER):
        engine = hv.Spice(
            alone=True, trajectories=TOGETHER, duration=1.0, dt=0.02, seed=seed + number
        )
        estimate = engine.run(SCENES[number // TOGETHER % len(SCENES)])
        for _ in range(TOGETHER):
            tally.note("ngspice run", "done", "" if estimate.mean_power.value > 0.0 else "no power")
        if tally.tried * LOOKS >= tally.count * (len(looks) + 1):
            looks.append(
                {"runs": tally.tried, "seconds": time.monotonic() - tally.begin, **resources()}
            )
            print(looks[-1], flush=True)
    return {"looks": looks, "a day": a_day(looks)}


def resources():
    """Sums over this process and those below it, and files that could be left somewhere."""
    every = list(below(os.getpid()))
    found = dict.fromkeys(("MB", "largest MB", "descriptors", "threads"), 0.0)
    for pid in every:
        process = Path(f"/proc/{pid}")
        memory = int((process / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
        found["MB"] += memory
        found["largest MB"] = max(found["largest MB"], memory)
        found["descriptors"] += len(list((process / "fd").iterdir()))
        found["threads"] += len(list((process / "task").iterdir()))
    cache = cache_folder()
    found["files in the cache"] = (
        0 if cache is None else sum(1 for path in cache.rglob("*") if path.is_file())
    )
    own = [name for pid in every for name in os.listdir("/dev/shm") if f"-{pid}-" in name]  # noqa: PTH208
    return {
        "processes": len(every),
        **found,
        "temporary files": len(own) + len(os.listdir(tempfile.gettempdir())),  # noqa: PTH208
    }


def a_day(looks):
    """The growth from a fifth of the looks on, when all is warm, made that of a day without a pause."""
    if len(looks) < 3:
        return {}
    first = looks[len(looks) // 5]
    last = looks[-1]
    rate = DAY / (last["seconds"] - first["seconds"])
    found = {
        key: round((last[key] - first[key]) * rate, 3)
        for key in last
        if key not in ("runs", "seconds")
    }
    return {"runs": round((last["runs"] - first["runs"]) * rate), **found}
