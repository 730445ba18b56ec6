"""CPU time of all elasticities of a board and its power, over that of the power to 1 %.

    python benchmarks/sensitivity_price.py

Each in turn after a call of each that is not counted, on one core; the power has the same engine.
"""

import os
import time
from dataclasses import replace
from pathlib import Path

import harvester as hv

EXAMPLES = Path(__file__).parent.parent / "examples"
PLATE = hv.Scene(
    oscillator=hv.Oscillator(mass="40 g", stiffness=16.0, damping=6.4e-3),
    piezo=hv.Piezo(coupling=1e-3, capacitance="50.2 nF"),
    excitation=hv.Excitation(acceleration_psd="1e-5 g^2/Hz"),
)
BRIDGE = hv.Load(netlist="bridge", parameters={"R": "1.5 Mohm", "C": "1 uF"})
SHUNT = hv.Load(netlist="resistor", parameters={"R": "500 kohm"})
STOP = hv.Stop(gap="0.5 mm", restitution=0.7)
CASES = {
    "resistor as a netlist": (hv.Compiled, PLATE.with_load(SHUNT)),
    "bridge with 1 uF": (hv.Compiled, PLATE.with_load(BRIDGE)),
    "bridge with 1 uF, stop": (hv.Compiled, replace(PLATE.with_load(BRIDGE), stop=STOP)),
    "bimorph_board.toml": (hv.Slow, hv.load(EXAMPLES / "bimorph_board.toml")),
}


def main():
    """Print a line for each case."""
    print(f"{'':24} {'power':>8} {'with keys':>10} {'times':>6} {'keys':>5} {'error':>6}")
    for name, (engine, scene) in CASES.items():
        for _ in range(2):
            begin = time.process_time()
            engine(within="1%").run(scene)
            power = time.process_time() - begin
        for _ in range(2):
            begin = time.process_time()
            found = hv.sensitivity(scene, progress=False)
            whole = time.process_time() - begin
        worst = max(slope.known_error95 for slope in found.elasticities)
        counts = f"{whole / power:6.1f} {len(found.keys):5} {worst:6.3f}"
        print(f"{name:24} {power:6.2f} s {whole:8.2f} s {counts}", flush=True)


if __name__ == "__main__":
    os.environ.setdefault("HARVESTER_THREADS", "1")
    main()
