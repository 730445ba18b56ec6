"""Parts that can be bought, which `harvester design` chooses from: inductors, and harvesting chips, with their sources.

Their numbers are in netlists/parts/bought_parts.toml, or in the netlist that is a chip's referee.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from harvester.netlists.load_circuit import load_circuit, netlist_folder
from harvester.scene.load import Load


@dataclass(frozen=True)
class BoughtCoil:
    """Inductor: inductance (H), resistance of its wire (ohm), current (A) at saturation, and its least quality factor.

    ``quality`` is that at ``test_frequency`` (Hz), from which the losses of the core follow.
    """

    inductance: float
    resistance: float
    current: float
    quality: float
    test_frequency: float
    source: str

    @property
    def core_resistance(self) -> float:
        """The resistance across an ideal inductor for the core's losses (ohm): (w L)^2/(w L/Q - R)."""
        reactance = 2.0 * math.pi * self.test_frequency * self.inductance
        return reactance**2 / max(reactance / self.quality - self.resistance, 1e-3 * reactance)


def coil_quality(values: Mapping[str, float], capacitance: float) -> float | None:
    """How well the inductor with ``values`` rings with a piezo of a ``capacitance`` (F).

    None without an inductor.

    1/Q = Rcoil sqrt(Cp/L) + sqrt(L/Cp)/Rcore, of a circuit that calls them so.
    """
    if not {"L", "Rcoil", "Rcore"} <= values.keys():
        return None
    wave = math.sqrt(values["L"] / capacitance)
    return 1.0 / (values["Rcoil"] / wave + wave / values["Rcore"])


@dataclass(frozen=True)
class Chip:
    """A harvesting chip behind its bridge, by its datasheet.

    A chip with a ``ratio`` holds its input at that part of the rectified voltage without load,
    between ``least`` and ``most`` (V): it looks at that every ``period`` (s), with the converter
    off for ``look``.  It charges the storage capacitor up to ``full`` (V) with efficiencies
    ``charging`` in rows of input voltage (V), current (A) and efficiency, straight between voltages
    and logarithms of currents.  From empty to ``hand_over`` (V) it needs ``cold_voltage`` with
    ``cold_efficiency`` if at least ``cold_power`` (W) comes.  One without a ratio has its storage
    capacitor at the input.  The output begins at ``rise`` of the storage capacitor (V) and ends
    below ``fall``; ``quiescent`` is the chip's quiescent current (A), and ``low_quiescent`` that before the output
    begins, the same if it is 0. ``efficiencies`` are those of the output over its current (A), the
    first also below it. ``outputs`` are the output's voltages with ``rise`` and ``fall`` (V); for a
    chip that tracks, at 0, the range of its storage capacitor.

    ``diodes`` are saturation current (A) and emission coefficient of its bridge, or of that before
    its input: a BAT54.

    ``names`` are the parameters of the ``netlist`` that is the chip's referee, for the output's
    voltage, ``rise``, ``fall`` and ``full``.  ``source`` names the sheet, and ``assumed``
    unconfirmed numbers: each is usual, and charging may be off by the part ``spread``.
    """

    outputs: dict[float, tuple[float, float]]
    efficiencies: tuple[tuple[float, float], ...]
    quiescent: float
    most: float
    ratio: float | None = None
    period: float = 16.0
    look: float = 0.0
    full: float = 0.0
    charging: tuple[tuple[float, float, float], ...] = ((1.0, 1e-5, 1.0),)
    cold_voltage: float = 0.0
    cold_power: float = 0.0
    cold_efficiency: float = 1.0
    hand_over: float = 0.0
    least: float = 0.0
    diodes: tuple[float, float] = (1e-7, 1.0)
    netlist: str = ""
    names: tuple[str, ...] = ()
    spread: float = 0.0
    source: str = ""
    assumed: str = ""
    rise: float = 0.0
    fall: float = 0.0
    low_quiescent: float = 0.0

    @property
    def idle(self) -> float:
        """The fraction of the time in which it looks."""
        return self.look / self.period

    def worse(self) -> "Chip":
        """The same with charging as bad as its numbers may be off."""
        return self.charging_by(1.0 - self.spread)

    def charging_by(self, factor: float) -> "Chip":
        """The same with so many times its efficiencies of charging."""
        rows = tuple((volts, amperes, share * factor) for volts, amperes, share in self.charging)
        return replace(self, charging=rows)

    def narrower(self) -> "Chip":
        """The same with thresholds by `SHARP` nearer, as the netlists' comparators have them."""
        by = min(SHARP, 0.25 * (self.rise - self.fall))
        near = replace(self, rise=self.rise - by, fall=self.fall + by)
        return replace(near, hand_over=max(self.hand_over - SHARP, 0.0))

    def thresholds(self, voltage: float) -> tuple[float, float] | None:
        """Voltages of the storage at which an output begins and ends.

        None for one that the chip does not have.
        """
        if self.ratio is None:
            return self.outputs.get(voltage)
        (low, high) = self.outputs[0.0]
        (above, hysteresis) = MARGIN
        fall = max(low, voltage + above)
        return (fall + hysteresis, fall) if fall + hysteresis < min(high, self.full) else None


SHARP = 0.03  # V: within which a netlist's comparator acts
# V: of the end of an output above its voltage, and of its beginning above its end
MARGIN = 0.2, 0.4


def _as_tuples(value: Any) -> Any:
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value


def _chip(keys: dict[str, Any]) -> Chip:
    """A chip of the file: the names in ``netlist_keys`` are parameters of its netlist."""
    names = keys.pop("netlist_keys", {})
    values = load_circuit(Load(netlist=keys["netlist"])).values if names else {}
    numbers = {key: values[name] for key, name in names.items()} | {
        key: _as_tuples(keys[key]) for key in keys
    }
    for key, ends in (("efficiencies", (1e-6,)), ("charging", (1.0, 1e-5))):
        numbers |= {key: ((*ends, numbers[key]),)} if key in names else {}
    return Chip(
        **numbers
        | {"outputs": {volts: (first, second) for volts, first, second in keys["outputs"]}}
    )


_PARTS = tomllib.loads(
    (netlist_folder() / "parts" / "bought_parts.toml").read_text(encoding="utf-8")
)
COILS = {name: BoughtCoil(**keys) for name, keys in _PARTS["coils"].items()}
CHIPS = {name: _chip(keys) for name, keys in _PARTS["chips"].items()}
