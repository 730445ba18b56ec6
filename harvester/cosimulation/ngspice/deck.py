"""The whole circuit that ngspice runs: the piezo, the load, the integration rule, and the vectors that are saved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from harvester.cosimulation.lockstep.state import VECTORS
from harvester.mechanics.kernels.ngspice_rule import rule_weight
from harvester.netlists.for_ngspice import RELTOL, lines_for_ngspice
from harvester.netlists.load_circuit import LoadCircuit

REST = (0.0, 0.0, 0.0)
# of all parts and of their models' parameters, in degrees Celsius
TEMPERATURES = {"temp": 27.0, "tnom": 27.0}
# F: times the signal's size the charge that the tolerances of a coil's circuit go by
SOME_CAPACITANCE = 1e-4
# of a coil: A of a volt at node z, and the capacitor (F) that has the flux
CURRENT, FLUX = 1e-3, 1e-7
# of a voltage: the last digits of a difference of two nodes, over the least usual tolerance
ROUNDING = 1e-11


@dataclass(frozen=True)
class Deck:
    """A whole circuit for ngspice, and its vectors' names in the order of `VECTORS` ("" for none)."""

    text: str
    vectors: tuple[str, ...]
    keeps: bool = False  # whether all node voltages are saved, to begin another run with
    probes: tuple[str, ...] = ()  # further vectors, whose values at all accepted points are kept

    @property
    def smoothing(self) -> bool:
        """Whether the load has a capacitor Csmooth."""
        return any(self.vectors[VECTORS.index("smooth") :])


def build_deck(
    load: LoadCircuit,
    capacitance: float,
    step: float,
    duration: float,
    start: tuple[float, float, float] = REST,
    volts: float = 1.0,
    reltol: float = RELTOL,
    nodes: Mapping[str, float] | None = None,
    probes: Sequence[str] = (),
    trapezoidal: bool = False,
    keeps: bool = True,
    shunt: float = 0.0,
) -> Deck:
    """The whole circuit: the piezo, driven by the voltage theta x/Cp, and the load on it.

    capacitance in farad, step and duration in second; ``start`` is its initial charge: theta x/Cp,
    the terminals' voltage and that of Csmooth, in volt; ``volts`` is the signal's size, with
    ``reltol`` and ``trapezoidal`` for `integration_options`; with ``nodes``, the voltages at the
    beginning by name, all nodes are saved if it ``keeps`` them; ``probes`` are the names of further
    vectors that are; ``shunt`` is a capacitance from each node to ground (F). The piezo is that
    voltage in series with Cp (Thevenin), so that each step of ngspice carries exactly the charge
    theta (x1 - x0), whatever its integration rule; a current theta x' in parallel, given at the
    step's end, would not.

    The load resistor runs with fixed steps between targets and with the one-step rule that is exact
    for its time constant (`harvester.mechanics.kernels.ngspice_rule`); any other load leaves the
    steps between targets to ngspice.
    """
    numbers = (capacitance, step, duration, volts, *start)
    # A NumPy scalar prints its type.
    capacitance, step, duration, volts, open_circuit, terminals, charge = map(float, numbers)
    across = open_circuit - (nodes or {}).get("p", terminals)
    source = ["Vdrive drive 0 external", f"Cp drive p {capacitance!r} ic={across!r}"]
    time_constant = None if load.resistance is None else load.resistance * capacitance
    options = integration_options(
        step,
        time_constant,
        volts=volts,
        capacitance=capacitance,
        reltol=reltol,
        trapezoidal=trapezoidal,
        smoothing=load.smoothing,
    )
    options += f" cshunt={float(shunt)!r}" if shunt else ""
    return whole_deck(
        load,
        source,
        options=options,
        times=(step, duration),
        charge=charge,
        nodes=nodes,
        probes=probes,
        keeps=keeps,
    )


def coil_deck(
    load: LoadCircuit,
    resistance: float | None,
    inductance: float | None,
    times: tuple[float, float],
    volts: float,
    reltol: float,
    probes: Sequence[str] = (),
) -> Deck:
    """The whole circuit of a coil: its e.m.f. in series with its resistance (ohm) and inductance (H), and the load.

    ``times`` are step and duration (s); the others as of `build_deck`.
    """
    nodes = [
        "drive",
        *(["coil"] if resistance and inductance else []),
        *(["p"] if resistance or inductance else []),
    ]
    source = [f"Vdrive {'drive' if len(nodes) > 1 else 'p'} 0 external"]
    if (
        inductance is not None
    ):  # a capacitor behind two controlled sources: the least ringing of an element L stops all
        across = f"drive {nodes[1]}"
        source += [f"Gcoil {across} z 0 {CURRENT!r}", f"Cz z 0 {FLUX!r} ic=0"]
        source += [f"Gflux 0 z {across} {FLUX / (CURRENT * inductance)!r}"]
    if resistance is not None:
        source += [f"Rcoil {nodes[-2]} p {resistance!r}"]
    options = integration_options(
        times[0], None, volts, SOME_CAPACITANCE, reltol, smoothing=load.smoothing
    )
    return whole_deck(load, source, options, times, probes=probes)


def whole_deck(
    load: LoadCircuit,
    source: Sequence[str],
    options: str,
    times: tuple[float, float],
    charge: float = 0.0,
    nodes: Mapping[str, float] | None = None,
    probes: Sequence[str] = (),
    keeps: bool = False,
) -> Deck:
    """The load between p and 0, with the lines of its ``source``, whose driven voltage is Vdrive.

    ``times`` are step and duration (s), ``charge`` the voltage of Csmooth at the beginning; the
    rest as of `build_deck`.
    """
    step, duration = times
    elements = [".title harvester", *source]
    smooth = load.smoothing_nodes or ("", "")
    vectors = ("time", "p", "@r.xload.rload[p]", "vdrive#branch", *smooth)
    if nodes:
        elements.append(".ic " + " ".join(f"v({name})={value!r}" for name, value in nodes.items()))
    saved = [
        "v(p)",
        "@r.xload.rload[p]",
        "i(vdrive)",
        *(f"v({node})" for node in smooth if "." in node),
    ]
    keeps = keeps and nodes is not None
    if keeps:
        saved = ["all", "@r.xload.rload[p]"]
    saved = list(
        dict.fromkeys(
            [*saved, *(name if name.startswith("@") else f"v({name})" for name in probes)]
        )
    )
    temperatures = "".join(
        f" {name}={value!r}" for name, value in (TEMPERATURES | load.settings).items()
    )
    cards = [
        "\n".join(lines_for_ngspice(load.parts, {"csmooth": charge})) if charge else load.text,
        f"{options}{temperatures}",
        f".save {' '.join(saved)}",
        f".tran {step!r} {duration!r} 0 {step!r} uic",
        ".end",
    ]
    return Deck("\n".join([*elements, *cards]) + "\n", vectors, keeps, tuple(probes))


def integration_options(
    step: float,
    time_constant: float | None,
    volts: float,
    capacitance: float,
    reltol: float,
    trapezoidal: bool = False,
    smoothing: float | None = None,
) -> str:
    """The options card: the exact rule of a load resistor's time constant (s), or steps of ngspice's own (None).

    ``reltol`` is ngspice's relative tolerance, for steps of its own.  Its absolute tolerances scale
    with the signal's size ``volts``, so that a microvolt is as precise as a kilovolt; at 20 V on 50
    nF they are ngspice's defaults. That of a charge is no less than the rounding error on the
    capacitor ``smoothing`` (F): next to one of a farad ngspice would make shorter and shorter
    steps.

    Gear's rule damps the ringing after a jump, and a coil's oscillation with it; the
    ``trapezoidal`` rule damps nothing, and with a seventh of ngspice's usual ``trtol`` comes nearer
    in as many steps.
    """
    if time_constant is None:
        charge = 1e-8 * volts * capacitance
        least = max(charge, ROUNDING * volts * (smoothing or 0.0))
        sizes = f"vntol={5e-8 * volts!r} chgtol={least!r} abstol={0.5 * charge / step!r}"
        method = "trap trtol=1" if trapezoidal else "gear maxord=2"
        return f".options method={method} reltol={reltol!r} {sizes}"
    return f".options method=trap xmu={rule_weight(step / time_constant)!r} trtol=1e6 chgtol=1"
