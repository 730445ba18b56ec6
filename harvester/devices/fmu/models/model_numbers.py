"""The numbers of a user's model, its port and its circuit, as the compiled part reads them."""

from typing import Any, NamedTuple

from harvester.circuits.circuit_part import CircuitTables, circuit_tables
from harvester.circuits.compiled_circuit import TYPICAL, CompiledCircuit, compiled_circuit
from harvester.cosimulation.part.model_part import (
    EVENT_TIME_OUT,
    EVENTS_OUT,
    OUT_SIZE,
    StateLayout,
    layout,
)
from harvester.cosimulation.part.port_circuits import PortNumbers
from harvester.cosimulation.ports import Coil, Piezo, Port
from harvester.devices.fmu.parts import OPEN_LOAD
from harvester.equations.scales import Scales
from harvester.errors import CannotServeError
from harvester.mechanics.part.numbers import names, values
from harvester.netlists.load_circuit import LoadCircuit


class CoupledModel(NamedTuple):
    """A model, its first state, its port, the load behind it (None: outside) and its step (s)."""

    model: Any
    start: Any
    port: Port
    load: LoadCircuit | None
    h: float


class ModelPart(NamedTuple):
    """A model's compiled part, as of `AnyPart`, with its port, layout and circuit."""

    names: list[str]
    values: list[float]
    step: float
    port: PortNumbers
    layout: StateLayout
    states: int
    board: CompiledCircuit | None = None
    tables: CircuitTables | None = None
    located: bool = False
    fastest: float = 0.0

    @property
    def report_places(self) -> dict[str, int]:
        """The places of `IN_REPORT` in the report."""
        return {
            "IMPACTS": self.states + EVENTS_OUT,
            "IMPACT_TIME": self.states + EVENT_TIME_OUT,
            "SIZE": self.states + OUT_SIZE,
        }

    @property
    def model(self) -> dict[str, int]:
        """The places of the state and of its variables."""
        return {
            "MODEL": 1,
            "MODEL_AT": self.layout.state,
            "MODEL_STATES": self.states,
            "MODEL_SIZE": self.layout.size - self.layout.state,
            "V_STATE": 1,
        }


def part_of_model(coupled: CoupledModel) -> ModelPart:
    """The part of a model; CannotServeError for a netlist that it cannot have inside."""
    load = coupled.load
    board = tables = None
    if load is not None and not load.linear:
        board = _board(load, coupled.port, coupled.h)
        tables = circuit_tables(board, TYPICAL)
    numbers = _port_numbers(coupled.port, load, board)
    model = coupled.model
    floats = type(model)(*(None if number is None else float(number) for number in model))
    sections: dict[str, Any] = {"model": floats, "port": numbers}
    if tables:
        sections["circuit"] = tables.numbers
    labels = [f"{label}.{name}" for label, template in sections.items() for name in names(template)]
    return ModelPart(
        names=["outside.current" if label == "port.current" else label for label in labels],
        values=[number for template in sections.values() for number in values(template)],
        step=coupled.h,
        port=numbers,
        layout=layout(len(tables.rest) if tables else 0, len(coupled.start)),
        states=len(coupled.start),
        board=board,
        tables=tables,
    )


def _board(load: LoadCircuit, port: Port, h: float) -> CompiledCircuit:
    """The netlist, compiled for a piezo; CannotServeError for a coil, or another element."""
    if isinstance(port, Coil):
        raise CannotServeError(
            "an FMU with a Coil must have a load resistance inside, but the load is a netlist: "
            "leave `load` out for an electrical port"
        )
    capacitance = float(port.capacitance)
    scales = Scales(
        mass=capacitance,
        frequency=TYPICAL / h,
        length=1.0,
        coupling=capacitance,
        capacitance=capacitance,
    )
    try:
        return compiled_circuit(load, scales)
    except CannotServeError as error:
        raise CannotServeError(
            f"an FMU must have a netlist of elements that engine 'compiled' has, but {error}: "
            "leave `load` out for an electrical port"
        ) from None


def _port_numbers(
    port: Port, load: LoadCircuit | None, board: CompiledCircuit | None
) -> PortNumbers:
    """The port's numbers; without a load there is a current from outside."""
    resistance = None if load is None else load.resistance
    if board is not None:
        resistance = board.resistance
    if isinstance(port, Piezo):
        return PortNumbers(
            coupling=float(port.coupling or 0.0),
            capacitance=float(port.capacitance),
            series=None,
            inductance=None,
            load=OPEN_LOAD if resistance is None else resistance,
            current=0.0 if load is None else None,
        )
    return PortNumbers(
        coupling=float(port.coupling),
        capacitance=None,
        series=port.resistance,
        inductance=port.inductance,
        load=resistance,
        current=0.0 if load is None else None,
    )
