"""Parts that can be bought, which `harvester design` chooses from: coils, and harvesting chips, with their sources.

The coils' numbers were read from the text of the sheets, whose tables a page's text keeps without its lines: compare
them with the sheet before a coil is bought.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

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


def coil_quality(values: Mapping[str, float], capacitance: float) -> float | None:
    """How well the coil of a circuit's ``values`` rings with a piezo of a ``capacitance`` (F); None without a coil.

    1/Q = Rcoil sqrt(Cp/L) + sqrt(L/Cp)/Rcore, of a circuit that calls them so.
    """
    if not {"L", "Rcoil", "Rcore"} <= values.keys():
        return None
    wave = math.sqrt(values["L"] / capacitance)
    return 1.0 / (values["Rcoil"] / wave + wave / values["Rcore"])


COILS = {
    "RB1314 1 mH": BoughtCoil(1.0e-3, 1.3, 0.31, 40.0, 252e3, _RB),
    "RB1314 1.5 mH": BoughtCoil(1.5e-3, 1.7, 0.25, 30.0, 252e3, _RB),
    "SDR0503 10 mH": BoughtCoil(10e-3, 110.0, 0.040, 30.0, 79.6e3, _SDR),
    "SDR0503 12 mH": BoughtCoil(12e-3, 148.0, 0.038, 30.0, 79.6e3, _SDR),
    "SDR0503 15 mH": BoughtCoil(15e-3, 168.0, 0.032, 30.0, 79.6e3, _SDR),
}


@dataclass(frozen=True)
class Chip:
    """A harvesting chip behind its bridge, by its data sheet.

    A chip with a ``ratio`` holds its input at that part of the rectified voltage without load, between ``least`` and
    ``most`` (V): it looks at that every ``period`` (s), with the converter off for ``look``.  It charges the store up
    to ``full`` (V) with efficiencies ``charging`` in rows of input voltage (V), current (A) and efficiency, straight
    between voltages and logarithms of currents.  From empty to ``hand_over`` (V) it takes ``cold_voltage`` with
    ``cold_efficiency`` where at least ``cold_power`` (W) comes.  One without a ratio has its store at the input.  The
    output begins at ``rise`` of the store (V) and ends below ``fall``; ``own`` is the chip's own current (A), and
    ``low_own`` that before the output begins, the same where it is 0.
    ``efficiencies`` are those of the output over its current (A), the first also below it.  ``outputs`` are the
    output's voltages with ``rise`` and ``fall`` (V); of a chip that tracks, at 0, the range of its store.

    ``diodes`` are saturation current (A) and emission coefficient of its bridge, or of that before its input: a BAT54.

    ``names`` are the parameters of the ``netlist`` that is the chip's referee, for the output's voltage, ``rise``,
    ``fall`` and ``full``.  ``source`` names the sheet, and ``assumed`` what no text of it confirmed: there the number
    is a usual one, and charging may be off by the part ``spread``.
    """

    names: tuple[str, ...]
    outputs: dict[float, tuple[float, float]]
    efficiencies: tuple[tuple[float, float], ...]
    own: float
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
    spread: float = 0.0
    source: str = ""
    assumed: str = ""
    rise: float = 0.0
    fall: float = 0.0
    low_own: float = 0.0

    @property
    def idle(self) -> float:
        """The share of the time in which it looks."""
        return self.look / self.period

    def worse(self) -> "Chip":
        """The same with charging as bad as its numbers may be off."""
        rows = tuple((volts, amperes, share * (1.0 - self.spread)) for volts, amperes, share in self.charging)
        return replace(self, charging=rows)

    def narrower(self) -> "Chip":
        """The same with thresholds by `SHARP` nearer, as the netlists' comparators have them."""
        by = min(SHARP, 0.25 * (self.rise - self.fall))
        near = replace(self, rise=self.rise - by, fall=self.fall + by)
        return replace(near, hand_over=max(self.hand_over - SHARP, 0.0))

    def thresholds(self, voltage: float) -> tuple[float, float] | None:
        """Voltages of the store at which an output begins and ends; None for one that the chip does not have."""
        if self.ratio is None:
            return self.outputs.get(voltage)
        (low, high), (above, hysteresis) = self.outputs[0.0], MARGIN
        fall = max(low, voltage + above)
        return (fall + hysteresis, fall) if fall + hysteresis < min(high, self.full) else None


SHARP = 0.03  # V: within which a netlist's comparator acts
MARGIN = 0.2, 0.4  # V: of the end of an output above its voltage, and of its beginning above its end
_LTC_LOW, _LTC_HIGH = (4.04, 2.87), (5.05, 3.67)
_TRACKS: dict[str, Any] = {
    "names": ("Vreg", "Von", "Voff", "Vfull"),
    "netlist": "bq25570",
    "ratio": 0.5,
    "charging": ((1.0, 1e-5, 0.8),),
    "spread": 0.12,
    "cold_efficiency": 0.05,
}
_GRAPHS = "charging of 80 % (its efficiencies are graphs only), a cold start of 5 %"
CHIPS = {
    "ltc3588": Chip(
        names=("Vreg", "Vrise", "Vfall"),
        outputs={1.8: _LTC_LOW, 2.5: _LTC_LOW, 3.3: _LTC_HIGH, 3.6: _LTC_HIGH},
        efficiencies=((1e-6, 0.85),),
        own=950e-9,
        low_own=450e-9,
        most=20.0,
        diodes=(4.4e-9, 1.0),
        netlist="ltc3588",
        source="LTC3588-1, Analog Devices: page 1 (950 nA, 450 nA, 20 V)",
        assumed="thresholds, an output of 85 %",
    ),
    "bq25570": Chip(
        **_TRACKS,
        outputs={0.0: (2.4, 5.5)},
        efficiencies=((1e-6, 0.4), (4e-6, 0.73), (32e-6, 0.88), (512e-6, 0.93)),
        own=488e-9,
        most=5.1,
        look=0.256,
        full=5.0,
        cold_voltage=0.6,
        hand_over=1.73,
        least=0.1,
        source="BQ25570, Texas Instruments SLUSBH2C: page 5 (inputs, hand-over, 488 nA); SLUSBJ3F (looks, ratio)",
        assumed=_GRAPHS + ", 0.6 V of it, the output",
    ),
    "adp5091": Chip(
        **_TRACKS,
        outputs={0.0: (2.2, 5.2)},
        efficiencies=((1e-6, 0.8),),
        own=510e-9,
        most=3.3,
        look=0.256,
        full=5.0,
        cold_voltage=0.38,
        hand_over=1.9,
        least=0.08,
        source="ADP5091, Analog Devices, Rev. A: features (510 nA, 0.08 to 3.3 V, cold start from 380 mV)",
        assumed=_GRAPHS + " up to 1.9 V, looks of 256 ms every 16 s, a ratio of 0.5, a store of 2.2 to 5.2 V, "
        "full at 5 V, an output of 80 %",
    ),
    "aem30940": Chip(
        **_TRACKS,
        outputs={0.0: (2.2, 4.5)},
        efficiencies=((1e-6, 0.8),),
        own=500e-9,
        most=5.0,
        period=0.33,
        look=0.005,
        full=4.5,
        cold_voltage=0.38,
        cold_power=3e-6,
        hand_over=2.2,
        least=0.05,
        source="AEM30940, e-peas: features (cold start from 380 mV and 3 uW, looks every 0.33 s, ratio, 0.05 to 5 V)",
        assumed=_GRAPHS
        + " up to 2.2 V, looks of 5 ms, a current of 500 nA, a store of 2.2 to 4.5 V, full then, an output of 80 %",
    ),
    "spv1050": Chip(
        **_TRACKS,
        outputs={0.0: (2.2, 5.3)},
        efficiencies=((1e-6, 0.8),),
        own=800e-9,
        most=5.3,
        look=0.4,
        full=5.0,
        cold_voltage=0.55,
        cold_power=16.5e-6,
        hand_over=2.6,
        least=0.15,
        source="SPV1050, STMicroelectronics DocID025569: features (cold start from 550 mV and 30 uA, the store's ends)",
        assumed=_GRAPHS + " up to 2.6 V, looks of 0.4 s every 16 s, a current of 800 nA, an input of 0.15 to 5.3 V, "
        "a ratio of 0.5, full at 5 V, an output of 80 %",
    ),
}
