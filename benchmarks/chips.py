"""Chips and the sensor node by the compiled circuit and by ngspice on the same drive: power, and when they switch.

    python benchmarks/chips.py [NAME ...]

prints for each the mean power of the load from rest, the times (s) at which the load begins to take
power, how many there are, and seconds of processor time.  Names are those of `CASES`, all by
default; ngspice takes minutes.
"""

import dataclasses
import sys
import time
from pathlib import Path

import numpy as np

import harvester as hv
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.cosimulation.runs import CoupledDevice, new_drive, run_in_this_process
from harvester.equations.problem import Problem
from harvester.errors import CircuitError
from harvester.mechanics.kernels.forcing import forcing

EXAMPLES = Path(__file__).parents[1] / "examples"
# name: example, parameters of its netlist that are changed, amplitude of the drive, seconds
CASES = {
    "ltc3588": ("bimorph_ltc3588", {"C": "10 uF"}, "0.6 g", 3.0),
    "bq25570": ("bimorph_bq25570", {}, "0.1 g", 5.0),
    "node": ("bimorph_node", {"C": "10 uF"}, "0.6 g", 3.0),
}
# the second where ngspice does not converge at the first
STEP = 0.05
RELTOLS = (1e-5, 1e-4)


def switching(energy: np.ndarray, seconds: float) -> np.ndarray:
    """The times at which the load begins to take power after it took next to none, from its energy at each step."""
    power = np.diff(energy, prepend=0.0)
    taken = power > 1e-2 * max(power.max(), 1e-300)
    return seconds * np.flatnonzero(taken[1:] & ~taken[:-1])


def main() -> None:
    """Compare the cases that are named."""
    for name in sys.argv[1:] or CASES:
        example, changed, amplitude, seconds = CASES[name]
        scene = hv.load(EXAMPLES / f"{example}.toml")
        load = dataclasses.replace(scene.load, parameters={**scene.load.parameters, **changed})
        excitation = dataclasses.replace(scene.excitation, acceleration_amplitude=amplitude)
        problem = Problem.of(dataclasses.replace(scene, load=load, excitation=excitation))
        eqs, scales = problem.equations, problem.scales
        n_steps = round(seconds * scales.frequency / STEP)
        noise = np.zeros(n_steps)
        shaking = forcing(eqs, STEP, n_steps, np.random.default_rng(0))
        circuit = CompiledCircuit(problem.circuit, scales)
        circuit.trace(eqs, noise[:8], STEP, shaking=shaking[:9])  # compiles
        begin = time.process_time()
        path = circuit.trace(eqs, noise, STEP, shaking=shaking)
        middle = time.process_time()
        for reltol in RELTOLS:
            last = time.process_time()
            device = CoupledDevice(
                eqs, scales, problem.circuit, STEP, 1, patience=1e9, reltol=reltol
            )
            try:
                drive = run_in_this_process(device, new_drive(device, noise, 0.0, shaking))
                break
            except CircuitError as error:
                print(f"{name:8} ngspice at {reltol:g}: {str(error)[:90]}", flush=True)
        else:
            continue
        spent = {"compiled": middle - begin, "ngspice": time.process_time() - last}
        taken = drive.kicked[:, 4] * (float(drive.state[0].load) / drive.kicked[-1, 4])
        energies = {"compiled": path.square / circuit.resistance, "ngspice": taken}
        for by, energy in energies.items():
            times = switching(energy, STEP / scales.frequency)
            said = ", ".join(f"{one:.4f}" for one in times[:6])
            print(
                f"{name:8} {by:9} {1e6 * energy[-1] / seconds:10.3f} uW  {len(times):4d} times: {said}  "
                f"{spent[by]:.2f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
