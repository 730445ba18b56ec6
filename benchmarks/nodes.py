"""Sensor nodes beside direct runs: a record of an hour, and chips without a netlist under a drive.

    python benchmarks/nodes.py hour     bursts of 20 s in every 5 minutes: the command on an hour, packets of 10 minutes
    python benchmarks/nodes.py chips    three chips by `node` and by their law: the first packet, and how long they run

The whole process of the command is timed, first with an empty cache of compiled kernels and then
with a full one.  A direct run takes minutes: mass, the netlist's own diodes and the store itself, a
vibration at a time.  The numbers stand in docs/charging.md.
"""

import dataclasses
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.direct_node import direct_course
from harvester.storage.measured_current import measured
from harvester.storage.node_run import NodeRun
from harvester.storage.supply import chip_of
from tests.support.bursts import bursts, on_record, packets_directly, tone, truck
from tests.support.paths import EXAMPLES

EVERY = 300.0
TEN_MINUTES = 600.0
HOUR = 3600.0
INTERVALS = 1.0, 3.0  # s between packets, of the comparison


def timed(path: str, cache: str) -> str:
    """What the command takes for a scene on an hour, and its packets an hour."""
    words = [
        sys.executable,
        "-m",
        "harvester",
        "node",
        path,
        "--days",
        repr(HOUR / 86400.0),
        "--json",
    ]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    done = subprocess.run(
        words, env={**os.environ, "NUMBA_CACHE_DIR": cache}, capture_output=True, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    packets = json.loads(done.stdout)["packets_per_hour"]
    wall = time.perf_counter() - begin
    return f"{spent:5.1f} s of the processor, {wall:5.1f} s, {packets['value']:.4g} +- {packets['error95']:.2g} packets"


def hour(folder: Path) -> None:
    """Both kinds of bursts: the time of the command, and packets of ten minutes."""
    for shaking in (tone, truck):
        scene = on_record(folder, *bursts(HOUR, EVERY, of=shaking))
        text = (EXAMPLES / "bimorph_packets.toml").read_text()
        before, _, rest = text.partition("[excitation]")
        after = rest[rest.index("[load]") :]
        path = folder / "hour.toml"
        path.write_text(f'{before}[excitation]\nacceleration_file = "record.csv"\n\n{after}')
        with tempfile.TemporaryDirectory() as cache:
            for state in ("empty", "full"):
                print(
                    f"{shaking.__name__}: an hour, {state} cache: {timed(str(path), cache)}",
                    flush=True,
                )
        scene = on_record(folder, *bursts(TEN_MINUTES, EVERY, of=shaking))
        for interval in INTERVALS:
            sending = scene.node.replace(interval=interval, currents=(0.4e-3, 2e-3))
            store = scene.storage.replace(capacitance=100e-6, esr=None)
            one = dataclasses.replace(scene, node=sending, storage=store)
            slow = (
                hv.node(one, days=TEN_MINUTES / 86400.0).packets_per_hour.value * TEN_MINUTES / HOUR
            )
            packets = f"{slow:.4g} packets, directly {packets_directly(one, TEN_MINUTES)}"
            print(f"{shaking.__name__}: ten minutes, every {interval:g} s: {packets}", flush=True)


def chips(_: Path) -> None:
    """Each chip at two shakings with two stores, 20 s of it; its node takes 360 uA as long as it can."""
    for chip in ("adp5091", "aem30940", "spv1050"):
        for acceleration in ("0.07 g", "0.1 g"):
            for store in ("2.2 uF", "10 uF"):
                scene = scene_of(chip, acceleration, store)
                result = hv.node(scene, days=0.01)
                problem = Problem.of(scene)
                run = NodeRun(
                    measured(problem).best, scene.storage, scene.node, chip_of(scene.chip, 1.8)
                )
                direct = direct_course(problem, run, 20.0)
                slow = run.course(20.0)
                share = f"runs {slow.ran / 20.0:.2%}, directly {direct.ran / 20.0:.2%}"
                print(
                    f"{chip} {acceleration} {store}: first {result.first_packet}, directly {direct.first}; {share}",
                    flush=True,
                )


def scene_of(chip: str, acceleration: str, store: str) -> hv.Scene:
    """The bimorph with a chip that begins at 3 V."""
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml").vary(
        "excitation.acceleration_amplitude", acceleration
    )
    states = {
        "interval": 2e-3,
        "currents": (360e-6,),
        "durations": (1e-3,),
        "sleep_current": 360e-6,
    }
    return dataclasses.replace(
        scene,
        load=hv.Netlist("bridge", Is=1e-7, N=1.0),
        storage=hv.Storage(capacitance=store),
        node=hv.SensorNode(wake_voltage=0.1, stop_voltage=0.05, supply_voltage=1.8, **states),
        chip=hv.HarvestingChip(name=chip, start_voltage=3.0, stop_voltage=2.7),
    )


def main() -> None:
    """One part or the other."""
    parts = {"hour": hour, "chips": chips}
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or parts:
            parts[name](Path(folder))


if __name__ == "__main__":
    main()
