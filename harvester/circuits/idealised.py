"""The package's netlists as circuits of ideal elements (`harvester.mechanics.kernels.ideal_circuit`).

Engine `ideal` simulates them, and engine `spice` uses them as the control variate of ngspice.

Left out of the netlists' elements are the diodes' series resistance, junction capacitance, recovery
and breakdown, and the time of a switching (`switching_time`).  For the energy that SSHI and SECE
draw from the plate of `benchmarks/steady.py`, all that is 0.3 to 0.7 %.
"""

import math
from functools import partial

from harvester.equations.scales import Scales
from harvester.mechanics.kernels.ideal_circuit import Flyback, IdealCircuit, SwitchedCoil
from harvester.netlists.load_circuit import LoadCircuit

THERMAL = 1.380649e-23 * 300.15 / 1.602176634e-19  # k T/e, V, at ngspice's 27 degrees Celsius
CLOSED = 100.0  # ohm of a closed switch
TOPOLOGIES = ("bridge", "doubler", "parallel_sshi", "series_sshi", "sece")


def ideal_circuit(circuit: LoadCircuit, scales: Scales) -> IdealCircuit | None:
    """The ideal circuit of a load that is one of this package's netlists.

    None for a resistance, for a custom netlist, and for element values that are not above zero.
    """
    name, p = circuit.topology, circuit.values
    if name not in TOPOLOGIES:
        return None
    capacitance = scales.capacitance
    w0 = scales.frequency
    volts = scales.volts
    if (
        any(value <= 0.0 for key, value in p.items() if key not in ("play", "rest", "Rcoil"))
        or p.get("play", 0.0) < 0.0
    ):
        return None
    leak = p["Is"] / (capacitance * volts * w0)
    paths = 1 if name in ("doubler", "sece") else 2  # of reverse currents out of the capacitor
    circuit_of = partial(
        IdealCircuit,
        mu=1.0 / (p["R"] * capacitance * w0),
        kappa=p["C"] / capacitance,
        n=p["N"] * THERMAL / volts,
        leak=leak,
        loss=paths * leak,
    )
    if name == "doubler":
        return circuit_of(doubler=True)
    if name == "bridge":
        return circuit_of(bridge=True)
    hysteresis = p["play"] / volts
    if name == "parallel_sshi":
        return circuit_of(
            bridge=True, hysteresis=hysteresis, parallel=_coil(p, capacitance, capacitance, w0)
        )
    if name == "series_sshi":
        # in series: what the inductor oscillates with
        both = capacitance * p["C"] / (capacitance + p["C"])
        return circuit_of(hysteresis=hysteresis, series=_coil(p, both, capacitance, w0))
    sece = Flyback(
        damping=_damping_ratio(p, capacitance),
        peak=_peak_current(p, capacitance, capacitance, w0),
        rest=max(p["rest"], 0.0) / volts,
        wire=p["Rcoil"] * capacitance * w0,
        core=1.0 / (p["Rcore"] * capacitance * w0),
    )
    return circuit_of(hysteresis=hysteresis, sece=sece)


def ideal_bridge(saturation: float, emission: float, scales: Scales) -> IdealCircuit:
    """A bridge of diodes of a saturation current (A) and an emission coefficient, with storage of Cp and no load."""
    leak = saturation / (scales.capacitance * scales.volts * scales.frequency)
    return IdealCircuit(0.0, 1.0, emission * THERMAL / scales.volts, leak, 2.0 * leak, bridge=True)


def switching_time(circuit: LoadCircuit, scales: Scales) -> float:
    """Duration (s) of an inversion, pi sqrt(L Cp), and of SECE's half of it; 0 without an inductor.

    Ideal elements switch instantaneously.
    """
    inductance = circuit.values.get("L", 0.0) if circuit.topology in TOPOLOGIES else 0.0
    return (
        math.pi
        * math.sqrt(inductance * scales.capacitance)
        * (0.5 if circuit.topology == "sece" else 1.0)
    )


def _damping_ratio(p: dict[str, float], capacitance: float) -> float:
    """Damping ratio 1/(2 Q) of the inductor with a capacitance, the switch in series and the core in parallel."""
    impedance = math.sqrt(p["L"] / capacitance)
    return 0.5 * ((p["Rcoil"] + CLOSED) / impedance + impedance / p["Rcore"])


def _peak_current(p: dict[str, float], capacitance: float, piezo: float, w0: float) -> float:
    """Peak current of an oscillation with ``capacitance`` from 1 V, in units of ``piezo`` (F) times w0 times 1 V."""
    return math.sqrt(capacitance / p["L"]) / (piezo * w0)


def _coil(p: dict[str, float], capacitance: float, piezo: float, w0: float) -> SwitchedCoil:
    """The inductor of an inversion, which leaves the fraction q = exp(-pi zeta/sqrt(1 - zeta^2)) of the voltage.

    An overdamped inductor leaves nothing.
    """
    zeta = _damping_ratio(p, capacitance)
    kept = math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta)) if zeta < 1.0 else 0.0
    return SwitchedCoil(kept, _peak_current(p, capacitance, piezo, w0))
