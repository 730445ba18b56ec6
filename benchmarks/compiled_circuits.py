"""Compiled circuits against ngspice: the mean power on the same noise, on the package's netlists and on users' kind.

    .venv/bin/python benchmarks/compiled_circuits.py [NAME ...] [--kicks 3000] [--reltol 1e-6]

Without a stop, as impacts amplify the last digit of any method.  Each row: the error of the power
of Rload, the correlation of V, processor time a kick of both, substeps a kick, and how many of them
did not converge.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import harvester as hv
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.cosimulation.runs import CoupledDevice, new_drive, run_in_this_process
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.mechanics.kernels.noise import three_point_grid

ROOT = Path(__file__).parents[1]
BRIDGE = "D1 p a {0}\nD2 n a {0}\nD3 b p {0}\nD4 b n {0}\n"
STORE = "Csmooth a b 1u\nRload a b 1.5Meg\n"
ZENER = ".model zener D(Is=1n Bv={0} Ibv=1u)\n"
RELAY = ".model relay SW(Ron=1k Roff=1G Vt={0} Vh={1})\n"


def multiplier(stages: int, diode: str) -> str:
    """A Cockcroft-Walton multiplier of so many stages."""
    lines = []
    for k in range(stages):
        below, pump = ("n" if k == 0 else f"s{k}"), ("p" if k == 0 else f"u{k}")
        above, next_pump = f"s{k + 1}", f"u{k + 1}"
        lines += [f"C{k}a {pump} {next_pump} 100n", f"D{k}a {below} {next_pump} {diode}"]
        lines += [f"D{k}b {next_pump} {above} {diode}", f"C{k}b {below} {above} 100n"]
    return "\n".join([*lines, f"Rload s{stages} n 20Meg"])


USERS = {
    "bridge of 1N4148": BRIDGE.format("1N4148") + STORE,
    "bridge of 1N4007": BRIDGE.format("1N4007") + STORE,
    "bridge of 1N5817": BRIDGE.format("1N5817") + STORE,
    "bridge of BAT54": BRIDGE.format("BAT54") + STORE,
    "bridge of SMS7630": BRIDGE.format("SMS7630") + STORE,
    "doubler of BAT54": "D1 n p BAT54\nD2 p a BAT54\nCsmooth a n 1u\nRload a n 6Meg",
    "doubler of 1N5817": "D1 n p 1N5817\nD2 p a 1N5817\nCsmooth a n 1u\nRload a n 6Meg",
    "quadrupler of BAT54": multiplier(2, "BAT54"),
    "multiplier of six diodes": multiplier(3, "1N4148"),
    "zener clamp": ZENER.format(1.2) + BRIDGE.format("1N4148") + STORE + "Dz b a zener",
    "zeners back to back": ZENER.format(1.5)
    + "Da p m zener\nDb n m zener\n"
    + BRIDGE.format("BAT54")
    + STORE,
    "LC filter": BRIDGE.format("BAT54")
    + "C1 a b 100n\nL1 a c 10\nCsmooth c b 1u\nRload c b 1.5Meg",
    "coil across the piezo": "L1 p m 5k\nR1 m n 20k\n" + BRIDGE.format("BAT54") + STORE,
    "coupled coils": "R1 p q 10k\nL1 q n 2k\nL2 s t 500\nK1 L1 L2 0.8\nD1 s a BAT54\nCsmooth a t 1u\n"
    "Rload a t 300k\nR2 t n 1Meg",
    "switch with hysteresis": RELAY.format(1.5, 0.3)
    + BRIDGE.format("BAT54")
    + "Csmooth a b 0.1u\nS1 a c a b relay\nRload c b 400k",
    "switch by current": ".model cs CSW(Ron=1k Roff=1G It=0.3u Ih=0.05u)\n"
    + BRIDGE.format("BAT54")
    + "Csmooth a b 1u\nV1 a d 0\nR9 d b 3Meg\nW1 a c V1 cs\nRload c b 2Meg",
    "half-bridge with a comparator": BRIDGE.format("BAT54")
    + "Csmooth a b 0.2u\nBc g1 b V=0.5+0.5*tanh(50*(v(a,b)-1.5+0.5*v(g,b)))\nRc g1 g 1Meg\nCc g b 100p\n"
    "B1 a c I=v(a,c)*(1n+1m*v(g,b))\nB2 c b I=v(c,b)*(1n+1m*(1-v(g,b)))\nRload c b 400k",
    "supercapacitor with ESR": BRIDGE.format("BAT54")
    + "R1 a c 30\nCsmooth c b 100u\nR2 c b 10Meg\nRload a b 1Meg",
    "regulator by B sources": BRIDGE.format("BAT54")
    + "Csmooth a b 1u\nBi i b V=10u*min(uramp(5*(v(a,b)-0.6)),1)*min(50*uramp(0.8-v(o,b)),1)\n"
    "Bin a b I=v(i,b)*v(o,b)/0.85/max(v(a,b),0.3)\nBout b o I=v(i,b)\nC2 o b 2u\nRload o b 500k",
    "diodes of 1 fA without Rs": ".model ideal D(Is=1f)\n" + BRIDGE.format("ideal") + STORE,
    "MOSFET bridge": ".model up PMOS(Level=1 Vto=-0.45 Kp=20u Cbd=5p Cgso=50n)\n"
    ".model down NMOS(Level=1 Vto=0.45 Kp=50u Lambda=0.01 Cbd=5p)\n"
    "M1 p n a a up W=200u L=2u\nM2 n p a a up W=200u L=2u\nM3 p n b b down W=200u L=2u\nM4 n p b b down W=200u L=2u\n"
    + STORE,
    "regulator of bipolar transistors": ".model ref D(Is=1n Bv=1 Ibv=0.2u)\n"
    + BRIDGE.format("BAT54")
    + "Csmooth a b 1u\nR1 a q 2Meg\nDz b q ref\nQ1 a q e 2N3904\nQ2 e k o 2N3906\nR2 k b 5Meg\nC2 o b 100n\n"
    "Rload o b 500k",
    "JFET as current limiter": ".model jn NJF(Vto=-1 Beta=3u Lambda=0.02 Cgs=4p Cgd=2p)\n"
    + BRIDGE.format("BAT54")
    + "Csmooth a b 1u\nJ1 a s c jn\nRs c s 300k\nRload s b 400k",
    "series resistor": "R1 p a 100k\nCx a n 10n\nRload a n 500k",
}
SCENES = {
    "bridge": "plate_bridge", "doubler": "plate_doubler", "parallel_sshi": "plate_parallel_sshi",
    "series_sshi": "plate_series_sshi", "sece": "plate_sece", "sshc": "bimorph_sshc", "ltc3588": "bimorph_ltc3588",
    "bq25570": "bimorph_bq25570", "node": "bimorph_node", "self_powered_sshi": "bimorph_self_powered_sshi",
    "board from KiCad": "bimorph_board",
}  # fmt: skip


def compared(scene: hv.Scene, kicks: int, reltol: float, h: float = 0.05) -> str:
    """One row of the table."""
    problem = Problem.of(scene.without_stop())
    eqs, scales = problem.equations, problem.scales
    try:
        circuit = CompiledCircuit(problem.circuit, scales)
    except HarvesterError as error:
        return f"not served: {error}"
    noise = three_point_grid(np.random.SeedSequence(3), kicks)
    device = CoupledDevice(eqs, scales, problem.circuit, h, 1, patience=1e9, reltol=reltol)
    begin = time.process_time()
    try:
        drive = run_in_this_process(device, new_drive(device, noise, 0.0))
    except HarvesterError as error:
        return f"ngspice: {error}"
    middle = time.process_time()
    circuit.trace(eqs, noise, h, 1)
    compiled = time.process_time()
    path = circuit.trace(eqs, noise, h, 1)
    end = time.process_time()
    seconds = kicks * h / scales.frequency
    ours = path.square[-1] / circuit.resistance / seconds
    theirs = float(drive.state[0].load) / seconds
    scale = max(theirs, 1e-6 * scales.watts * (eqs.beta or 1.0))
    return (
        f"{100.0 * (ours - theirs) / scale:+9.4f} % {np.corrcoef(drive.path().V, path.V)[0, 1]:10.7f} "
        f"{1e6 * (middle - begin) / kicks:8.1f} {1e6 * (end - compiled) / kicks:8.2f} "
        f"{path.steps / kicks:7.2f} {path.failed:5d}"
    )


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("names", nargs="*")
    options.add_argument("--kicks", type=int, default=3000)
    options.add_argument("--reltol", type=float, default=1e-6)
    given = options.parse_args()
    print(
        f"{'circuit':32}{'power':>11} {'corr. of V':>10} {'ngspice':>8} {'compiled':>8} {'steps':>7} {'failed':>5}"
    )
    plate = hv.load(ROOT / "examples" / "plate_bridge.toml")
    compared(plate, 10, given.reltol)  # compiles what the first row would pay for
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, body) in enumerate(USERS.items()):
            if not given.names or name in given.names:
                path = Path(folder) / f"board{k}.cir"
                path.write_text(f"* {name}\n.subckt board{k} p n\n{body}\n.ends\n")
                scene = plate.with_load(netlist=str(path))
                print(f"{name:32}{compared(scene, given.kicks, given.reltol)}", flush=True)
        for name, file in SCENES.items():
            if not given.names or name in given.names:
                scene = hv.load(ROOT / "examples" / f"{file}.toml")
                print(f"{name:32}{compared(scene, given.kicks, given.reltol)}", flush=True)


if __name__ == "__main__":
    main()
