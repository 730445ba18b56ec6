"""A sensor node and the storage that feeds it: tables that `harvester node` reads, next to the device."""

import math
from typing import Annotated, ClassVar

from harvester.errors import InputError, invalid
from harvester.presentation.diagnostic import Diagnostic
from harvester.quantities.kinds import (
    CHARGE,
    CURRENT,
    ENERGY,
    RESISTANCE,
    RESISTANCE_FROM_0,
    RETRIES,
    SHARE,
    STORAGE,
    TIME,
    VOLTAGE,
    VOLTAGE_FROM_0,
)
from harvester.scene.table import NONE, Number, OptNumber, SceneTable, scene_table


@scene_table
class Storage(SceneTable):
    """A capacitor behind the rectifier, in place of the netlist's Csmooth, or a battery, which keeps its voltage.

    The charge that continues into the pores of a supercapacitor, which its makers call a leakage of
    the first hours, is that of a ``diffusion_capacitance`` that a ``diffusion_resistance`` is
    spread along.  A battery begins full.

    >>> import harvester as hv
    >>> hv.Storage(capacitance="470 uF", leakage_resistance="10 Mohm").capacitance
    0.00047
    """

    TABLE: ClassVar[str] = "storage"
    capacitance: Annotated[OptNumber, STORAGE, "capacitance that feeds the node"] = NONE
    leakage_resistance: Annotated[
        OptNumber, RESISTANCE_FROM_0, "resistance across the capacitor; default: none", "'10 Mohm'"
    ] = NONE
    esr: Annotated[OptNumber, RESISTANCE_FROM_0, "series resistance", "'0.2 ohm'"] = NONE
    initial_voltage: Annotated[
        OptNumber, VOLTAGE_FROM_0, "voltage at the beginning; default 0", "'2.5 V'"
    ] = NONE
    clamp_voltage: Annotated[
        OptNumber,
        VOLTAGE_FROM_0,
        "voltage above which energy is dissipated; default: none",
        "'5 V'",
    ] = NONE
    capacitance_left: Annotated[
        OptNumber, SHARE, "fraction of the capacitance left by tolerance and age; default 1"
    ] = NONE
    diffusion_capacitance: Annotated[
        OptNumber, STORAGE, "capacitance deep in the pores, in parallel", "'100 uF'"
    ] = NONE
    diffusion_resistance: Annotated[
        OptNumber, RESISTANCE, "resistance of the pores, along diffusion_capacitance", "'50 ohm'"
    ] = NONE
    battery_voltage: Annotated[
        OptNumber, VOLTAGE, "voltage of a battery, instead of capacitance"
    ] = NONE
    battery_charge: Annotated[OptNumber, CHARGE, "charge of a full battery: 1 mAh is 3.6 C"] = NONE

    def __post_init__(self) -> None:
        _check_store(self)
        if self.leakage_resistance == 0.0:
            raise invalid("storage.leakage_resistance", "be above 0, or left out for none", 0.0)

    @property
    def farads(self) -> float:
        """The capacitance that is left (F)."""
        return (self.capacitance or 0.0) * (self.capacitance_left or 1.0)


def _check_store(store: Storage) -> None:
    """Refuse storage that is neither a capacitor nor a battery, or lacks half of its keys."""
    if (store.capacitance is None) == (store.battery_voltage is None):
        has = "neither is" if store.capacitance is None else "both are"
        raise InputError(
            f"storage must have either capacitance or battery_voltage, but {has} given"
        )
    _check_both(store, "diffusion_capacitance", "diffusion_resistance")
    _check_both(store, "battery_voltage", "battery_charge")
    for key in ("initial_voltage", "clamp_voltage", "capacitance_left", "diffusion_capacitance"):
        if store.battery_voltage is not None and getattr(store, key) is not None:
            raise InputError(
                f"storage.{key} must be left out of a battery, which keeps its voltage, but is given"
            )


def _check_both(table: SceneTable, first: str, other: str) -> None:
    """Refuse one key without the other."""
    given = [key for key in (first, other) if getattr(table, key) is not None]
    if len(given) == 1:
        missing = other if given == [first] else first
        raise InputError(f"{table.TABLE}.{missing} must be given with {given[0]}, but is left out")


@scene_table
class SensorNode(SceneTable):
    """A load that begins at ``wake_voltage``, stops below ``stop_voltage``, and sends packets.

    A packet is a list of ``currents`` with their ``durations``, a ``packet_energy`` spent in the
    first of the ``durations`` (10 ms if left out), or a ``trace``, a CSV file of time and
    current as power profilers write it. Currents and energies are those that the node draws from
    its ``supply_voltage``, which a regulator of an ``efficiency`` makes of the storage; without one
    the storage itself gives its currents.

    For its packets a ``lost_share`` is not answered; each is sent up to ``retries`` times more.  A
    flag of the storage's energy falls below the first of ``low_voltages`` and rises above the
    second: while it is down, packets are a ``low_interval`` apart.

    >>> import harvester as hv
    >>> packet = {"currents": ["4 mA"], "durations": ["9 ms"]}
    >>> hv.SensorNode(wake_voltage=3.3, stop_voltage=2.0, interval="10 s", **packet).interval
    10.0
    """

    TABLE: ClassVar[str] = "node"
    wake_voltage: Annotated[Number, VOLTAGE_FROM_0, "storage voltage at which the node starts"]
    stop_voltage: Annotated[
        Number, VOLTAGE_FROM_0, "storage voltage below which it stops", "'2.2 V'"
    ]
    interval: Annotated[
        Number, TIME, "time from the beginning of a packet to that of the next", "'10 s'"
    ]
    currents: (
        Annotated[
            tuple[Annotated[float, CURRENT], ...],
            "currents of a packet's states, in turn",
            "['4 mA', '20 mA']",
        ]
        | None
    ) = None
    durations: (
        Annotated[
            tuple[Annotated[float, TIME], ...],
            "durations of a packet's states, in turn",
            "['10 ms', '5 ms']",
        ]
        | None
    ) = None
    packet_energy: Annotated[OptNumber, ENERGY, "energy of a packet, instead of its currents"] = (
        NONE
    )
    trace: (
        Annotated[
            str, "a packet's current over time, a CSV file, instead of currents", "'packet.csv'"
        ]
        | None
    ) = None
    sleep_current: Annotated[OptNumber, CURRENT, "current between packets", "'2 uA'"] = NONE
    stopped_current: Annotated[
        OptNumber, CURRENT, "current while it waits for the wake voltage", "'100 nA'"
    ] = NONE
    supply_voltage: Annotated[
        OptNumber,
        VOLTAGE_FROM_0,
        "regulated supply voltage; default: fed by the storage",
        "'1.8 V'",
    ] = NONE
    efficiency: Annotated[OptNumber, SHARE, "efficiency of the regulator; default 1"] = NONE
    lost_share: Annotated[
        OptNumber, SHARE, "fraction of packets that are not acknowledged; default 0", "0.02"
    ] = NONE
    retries: Annotated[
        OptNumber, RETRIES, "most repetitions of a packet that is not acknowledged"
    ] = NONE
    low_voltages: (
        Annotated[
            tuple[Annotated[float, VOLTAGE], Annotated[float, VOLTAGE]],
            "storage voltages at which the low-energy flag is set and cleared",
            "['3 V', '3.3 V']",
        ]
        | None
    ) = None
    low_interval: Annotated[OptNumber, TIME, "interval while that flag is set", "'1 min'"] = NONE

    def __post_init__(self) -> None:
        _check_radio(self)
        if not self.wake_voltage > self.stop_voltage:
            raise invalid(
                "node.wake_voltage",
                f"be above stop_voltage, {self.stop_voltage:g} V",
                self.wake_voltage,
            )
        given = [
            key for key in ("currents", "packet_energy", "trace") if getattr(self, key) is not None
        ]
        if len(given) != 1:
            has = " and ".join(given) + " are given" if given else "none is given"
            raise InputError(f"node must have one of currents, packet_energy and trace, but {has}")
        if self.trace is not None and self.durations is not None:
            raise InputError(
                "node.durations must be left out with node.trace, which has its times, but is given"
            )
        for key in ("packet_energy", "efficiency"):
            if getattr(self, key) is not None and not self.supply_voltage:
                raise InputError(f"node.supply_voltage must be given with {key}, but is left out")
        _check_durations(self)

    @property
    def states(self) -> tuple[tuple[float, float], ...]:
        """Current (A) and duration (s) of each state of a packet; InputError for a trace that cannot be read."""
        if self.trace is not None:
            from harvester.records.current_trace import read_trace

            return read_trace(self.trace).states
        if self.packet_energy is not None:
            duration = self.durations[0] if self.durations else PACKET
            return ((self.packet_energy / (duration * (self.supply_voltage or 1.0)), duration),)
        return tuple(zip(self.currents or (), self.durations or (), strict=True))

    @property
    def trace_notes(self) -> tuple[Diagnostic, ...]:
        """Notes on how the file of a trace was read."""
        if self.trace is None:
            return ()
        from harvester.records.current_trace import read_trace

        return read_trace(self.trace).notes


PACKET = 0.01  # s that a packet of a given energy takes


def _check_radio(node: SensorNode) -> None:
    """Refuse retries and a flag of which half is missing, and packets that need longer than their interval."""
    _check_both(node, "low_voltages", "low_interval")
    if node.retries is not None and node.lost_share is None:
        raise InputError("node.lost_share must be given with retries, but is left out")
    if node.retries is not None and node.retries % 1.0:
        raise invalid("node.retries", "be a whole number", node.retries)
    if node.lost_share == 1.0:
        raise invalid("node.lost_share", "be below 1", 1.0)
    if node.low_voltages is not None and not node.low_voltages[0] <= node.low_voltages[1]:
        raise invalid("node.low_voltages", "ascend", node.low_voltages)


def _check_durations(node: SensorNode) -> None:
    """Refuse durations that are not one for each current, or one for an energy, and too short intervals."""
    given = len(node.durations or ())
    if node.currents is not None and given != len(node.currents):
        raise invalid("node.durations", f"be as many as node.currents, {len(node.currents)}", given)
    if node.currents is None and given > 1:
        raise invalid("node.durations", "be one where packet_energy is given", given)
    longest = ((node.retries or 0) + 1) * sum(duration for _, duration in node.states)
    for key in ("interval", "low_interval"):
        if not longest < (getattr(node, key) or math.inf):
            most = "a packet's durations together" + (" and its retries'" if node.retries else "")
            raise invalid(
                f"node.{key}", f"be longer than {most}, {longest:g} s", getattr(node, key)
            )


@scene_table
class HarvestingChip(SceneTable):
    """The converter between the rectifier and the storage: a chip by its name, or one of your own.

    Keys next to a ``name`` replace the values of the chip's datasheet.  With an
    ``input_ratio`` the chip holds the rectifier's output at that part of its voltage without load,
    and charges the storage from there; without one the storage is at its input.  The output feeds
    the node from the start voltage of the storage on, until the stop voltage.

    >>> import harvester as hv
    >>> hv.HarvestingChip(name="bq25570", start_voltage="3 V").start_voltage
    3.0
    """

    TABLE: ClassVar[str] = "chip"
    name: Annotated[str, "ltc3588, bq25570, adp5091, aem30940 or spv1050", "'bq25570'"] | None = (
        None
    )
    start_voltage: Annotated[
        OptNumber, VOLTAGE_FROM_0, "storage voltage at which the output starts", "'4 V'"
    ] = NONE
    stop_voltage: Annotated[
        OptNumber, VOLTAGE_FROM_0, "storage voltage below which the output stops", "'2.4 V'"
    ] = NONE
    full_voltage: Annotated[
        OptNumber, VOLTAGE_FROM_0, "storage voltage at which charging ends", "'4.2 V'"
    ] = NONE
    own_current: Annotated[OptNumber, CURRENT, "quiescent current of the chip", "'0.5 uA'"] = NONE
    input_ratio: Annotated[
        OptNumber, SHARE, "fraction of the open-circuit voltage at which the input is held", "0.8"
    ] = NONE
    efficiency: Annotated[OptNumber, SHARE, "charging efficiency"] = NONE
    efficiency_table: (
        Annotated[
            str, "CSV file over input voltage and current, instead of efficiency", "'chip.csv'"
        ]
        | None
    ) = None
    output_efficiency: Annotated[OptNumber, SHARE, "output efficiency"] = NONE

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
        if self.name is None and self.input_ratio is None:
            check_store_at_input(self)
        if self.efficiency is not None and self.efficiency_table is not None:
            raise InputError(
                "chip must have one of efficiency and efficiency_table, but both are given"
            )


def check_store_at_input(chip: HarvestingChip) -> None:
    """Refuse keys of a charging converter for a chip whose storage capacitor is at its input."""
    for key in ("efficiency", "efficiency_table", "full_voltage"):
        if getattr(chip, key) is not None:
            kind = "a chip of your own" if chip.name is None else f"chip {chip.name!r}"
            raise InputError(
                f"chip.{key} must be left out for {kind} without input_ratio, whose storage is "
                "at its input, but is given: output_efficiency is that of its output"
            )


def check_node(
    node: SensorNode | None,
    storage: Storage | None,
    netlist: str | None,
    chip: HarvestingChip | None = None,
) -> None:
    """Refuse a node without a storage capacitor, or without a netlist that rectifies, and a chip without a node."""
    if chip is not None and node is None:
        raise InputError("[node] must be given with [chip], but the table is missing")
    if node is not None and storage is None:
        raise InputError("[storage] must be given with [node], but the table is missing")
    battery = None if storage is None else storage.battery_voltage
    if node is not None and battery is not None and node.wake_voltage > battery:
        raise invalid(
            "node.wake_voltage",
            f"be at most storage.battery_voltage, {battery:g} V",
            node.wake_voltage,
        )
    if node is not None and netlist is None:
        raise InputError(
            "load.netlist must be given with [node], such as 'bridge', but is left out"
        )
