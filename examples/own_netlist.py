"""A circuit of your own: a bridge with a Zener diode that limits its output, beside the package's bridge.

    .venv/bin/python examples/own_netlist.py            # half a minute
    .venv/bin/python examples/own_netlist.py --quick    # few and short runs of a coarse step

A netlist is a subcircuit of two terminals, the piezo's, with a resistor Rload, whose power is
reported.  `Csmooth` is waited for while it charges.
"""

import argparse
import tempfile
from pathlib import Path

import harvester as hv

HERE = Path(__file__).parent
LIMITED = """* Bridge whose output a Zener diode limits, as the input of a chip asks for
.subckt limited p n R=1Meg C=0.2u Vz=2.5
.model diode D(Is=2.52n N=1.752 Rs=0.568 Cjo=4p Bv=100)
.model zener D(Is=1n Bv={Vz} Ibv=1u)
D1 p a diode
D2 n a diode
D3 b p diode
D4 b n diode
Dlimit b a zener
Csmooth a b {C}
Rload a b {R}
.ends limited
.end
"""


def main() -> None:
    """Write the netlist, run both circuits, print both powers."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--quick", action="store_true", help="few and short runs of a coarse step")
    given = options.parse_args()
    quick = hv.Spice(trajectories=2, duration=1.0, dt=0.02, alone=True)
    engine = quick if given.quick else hv.Spice(trajectories=8, duration=100.0)

    scene = hv.load(HERE / "plate_bridge.toml")
    values = {"R": "1 Mohm", "C": "0.2 uF"}  # those of both
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder) / "limited.cir"
        own.write_text(LIMITED)
        for title, netlist in (("bridge", "bridge"), ("bridge, limited to 2.5 V", str(own))):
            load = hv.Load(netlist=netlist, parameters=values)
            print(f"\n{title}\n{engine.run(scene.with_load(load))}")


if __name__ == "__main__":
    main()
