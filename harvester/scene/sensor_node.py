"""What a sensor node is and the store that feeds it: tables that `harvester node` reads, beside the device."""

from typing import Annotated, ClassVar

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import CURRENT, ENERGY, RESISTANCE_FROM_0, SHARE, STORAGE, TIME, VOLTAGE_FROM_0
from harvester.records.current_trace import read_trace
from harvester.scene.table import NONE, Number, OptNumber, SceneTable, scene_table


@scene_table
class Storage(SceneTable):
    """A capacitor behind the rectifier, in place of the netlist's Csmooth.

    >>> import harvester as hv
    >>> hv.Storage(capacitance="470 uF", leakage_resistance="10 Mohm").capacitance
    0.00047
    """

    TABLE: ClassVar[str] = "storage"
    capacitance: Annotated[Number, STORAGE, "of the capacitor that feeds the node"]
    leakage_resistance: Annotated[OptNumber, RESISTANCE_FROM_0, "across the capacitor; left out: none"] = NONE
    esr: Annotated[OptNumber, RESISTANCE_FROM_0, "in series: a current out lowers its voltage"] = NONE
    initial_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "at the beginning; 0 where left out"] = NONE
    clamp_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "what more comes in is lost; left out: none"] = NONE
    capacitance_left: Annotated[OptNumber, SHARE, "of the capacitance, by tolerance and age; 1 where left out"] = NONE

    def __post_init__(self) -> None:
        if self.leakage_resistance == 0.0:
            raise invalid("storage.leakage_resistance", "be above 0, or left out for none", 0.0)

    @property
    def farads(self) -> float:
        """The capacitance that is left (F)."""
        return self.capacitance * (self.capacitance_left or 1.0)


@scene_table
class SensorNode(SceneTable):
    """A load that begins at ``wake_voltage`` of the store and stops below ``stop_voltage``: packets, and sleep between.

    A packet is a list of ``currents`` with their ``durations``, a ``packet_energy`` that takes the first of the
    ``durations`` (10 ms where left out), or a ``trace``, a CSV file of time and current as power profilers write it.
    Currents and energies are those that the node takes from its ``supply_voltage``, which a regulator of an
    ``efficiency`` makes of the store; without one the store itself gives its currents.

    >>> import harvester as hv
    >>> packet = {"currents": ["4 mA"], "durations": ["9 ms"]}
    >>> hv.SensorNode(wake_voltage=3.3, stop_voltage=2.0, interval="10 s", **packet).interval
    10.0
    """

    TABLE: ClassVar[str] = "node"
    wake_voltage: Annotated[Number, VOLTAGE_FROM_0, "of the store, at which the node begins"]
    stop_voltage: Annotated[Number, VOLTAGE_FROM_0, "of the store, below which it stops"]
    interval: Annotated[Number, TIME, "from the beginning of a packet to that of the next"]
    currents: (
        Annotated[tuple[Annotated[float, CURRENT], ...], "of a packet's states, in turn", "['4 mA', '20 mA']"] | None
    ) = None
    durations: (
        Annotated[tuple[Annotated[float, TIME], ...], "of a packet's states, in turn", "['10 ms', '5 ms']"] | None
    ) = None
    packet_energy: Annotated[OptNumber, ENERGY, "of a packet, instead of its currents"] = NONE
    trace: Annotated[str, "a packet's current over time, a CSV file, instead of currents", "'packet.csv'"] | None = None
    sleep_current: Annotated[OptNumber, CURRENT, "between packets"] = NONE
    stopped_current: Annotated[OptNumber, CURRENT, "while it waits for the wake voltage, from the store"] = NONE
    supply_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "regulated supply; left out: the store feeds it"] = NONE
    efficiency: Annotated[OptNumber, SHARE, "of the regulator; 1 where left out"] = NONE

    def __post_init__(self) -> None:
        if not self.wake_voltage > self.stop_voltage:
            raise invalid("node.wake_voltage", f"be above stop_voltage, {self.stop_voltage:g} V", self.wake_voltage)
        given = [key for key in ("currents", "packet_energy", "trace") if getattr(self, key) is not None]
        if len(given) != 1:
            has = " and ".join(given) + " are given" if given else "none is given"
            raise InputError(f"node must have one of currents, packet_energy and trace, but {has}")
        if self.trace is not None and self.durations is not None:
            raise InputError("node.durations must be left out with node.trace, which has its times, but is given")
        _check_durations(self.currents, self.durations)
        for key in ("packet_energy", "efficiency"):
            if getattr(self, key) is not None and not self.supply_voltage:
                raise InputError(f"node.supply_voltage must be given with {key}, but is left out")
        if not sum(duration for _, duration in self.states) < self.interval:
            raise invalid("node.interval", "be longer than a packet's durations together", self.interval)

    @property
    def states(self) -> tuple[tuple[float, float], ...]:
        """Current (A) and duration (s) of each state of a packet; InputError for a trace that cannot be read."""
        if self.trace is not None:
            return read_trace(self.trace)
        if self.packet_energy is not None:
            duration = self.durations[0] if self.durations else PACKET
            return ((self.packet_energy / (duration * (self.supply_voltage or 1.0)), duration),)
        return tuple(zip(self.currents or (), self.durations or (), strict=True))


PACKET = 0.01  # s that a packet of a given energy takes


def _check_durations(currents: tuple[float, ...] | None, durations: tuple[float, ...] | None) -> None:
    """Refuse durations that are not one for each current, or one for the energy of a packet."""
    given = len(durations or ())
    if currents is not None and given != len(currents):
        raise invalid("node.durations", f"be as many as node.currents, {len(currents)}", given)
    if currents is None and given > 1:
        raise invalid("node.durations", "be one where packet_energy is given", given)


@scene_table
class HarvestingChip(SceneTable):
    """What is between the rectifier and the store: a chip by its name, or one of your own.

    Keys beside a ``name`` take the place of what the chip's data sheet says.  With an ``input_ratio`` the chip holds
    the rectifier's output at that part of its voltage without load, and charges the store from there; without one the
    store is at its input.  The output feeds the node from the start voltage of the store on, until the stop voltage.

    >>> import harvester as hv
    >>> hv.HarvestingChip(name="bq25570", start_voltage="3 V").start_voltage
    3.0
    """

    TABLE: ClassVar[str] = "chip"
    name: Annotated[str, "a chip whose data sheet is known", "'bq25570'"] | None = None
    start_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "of the store, at which the output begins"] = NONE
    stop_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "of the store, below which the output ends"] = NONE
    full_voltage: Annotated[OptNumber, VOLTAGE_FROM_0, "of the store, at which charging ends"] = NONE
    own_current: Annotated[OptNumber, CURRENT, "that the chip takes from the store"] = NONE
    input_ratio: Annotated[OptNumber, SHARE, "of the voltage without load at which the input is held"] = NONE
    efficiency: Annotated[OptNumber, SHARE, "of charging"] = NONE
    efficiency_table: (
        Annotated[str, "instead of efficiency: a CSV file over input voltage and current", "'chip.csv'"] | None
    ) = None
    output_efficiency: Annotated[OptNumber, SHARE, "of the output"] = NONE

    def __post_init__(self) -> None:
        for key in ("start_voltage", "stop_voltage"):
            if self.name is None and getattr(self, key) is None:
                raise InputError(
                    f"chip.{key} must be given for a chip of your own, or the name of one, but is left out"
                )
        start, stop = self.start_voltage, self.stop_voltage
        if start is not None and stop is not None and not start > stop:
            raise invalid("chip.start_voltage", f"be above stop_voltage, {stop:g} V", start)
        if self.name is None and self.input_ratio is not None and self.full_voltage is None:
            raise InputError("chip.full_voltage must be given with input_ratio, but is left out")
        if self.efficiency is not None and self.efficiency_table is not None:
            raise InputError("chip must have one of efficiency and efficiency_table, but both are given")


def check_node(
    node: SensorNode | None, storage: Storage | None, netlist: str | None, chip: HarvestingChip | None = None
) -> None:
    """Refuse a node without a store, or without a netlist that rectifies, and a chip without a node."""
    if chip is not None and node is None:
        raise InputError("[node] must be given with [chip], but the table is missing")
    if node is not None and storage is None:
        raise InputError("[storage] must be given with [node], but the table is missing")
    if node is not None and netlist is None:
        raise InputError("load.netlist must be given with [node], such as 'bridge', but is left out")
