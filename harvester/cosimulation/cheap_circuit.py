"""The load without ngspice that runs of ngspice go beside: made of ideal elements, or compiled."""

from harvester.circuits.compiled_circuit import CompiledCircuit, compiled_circuit
from harvester.cosimulation.idealised import ideal_circuit
from harvester.equations.scales import Scales
from harvester.errors import InputError
from harvester.mechanics.kernels.ideal_circuit import IdealCircuit
from harvester.netlists.load_circuit import LoadCircuit


def cheap_circuit(load: LoadCircuit, scales: Scales) -> IdealCircuit | CompiledCircuit | None:
    """The circuit of ideal elements of a load that has one, else its compiled circuit; None where neither serves it."""
    ideal = ideal_circuit(load, scales)
    if ideal is not None:
        return ideal
    try:
        return compiled_circuit(load, scales)
    except InputError:
        return None
