"""Parts that can be bought, which `harvester design` chooses from: coils, and harvesting chips, with their sources.

The coils' numbers were read from the text of the sheets, whose tables a page's text keeps without its lines: compare
them with the sheet before a coil is bought.
"""

import math
from dataclasses import dataclass

_SDR = "Bourns, data sheet of the SDR0503 series, electrical specifications"
_RB = "ABC Taiwan Electronics, RB1314 series, specification for approval of 2013"


@dataclass(frozen=True)
class BoughtCoil:
    """A coil: inductance (H), resistance of its wire (ohm), current (A) at saturation, and its least quality factor.

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
        """What stands across an ideal coil for the core's losses (ohm): (w L)^2/(w L/Q - R)."""
        reactance = 2.0 * math.pi * self.test_frequency * self.inductance
        return reactance**2 / max(reactance / self.quality - self.resistance, 1e-3 * reactance)


COILS = {
    "RB1314 1 mH": BoughtCoil(1.0e-3, 1.3, 0.31, 40.0, 252e3, _RB),
    "RB1314 1.5 mH": BoughtCoil(1.5e-3, 1.7, 0.25, 30.0, 252e3, _RB),
    "SDR0503 10 mH": BoughtCoil(10e-3, 110.0, 0.040, 30.0, 79.6e3, _SDR),
    "SDR0503 12 mH": BoughtCoil(12e-3, 148.0, 0.038, 30.0, 79.6e3, _SDR),
    "SDR0503 15 mH": BoughtCoil(15e-3, 168.0, 0.032, 30.0, 79.6e3, _SDR),
}


@dataclass(frozen=True)
class Chip:
    """A harvesting chip behind its bridge, as its netlist of the same name says it, where the sources stand.

    A chip with a ``ratio`` holds its input at that part of the rectified voltage without load, at most ``most`` (V),
    but for the share ``idle`` of the time, and charges the store up to ``full`` (V) with the efficiency ``charging``;
    from empty to ``hand_over`` (V) it takes ``cold_voltage`` with ``cold_efficiency``.  One without has its store at
    the input.  The output begins at ``rise`` of the store (V) and ends below ``fall``; ``own`` is the chip's own
    current (A).
    ``efficiencies`` are those of the output over its current (A), the first also below it.  ``outputs`` are the
    output's voltages with ``rise`` and ``fall`` (V); of a chip that tracks, at 0, the range of its store.  ``names``
    are the netlist's parameters for the output's voltage, ``rise``, ``fall`` and ``full``.
    """

    names: tuple[str, ...]
    outputs: dict[float, tuple[float, float]]
    efficiencies: tuple[tuple[float, float], ...]
    own: float
    most: float
    ratio: float | None = None
    idle: float = 0.0
    full: float = 0.0
    charging: float = 1.0
    cold_voltage: float = 0.0
    cold_efficiency: float = 1.0
    hand_over: float = 0.0

    def thresholds(self, voltage: float) -> tuple[float, float] | None:
        """Voltages of the store at which an output begins and ends; None for one that the chip does not have."""
        if self.ratio is None:
            return self.outputs.get(voltage)
        (low, high), (above, hysteresis) = self.outputs[0.0], MARGIN
        fall = max(low, voltage + above)
        return (fall + hysteresis, fall) if fall + hysteresis < min(high, self.full) else None


MARGIN = 0.2, 0.4  # V: of the end of an output above its voltage, and of its beginning above its end
_LTC_LOW, _LTC_HIGH = (4.04, 2.87), (5.05, 3.67)
CHIPS = {
    "ltc3588": Chip(
        names=("Vreg", "Vrise", "Vfall"),
        outputs={1.8: _LTC_LOW, 2.5: _LTC_LOW, 3.3: _LTC_HIGH, 3.6: _LTC_HIGH},
        efficiencies=((1e-6, 0.85),),
        own=950e-9,
        most=20.0,
    ),
    "bq25570": Chip(
        names=("Vreg", "Von", "Voff", "Vfull"),
        outputs={0.0: (2.4, 5.5)},
        efficiencies=((1e-6, 0.4), (4e-6, 0.73), (32e-6, 0.88), (512e-6, 0.93)),
        own=488e-9,
        most=5.1,
        ratio=0.5,
        idle=0.256 / 16.0,
        full=5.0,
        charging=0.8,
        cold_voltage=0.6,
        cold_efficiency=0.05,
        hand_over=1.73,
    ),
}
