"""The variables of a user's model as an FMU: first state, coefficients, port, outputs."""

from harvester.cosimulation.ports import Piezo, Port
from harvester.devices.fmu.models.model_numbers import CoupledModel, ModelPart
from harvester.devices.fmu.variables import (
    INPUT,
    MOST_SEED,
    OUTPUT,
    PARAMETER,
    TIME,
    TUNABLE,
    Variable,
    first_voltage,
)

# Outputs behind the model's state: name, unit, meaning
OUTPUTS = (
    ("voltage", "V", "voltage at the terminals"),
    ("load_current", "A", "current through the load resistance"),
    ("power", "W", "power in the load resistance"),
    ("events", "1", "number of events so far; an event ends no communication step"),
    ("event_time", "s", "time of the last event"),
    ("port_work", "J", "work of the model against the reaction of the port so far"),
    ("load_energy", "J", "energy out of the port through its load so far"),
    ("delivered_energy", "J", "energy in the netlist's load resistance so far"),
    ("stored_energy", "J", "energy in the piezo's capacitance, or the coil's inductance"),
    ("store_voltage", "V", "voltage across the circuit's capacitor"),
)
LEAST_LOAD = 1e-3  # ohm


def model_variables(
    coupled: CoupledModel, part: ModelPart, inputs: tuple[str, ...]
) -> list[Variable]:
    """All variables, first those of the first state; an index is a value reference."""
    number = {name: k for k, name in enumerate(part.names)}
    return [
        Variable("time", TIME, "s", "simulated time"),
        *_starts(coupled, part),
        *_numbers(coupled, part, inputs, number),
        *_of_port(coupled.port, part, number),
        Variable(
            "seed", PARAMETER, "1", "seed of the noise", least=0.0, most=MOST_SEED, integer=True
        ),
        *_outputs(coupled, part),
    ]


def _has_store(part: ModelPart) -> bool:
    """Whether the circuit inside has a storage capacitor."""
    return part.tables is not None and "csmooth" in part.tables.volts


def _starts(coupled: CoupledModel, part: ModelPart) -> list[Variable]:
    """The parameters of the first state: first the model's, then those of its circuit."""
    listed = [
        Variable(f"initial.{name}", PARAMETER, "1", f"initial {name}", float(value))
        for name, value in zip(coupled.start._fields, coupled.start, strict=True)
    ]
    charged = []
    if isinstance(coupled.port, Piezo):
        charged.append(("voltage", "initial voltage of the piezo", "piezo"))
    if _has_store(part):
        charged.append(
            ("store_voltage", "initial voltage across the circuit's capacitor", "csmooth")
        )
    return listed + [
        Variable(f"initial.{name}", PARAMETER, "V", meaning, first_voltage(part, charge))
        for name, meaning, charge in charged
    ]


def _numbers(
    coupled: CoupledModel, part: ModelPart, inputs: tuple[str, ...], number: dict[str, int]
) -> list[Variable]:
    """The current of an electrical port, and the model's coefficients as parameters or inputs."""
    current = Variable("current", INPUT, "A", "current out of the port")
    coefficients = [
        Variable(
            f"model.{name}",
            INPUT if name in inputs else TUNABLE,
            "1",
            "number of the model",
            start=part.values[number[f"model.{name}"]],
            powers={number[f"model.{name}"]: 1.0},
        )
        for name in coupled.model._fields
        if f"model.{name}" in number
    ]
    return [current, *coefficients] if coupled.load is None else coefficients


def _outputs(coupled: CoupledModel, part: ModelPart) -> list[Variable]:
    """The model's state, and the quantities of the port."""
    listed = [
        Variable(f"state.{name}", OUTPUT, "1", f"{name} of the model's state", output=k)
        for k, name in enumerate(coupled.start._fields)
    ]
    absent = set()
    if coupled.load is None:
        absent |= {"load_current", "power"}
    if part.tables is None:
        absent.add("delivered_energy")
    if not _has_store(part):
        absent.add("store_voltage")
    return listed + [
        Variable(name, OUTPUT, unit, meaning, output=part.states + k, integer=name == "events")
        for k, (name, unit, meaning) in enumerate(OUTPUTS)
        if name not in absent
    ]


def _of_port(port: Port, part: ModelPart, number: dict[str, int]) -> list[Variable]:
    """The numbers of port and load; with a netlist its own and the capacitance are fixed."""
    outside = part.port.current is not None
    listed = []
    for name, key, unit in (
        ("coupling", f"{port.TABLE}.coupling", "N/V" if isinstance(port, Piezo) else "1"),
        ("capacitance", f"{port.TABLE}.capacitance", "F"),
        ("series", f"{port.TABLE}.resistance", "Ohm"),
        ("inductance", f"{port.TABLE}.inductance", "H"),
        ("load", "load_resistance" if outside else "load.resistance", "Ohm"),
    ):
        k = number.get(f"port.{name}")
        if k is None or (part.tables is not None and name in ("capacitance", "load")):
            continue
        kind = PARAMETER
        if name == "load":
            kind = INPUT if outside else TUNABLE
        start = part.values[k]
        listed.append(
            Variable(
                key,
                kind,
                unit,
                "number of the port" if name != "load" else "resistance across the terminals",
                start=start,
                least=min(1e-6 * start, LEAST_LOAD) if name == "load" else 1e-6 * start,
                most=1e6 * start,
                powers={k: 1.0},
            )
        )
    return listed
