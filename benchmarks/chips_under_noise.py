"""Five chips under noise, each with two stores: the time from rest to the start voltage by `node` and by direct runs.

    python benchmarks/chips_under_noise.py CHIP STORE [ENGINE]

Direct runs of an LTC3588 and a BQ25570 are charges of their netlists by an engine, `spice` (8 of
them, minutes) or `compiled` (64); their target is 0.1 V below the start, where the netlist's output
takes nothing yet.  For the others the law is run in slices, with the netlist's own diodes.  The
table stands in docs/charging.md.
"""

import dataclasses
import math
import sys

import numpy as np

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.direct_node import direct_course
from harvester.storage.measured_current import measured
from harvester.storage.node_run import NodeRun
from harvester.storage.supply import chip_of

STARTS = {"ltc3588": (4.9, 3.3), "bq25570": (2.9, 1.8)}
RUNS = {"spice": 8, "compiled": 64}
LAWS = 8


def scene_of(chip, store):
    start, output = STARTS.get(chip, (3.0, 1.8))
    tracks = chip != "ltc3588"
    return dataclasses.replace(
        hv.load("examples/bimorph_ltc3588.toml"),
        excitation=hv.Excitation(acceleration_psd="0.002 g^2/Hz"),
        load=hv.Netlist("bridge", Is=1e-7 if tracks else 4.4e-9, N=1.0),
        storage=hv.Storage(capacitance=store),
        node=hv.SensorNode(
            wake_voltage=0.1,
            stop_voltage=0.05,
            interval=1e3,
            currents=(1e-6,),
            durations=(1e-3,),
            supply_voltage=output,
        ),
        chip=hv.HarvestingChip(name=chip, start_voltage=start, stop_voltage=2.4),
    )


def main():
    chip, store, engine = [*sys.argv[1:], "compiled"][:3]
    scene = scene_of(chip, store)
    first = hv.node(scene, days=0.01).first_packet
    print(f"node: {first}")
    if chip in STARTS:
        own = hv.load(f"examples/bimorph_{chip}.toml").load.parameters | {
            "C": store,
            "Cout": "10 uF",
        }
        alone = {"load": hv.Netlist(chip, **own), "storage": None, "node": None, "chip": None}
        charged = hv.charge(
            dataclasses.replace(scene, **alone),
            to=STARTS[chip][0],
            engine=engine,
            trajectories=RUNS[engine],
            duration=10.0 * first.value,
        )
        print(f"{engine}: {charged.time}")
        return
    problem = Problem.of(scene)
    run = NodeRun(measured(problem).best, scene.storage, scene.node, chip_of(scene.chip, 1.8))
    times = [
        direct_course(problem, run, 1.5 * first.value, seed).first or math.nan
        for seed in range(LAWS)
    ]
    print(
        f"its law: {np.mean(times):.4g} +- {np.std(times, ddof=1) / math.sqrt(LAWS):.2g} s (one standard error)"
    )


if __name__ == "__main__":
    main()
