"""The lines above the numbers of a file: sampling rate and units, as `Sample rate: 200 Hz`.

Loggers, oscilloscopes and LabVIEW (.lvm) write lines of a name and its value there.
"""

import itertools
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from harvester.quantities.kinds import FREQUENCY, TIME
from harvester.quantities.units import split_unit

LONGEST = 200  # letters of a line that are looked at
_LINE = re.compile(r"[\s#%!;/\"]*([A-Za-z][\w .()/^-]*?)\s*[:=,;\t]\s*\"?([^\"]*)\"?")
_RATE = re.compile(
    r"(?:sampl\w*|data|acquisition|scan)[ _-]?(?:rate|freq\w*)|rate|fs|odr", re.IGNORECASE
)
_UPDATES = re.compile(r"update[ _-]?rate", re.IGNORECASE)  # perhaps a display's
_PERIOD = re.compile(
    r"sampl\w*[ _-]?(?:period|interval|time)|delta[ _-]?[xt]|x[ _-]?axis[ _-]?delta|"
    r"time[ _-]?(?:step|increment)|dt",
    re.I,
)
_Y_UNIT = re.compile(r"(?:y|vertical)(?:[ _-]?axis)?[ _-]?units?(?:[ _-]?label)?", re.IGNORECASE)
_X_UNIT = re.compile(r"(?:x|horizontal)(?:[ _-]?axis)?[ _-]?units?(?:[ _-]?label)?", re.IGNORECASE)
_HERTZ = {"sps": "Hz", "samples/s": "Hz", "sa/s": "Hz"}
_UNIT_OF_KEY = re.compile(r"(.*?)\s*\(([^()]*)\)")


@dataclass(frozen=True)
class Preamble:
    """The sampling ``rate`` (Hz), and the units of both axes; None or "" if they are not stated.

    ``period`` is a time between samples whose unit is not stated.
    """

    rate: float | None = None
    x_unit: str = ""
    y_unit: str = ""
    period: float | None = None

    @property
    def is_sampled(self) -> bool:
        """Whether the rate or the period of the samples is stated."""
        return self.rate is not None or self.period is not None


NOTHING = Preamble()


def preamble(lines: Iterable[str]) -> Preamble:
    """The facts in lines above the numbers; other lines are left out."""
    lines = list(lines)
    rate: float | None = None
    updates: float | None = None
    period = _increment(lines)
    open_period: float | None = None
    x_unit = ""
    y_unit = ""
    for line in lines:
        match = _LINE.fullmatch(line.strip()[:LONGEST])
        if match is None:
            continue
        key = match[1].strip()
        value = re.split(r"[\t,;]", match[2].strip())[0].strip()
        inner = _UNIT_OF_KEY.fullmatch(key)
        key, unit = (inner[1], inner[2]) if inner else (key, "")
        if _RATE.fullmatch(key):
            rate = _number(value, unit or "Hz", FREQUENCY.scale, _HERTZ)
        elif _UPDATES.fullmatch(key):
            updates = _number(value, unit or "Hz", FREQUENCY.scale, _HERTZ)
        elif _PERIOD.fullmatch(key):
            period = _number(value, unit or x_unit, TIME.scale, {"S": "s"})
            open_period = None if period is not None else _plain(value)
        elif _Y_UNIT.fullmatch(key):
            y_unit = value
        else:
            x_unit = _unit_of_times(key, value) or x_unit
    facts = _with_period(rate, period, open_period, (x_unit, y_unit))
    return facts if facts.is_sampled else replace(facts, rate=updates)


def _increment(lines: Sequence[str]) -> float | None:
    """The time step below the word Increment, as oscilloscopes with numbered samples write it."""
    for line, below in itertools.pairwise(lines):
        names = [name.strip().lower() for name in line[:LONGEST].split(",")]
        numbers = below[:LONGEST].split(",")
        if "increment" in names and len(numbers) > names.index("increment"):
            return _number(numbers[names.index("increment")], "s", TIME.scale, {})
    return None


def _unit_of_times(key: str, value: str) -> str:
    """The unit of the first axis; "" if the line does not state it."""
    if _X_UNIT.fullmatch(key):
        return {"S": "s", "Sec": "s"}.get(value, value)
    # LabVIEW's unit of times
    return "s" if (key.lower(), value.lower()) == ("x_dimension", "time") else ""


def is_spectral(unit: str) -> bool:
    """Whether the unit of a first axis is that of a frequency, as of a spectrum."""
    return bool(unit) and FREQUENCY.scale(unit)[0] is not None


def _with_period(
    rate: float | None, period: float | None, bare: float | None, units: tuple[str, str]
) -> Preamble:
    """The facts by a rate (Hz), or else by a period (s), or by one without a unit."""
    if is_spectral(units[0]):
        return Preamble(rate, units[0], units[1])
    if rate is None and period is not None and period > 0.0:
        rate = 1.0 / period
    return Preamble(rate, units[0], units[1], bare if rate is None else None)


def _plain(text: str) -> float | None:
    """A number above 0 without a unit; None for another text."""
    parts = split_unit(text)
    return parts[0] if parts is not None and not parts[1].strip() and parts[0] > 0.0 else None


def _number(
    text: str, unit: str, scale: Callable[[str], tuple[float | None, int]], others: dict[str, str]
) -> float | None:
    """A number in SI units, in ``unit`` if it has none.

    None for another text, and if it is not above 0.
    """
    parts = split_unit(text)
    written = unit if parts is None else parts[1].strip() or unit
    if parts is None or not written:
        return None
    written = others.get(written, others.get(written.lower(), written))
    factor, _ = scale(written)
    return parts[0] * factor if factor is not None and parts[0] > 0.0 else None
