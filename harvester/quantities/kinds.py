"""The kinds of quantity that a scene is made of: each with its name, SI unit, example and range."""

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, get_args

from harvester.quantities import units

_SHORT = 40  # letters of a unit that an error shows
# g, mg, ug of an acceleration
_GRAVITY = re.compile(r"(?<![A-Za-z])([mu]?)[gG](?:n|rms|_rms)?(?![A-Za-z])")


@dataclass(frozen=True, repr=False)
class Kind:
    """A physical quantity: its name, the SI unit that a bare number is in, an example, its range.

    ``typical`` are the sizes that devices have, from the smallest of silicon to tons: outside there
    is a warning.

    As part of an annotation it makes pydantic read the values of a key: ``mass: Annotated[float,
    MASS]``.
    """

    name: str
    unit: str
    example: str
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    typical: tuple[float, float] = (0.0, math.inf)
    gravity: bool = False  # in an acceleration "g" is standard gravity, not gram

    def __repr__(self) -> str:
        return self.name

    @property
    def must(self) -> str:
        """The requirement on a value, in the words of an error."""
        text = f"be {self.name}, such as {self.example}"
        if self.least > -math.inf and self.most < math.inf:
            return f"{text}, between {self.least:g} and {self.most:g}"
        if self.least > -math.inf:
            return f"{text}, at least {self.least:g}"
        most = f" and at most {self.most:g}" * (self.most < math.inf)
        return text if self.above == -math.inf else f"{text}, above {self.above:g}{most}"

    def read(self, value: object) -> float:
        """The value in SI units, from a number or from a text with a unit.

        ValueError (``must ...``) for another.

        The error's ``why`` (`harvester.quantities.units.Unread`) names which part of a text was not
        understood.
        """
        return self._checked(*self._number(value))

    def reads(self, text: str) -> bool:
        """Whether a text is such a quantity."""
        try:
            self.read(text)
        except ValueError:
            return False
        return True

    def _checked(self, number: float | None, why: str) -> float:
        if number is None or not math.isfinite(number):
            raise units.Unread(f"must {self.must}", why)
        if not (number > self.above and self.least <= number <= self.most):
            raise ValueError(f"must {self.must}")
        if number and not units.SMALLEST <= abs(number) <= units.LARGEST:
            raise ValueError(
                f"must {self.must}, between {units.SMALLEST:g} and {units.LARGEST:g} in size"
            )
        return number

    def _number(self, value: object) -> tuple[float | None, str]:
        """The number in SI units, or None and why not."""
        if isinstance(value, bool):
            return None, ""
        if isinstance(value, int | float):
            try:
                return float(value), ""
            except OverflowError:
                return None, ""
        parts = units.split_unit(value)
        if parts is None:
            return None, "a text must begin with a number" if isinstance(
                value, str
            ) and value.strip() else ""
        number, unit = parts
        if unit == "" and self.unit != "":
            return (
                None,
                f"it has no unit: write the number without quotation marks for {self.unit}, or add the unit",
            )
        if unit == "%" and self.unit == "":
            return float(Decimal(repr(number)).scaleb(-2)), ""  # 2.7% is 0.027 to the last digit
        factor, power = self.scale(unit)
        if factor is None:
            return None, self._not_understood(unit)
        return number * factor if power == 1 else math.copysign(
            number * number, number
        ) * factor, ""

    def scale(self, unit: str) -> tuple[float | None, int]:
        """The factor that brings a number with this unit to SI, and the power to raise the number to before.

        The power is 2 for the root of a density, such as mg/rtHz; the factor is None for anything
        that is not a unit of the kind.
        """
        if unit == "":
            return 1.0 if self.unit == "" else None, 1
        density = units.squared(unit) if self.unit.endswith("^2/Hz") else None
        plain, power = (unit, 1) if density is None else (density, 2)
        if self.gravity and len(plain) <= _SHORT:
            names = {"m": "milligravity", "u": "microgravity", "": "gravity"}
            plain = _GRAVITY.sub(lambda m: names[m[1]], units.respelled(plain))
        alone = units.prefix_factor(plain) if plain != self.unit else None  # a gap of 1m is a metre
        if alone is not None:
            return alone, power
        return (units.unit_factor(plain, self.unit) if self.unit else None), power

    def _not_understood(self, unit: str) -> str:
        if len(unit) > _SHORT:
            return "the text after the number is not a unit"
        if self.unit == "":
            return f"{unit!r} after the number was not understood, for it has no unit"
        if unit.startswith(","):
            return "the decimal sign must be a point"
        if units.is_unit(unit):
            return f"the unit {unit!r} is one of another quantity"
        return f"the unit {unit!r} was not understood"

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        def read(value: object) -> float | None:
            return None if value is None and optional else self.read(value)

        optional = type(None) in get_args(source)
        return core_schema.no_info_before_validator_function(read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return self.json_schema()

    def json_schema(self) -> dict[str, Any]:
        """The schema of a value in a scene file: a number in its range, or a text that begins with one."""
        bounds = {"exclusiveMinimum": self.above, "minimum": self.least, "maximum": self.most}
        known = {name: bound for name, bound in bounds.items() if math.isfinite(bound)}
        sign = "[+]?" if self.above >= 0.0 else "[+-]?"
        unit = r".*[^\d\s.eE+-]" if self.unit else ""  # a text of such a kind carries its unit
        return {
            "anyOf": [
                {"type": "number", **known},
                {"type": "string", "pattern": rf"^\s*{sign}(\d|\.\d){unit}"},
            ]
        }


MASS = Kind("a mass (kg)", "kg", "'40 g'", above=0.0, typical=(1e-13, 1e5))
STIFFNESS = Kind("a stiffness (N/m)", "N/m", "'16 N/m'", typical=(1e-5, 1e10))
STOP_STIFFNESS = Kind("a stiffness (N/m)", "N/m", "'1e5 N/m'", above=0.0, typical=(1e-5, 1e12))
QUADRATIC_STIFFNESS = Kind("a quadratic stiffness (N/m^2)", "N/m^2", "1e3")
CERAMIC_SOFTENING = Kind("a softening of X |X| (N/m^2)", "N/m^2", "1e3", least=0.0)
CUBIC_STIFFNESS = Kind("a cubic stiffness (N/m^3)", "N/m^3", "1e5")
DAMPING = Kind("a damping coefficient (N s/m)", "N s/m", "'6.4e-3 N s/m'")
STOP_DAMPING = Kind("a damping coefficient (N s/m)", "N s/m", "'1 N s/m'", least=0.0)
DAMPING_X2 = Kind("a damping coefficient of X^2 (N s/m^3)", "N s/m^3", "10.0")
DAMPING_X4 = Kind("a damping coefficient of X^4 (N s/m^5)", "N s/m^5", "1e6")
DAMPING_V = Kind("a damping coefficient of |X'| (N s^2/m^2)", "N s^2/m^2", "0.5", least=0.0)
INERTIA_X2 = Kind("a mass of X^2 (kg/m^2)", "kg/m^2", "2.0", least=0.0)
GAP = Kind("a distance from rest (m)", "m", "'0.5 mm'", typical=(1e-10, 0.3))
RESTITUTION = Kind("a restitution coefficient", "", "0.96", least=0.0, most=1.0)
COUPLING = Kind(
    "an electromechanical coupling (N/V)", "N/V", "1e-3", above=0.0, typical=(1e-10, 1e4)
)
COUPLING_X2 = Kind("a coupling of X^2 (N/(V m^2))", "N/(V m^2)", "5.0")
LOSS_TANGENT = Kind("a loss tangent", "", "0.02", least=0.0, most=1.0)
MODE_COUPLING = Kind("an electromechanical coupling (N/V), of either sign", "N/V", "-1e-3")
PARTICIPATION = Kind("a number", "", "-0.4")
MAGNIFIER_STIFFNESS = Kind("a stiffness (N/m)", "N/m", "'60 N/m'", above=0.0, typical=(1e-5, 1e12))
ROOM = Kind("a free way (m)", "m", "'4 mm'", above=0.0, typical=(1e-10, 10.0))
TILT = Kind("an angle in degrees", "", "15", least=0.0, most=90.0)
STRAIN_OF = Kind("a strain a displacement (1/m)", "1/m", "2.5", above=0.0)
CAPACITANCE = Kind("a clamped capacitance (F)", "F", "'50.2 nF'", above=0.0, typical=(1e-14, 1e-3))
RESISTANCE = Kind("a load resistance (ohm)", "ohm", "'1 Mohm'", above=0.0, typical=(1e-2, 1e13))
ACCELERATION = Kind(
    "an acceleration (m/s^2)", "m/s^2", "'0.1 g'", least=0.0, gravity=True, typical=(1e-9, 1e6)
)
ACCELERATION_PSD = Kind(
    "a one-sided acceleration density ((m/s^2)^2/Hz)",
    "(m/s^2)^2/Hz",
    "'0.01 g^2/Hz'",
    least=0.0,
    typical=(1e-18, 1e8),
    gravity=True,
)
FREQUENCY = Kind("a frequency (Hz)", "Hz", "'3.2 Hz'", above=0.0)
VOLTAGE = Kind("a voltage (V)", "V", "'3.3 V'")
VOLTAGE_FROM_0 = Kind("a voltage (V)", "V", "'3.3 V'", least=0.0)
RESISTANCE_FROM_0 = Kind("a resistance (ohm)", "ohm", "'10 ohm'", least=0.0)
STORAGE = Kind("a capacitance (F)", "F", "'470 uF'", above=0.0, typical=(1e-9, 1e4))
CHARGE = Kind("a charge (C)", "C", "'360 C'", above=0.0)
RETRIES = Kind("a number of times", "", "3", least=0.0, most=100.0)
CURRENT = Kind("a current (A)", "A", "'4 mA'", least=0.0)
ENERGY = Kind("an energy (J)", "J", "'200 uJ'", above=0.0)
SHARE = Kind("a share", "", "0.85", above=0.0, most=1.0)
TIME = Kind("a time (s)", "s", "'50 ms'", above=0.0)
QUALITY = Kind("a quality factor", "", "125", above=0.0, typical=(0.1, 1e8))
NUMBER = Kind("a number", "", "0.05")
NUMBER_FROM_0 = Kind("a number", "", "0.05", least=0.0)
NUMBER_ABOVE_0 = Kind("a number", "", "1.5", above=0.0)
# of any dimension; see `any_quantity`
ANY = Kind("a number or a quantity with a unit", "", "'10 uF'")


def with_prefix(value: object, kind: Kind) -> float:
    """A quantity as the command line writes it: "1k", "10M", "1 Mohm", "3e4".

    ValueError as `Kind.read`.

    In addition to the texts of a scene file it accepts a bare number, in SI units, because
    there all values are texts.
    """
    parts = units.split_unit(value)
    return kind.read(parts[0]) if parts is not None and parts[1] == "" else kind.read(value)


def any_quantity(value: object) -> float:
    """A quantity of any dimension in SI base units, such as 1e6, "1 Mohm", "10 uF".

    ValueError as `Kind.read`.
    """
    parts = units.split_unit(value)
    if parts is None or parts[1] == "":
        return ANY.read(value if parts is None else parts[0])
    number, unit = parts
    factor = units.prefix_factor(unit) or units.unit_factor(unit, None)
    if factor is None:
        raise units.Unread(f"must {ANY.must}", f"the unit {unit[:_SHORT]!r} was not understood")
    return ANY.read(number * factor)
