"""The requirements of a design: a power at a voltage, how soon, and limits."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import TIME, VOLTAGE, Kind, with_prefix
from harvester.scene.scene import Scene
from harvester.studies.tolerance.device_limits import QUANTITIES, Limit, parse

POWER = Kind("a power (W)", "W", "'40 uW'", above=0.0)
_FORM = re.compile(r"\s*(.+?)\s+at\s+(.+?)\s*")
_LIMITED = ("mean_power", "peak_displacement")
MOST_VOLTS = 1000.0


@dataclass(frozen=True)
class DesignNeed:
    """A ``power`` (W) at a ``voltage`` (V), ``wake`` s after empty storage, and ``limits``; and how it was written.

    ``packet`` is the energy (J) of a node's packet at the storage capacitor, ``stop`` the voltage
    that the storage capacitor must keep then.  The node's ``supply`` is the voltage (V) of its
    regulator and the power (W) that it consumes there, which a chip's output must give in the
    regulator's place.
    """

    power: float
    voltage: float
    wake: float | None
    limits: tuple[Limit, ...]
    needs: str
    wake_written: str = ""
    packet: float = 0.0
    stop: float = 0.0
    supply: tuple[float, float] | None = None

    @property
    def load(self) -> float:
        """The resistance (ohm) that draws the power at the voltage."""
        return self.voltage**2 / self.power

    def for_circuit(self, *, is_chip: bool) -> "DesignNeed":
        """The need for a circuit: the supply's voltage behind a chip, the wake voltage at the storage capacitor."""
        if self.supply is None or not is_chip:
            return self
        volts, watts = self.supply
        return replace(self, voltage=volts, power=watts)


def read_need(
    scene: Scene, needs: str | None, wake: float | str | None, limit: Sequence[str] | str
) -> DesignNeed:
    """The needs in texts; without ``needs`` those of the scene's [node].

    Raises InputError for texts of another form, a scene without [node] if ``needs`` is left out,
    and a limit of the displacement under noise.
    """
    limits = _limits(scene, [limit] if isinstance(limit, str) else limit)
    seconds = None if wake is None else _read("wake", str(wake), TIME)
    wake_written = "" if wake is None else str(wake)
    if needs is None:
        return _of_node(scene, seconds, limits, wake_written)
    match = _FORM.fullmatch(needs)
    if match is None:
        raise invalid("`needs`", "be POWER at VOLTAGE, such as '40 uW at 3.3 V'", needs)
    volts = _read("needs", match[2], VOLTAGE)
    if not 0.0 < volts <= MOST_VOLTS:
        raise invalid("the voltage of `needs`", f"be above 0 and at most {MOST_VOLTS:g}", volts)
    watts = _read("needs", match[1], POWER)
    written = " ".join(needs.split())
    return DesignNeed(watts, volts, seconds, limits, written, wake_written)


def _limits(scene: Scene, texts: Sequence[str]) -> tuple[Limit, ...]:
    limits = tuple(
        parse(text, quantities={name: QUANTITIES[name] for name in _LIMITED}) for text in texts
    )
    steady = scene.excitation is not None and scene.excitation.frequency is not None
    if not steady and any(limit.quantity == "peak_displacement" for limit in limits):
        raise InputError(
            "a limit of peak_displacement under noise is for 'harvester tolerance' with `lifetime`"
        )
    return limits


def _read(argument: str, text: str, kind: Kind) -> float:
    try:
        return with_prefix(text, kind)
    except ValueError as error:
        raise InputError(f"`{argument}` {error}, but is {text[:80]!r}") from None


def _of_node(
    scene: Scene, wake: float | None, limits: tuple[Limit, ...], written: str
) -> DesignNeed:
    """The mean power of a scene's [node], at its wake voltage."""
    node = scene.node
    if node is None:
        raise InputError(
            "`needs` must be given, such as '40 uW at 3.3 V', if the scene has no [node]"
        )
    sleep = node.sleep_current or 0.0
    asleep = node.interval - sum(seconds for _, seconds in node.states)
    packet = sum(amperes * seconds for amperes, seconds in node.states)
    volts = (
        node.wake_voltage
        if node.supply_voltage is None
        else node.supply_voltage / (node.efficiency or 1.0)
    )
    mean = (packet + sleep * asleep) / node.interval
    power = volts * mean
    supply = (
        None if node.supply_voltage is None else (node.supply_voltage, node.supply_voltage * mean)
    )
    return DesignNeed(
        *(power, node.wake_voltage, wake, limits, "[node]"),
        written,
        packet * volts,
        node.stop_voltage,
        supply,
    )
