"""Whether `node` under noise states its whole error: many seeds beside a count of many nodes directly, without means.

    python benchmarks/nodes_under_noise.py SCENE [SEEDS]

SCENE is `bridge` (the package's), `board` (a user's own four diodes, compared with ngspice) or
`stop` (such a board behind a mass with a stop).  Direct are 128 nodes of 200 s on a noise of their
own, behind ideal diodes, from which the board's differ little
(`tests/storage/test_direct_nodes.py`).  Each number is compared by its z-score, with the whole
error over 1.96 and the sampling of the direct count.
"""

import sys
import time

import numpy as np

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.measured_current import measured
from harvester.storage.node_run import NodeRun
from harvester.uncertainty.value import mean_and_error, stderr_of95
from tests.support.direct_nodes import direct_nodes
from tests.support.own_board import noisy_node

SECONDS = 200.0
COUNT = 128
DAY = 86400.0
HOUR = 3600.0
WEAK = hv.Excitation(acceleration_psd="0.0002 g^2/Hz")
SCENES = {
    "bridge": lambda: noisy_node(load=hv.Netlist("bridge")),
    "board": lambda: noisy_node(excitation=WEAK, node={"interval": 8.0}),
    "stop": lambda: noisy_node(node={"interval": 4.0}, stop=hv.Stop(gap=2e-4, restitution=0.7)),
}


def main():
    name, seeds = sys.argv[1], int([*sys.argv[2:], "40"][0])
    scene = SCENES[name]()
    problem = Problem.of(scene)
    run = NodeRun(measured(problem, count=4, runs=64).best, scene.storage, scene.node)
    found = direct_nodes(problem, run, SECONDS, COUNT, seed=1000)
    truth = [
        mean_and_error(values)
        for values in (
            found.packets / found.seconds * HOUR,
            (found.given - found.clamped) / found.seconds,
            found.first[found.first > 0.0],
        )
    ]
    print("directly:", *(f"{mean:.4g} +- {1.96 * error:.2g}" for mean, error in truth), flush=True)
    scores = []
    for seed in range(seeds):
        begin = time.process_time()
        node = hv.node(scene, days=SECONDS / DAY, seed=seed)
        values = node.packets_per_hour, node.harvested, node.first_packet
        scores.append(
            [
                (value.value - mean) / np.hypot(stderr_of95(value.known_error95), error)
                for value, (mean, error) in zip(values, truth, strict=True)
            ]
        )
        z = " ".join(f"{score:+.2f}" for score in scores[-1])
        print(seed, *values, z, f"{time.process_time() - begin:.1f} s", sep=" | ", flush=True)
    table = np.abs(scores)
    print(
        "inside, largest |z|, mean z:",
        (table < 1.96).sum(axis=0),
        table.max(axis=0),
        np.mean(scores, axis=0),
    )


if __name__ == "__main__":
    main()
