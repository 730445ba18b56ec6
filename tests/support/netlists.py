"""Load circuits of users' kind, as text, and compiled circuits of them on a device."""

import harvester as hv
from harvester.circuits.compiled_circuit import CompiledCircuit
from harvester.equations.problem import Problem
from harvester.netlists.load_circuit import netlist_folder

PLATE = hv.Scene(
    oscillator=hv.Oscillator(mass="40 g", stiffness=16.0, damping=6.4e-3),
    piezo=hv.Piezo(coupling=1e-3, capacitance="50.2 nF"),
    excitation=hv.Excitation(acceleration_psd="1e-5 g^2/Hz"),
)
BRIDGE = "D1 p a {0}\nD2 n a {0}\nD3 b p {0}\nD4 b n {0}\n"
STORE = "Csmooth a b 1u\nRload a b 1.5Meg\n"


def written(folder, body, name="board"):
    """The file of a netlist whose subcircuit has this body."""
    path = folder / f"{name}.cir"
    path.write_text(f"* a board\n.subckt {name} p n\n{body}\n.ends {name}\n")
    return str(path)


def original(name):
    """The text of one of the package's subcircuits and of all parts as it is in the files, for ngspice alone."""
    folder = netlist_folder()
    lines = (folder / f"{name}.cir").read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith(f".subckt {name} "))
    last = next(k for k, line in enumerate(lines) if line.startswith(f".ends {name}"))
    return "\n".join(
        [
            *lines[first : last + 1],
            *(path.read_text() for path in sorted(folder.glob("parts/*.lib"))),
        ]
    )


def on_plate(folder, body, name="board"):
    """The plate with a netlist of this body as its load."""
    return PLATE.with_load(netlist=written(folder, body, name))


def compiled(scene):
    """The compiled circuit of a scene."""
    problem = Problem.of(scene)
    return CompiledCircuit(problem.circuit, problem.scales)
