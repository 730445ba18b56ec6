"""The quantity that a search maximises: the mean power, that of most devices, or a front of two objectives."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from harvester.errors import invalid, reading, unknown
from harvester.quantities.units import fraction
from harvester.studies.tolerance.device_limits import QUANTITIES, Limit

POWER = "mean_power"
WAYS = {"low": -1, "high": 1}
# "mean_power", "5%", "voltage_rms:high", or several
ObjectiveSpec: TypeAlias = str | float | Sequence[str | float]


@dataclass(frozen=True)
class Objective:
    """The power that all but a ``share`` of the devices exceed (None: the mean), and a second objective.

    ``aimed`` is a limit that any value of the second quantity meets, with the sign of the side that
    is better: 1 if it is to be high; None without one.
    """

    share: float | None = None
    second: Limit | None = None

    @classmethod
    def of(cls, objective: ObjectiveSpec) -> "Objective":
        """The meaning of the argument ``objective``; raises InputError for a wrong one."""
        words = [objective] if isinstance(objective, str | float | int) else list(objective)
        others = [word for word in words if word != POWER]
        shares = [
            word
            for word in others
            if not isinstance(word, str) or word.strip()[:1] in "0123456789.-"
        ]
        quantities = [word for word in others if word not in shares]
        if len(shares) > 1 or len(quantities) > 1:
            raise invalid(
                "`objective`",
                "be a fraction of devices, a second quantity, or one of each",
                objective,
            )
        return cls(
            read_share(shares[0]) if shares else None,
            read_second(str(quantities[0])) if quantities else None,
        )


def read_share(share: str | float) -> float:
    """A fraction of devices from 0.1 % to 50 %, from a number or a text such as "5%".

    InputError for another.
    """
    value = reading("`objective`", fraction, share) if isinstance(share, str) else float(share)
    if not 0.001 <= value <= 0.5:
        raise invalid("`objective`", "be a fraction of devices between 0.1 % and 50 %", share)
    return value


def read_second(text: str) -> Limit:
    """The quantity of a second objective, to be low, or high if ``:high`` follows it."""
    name, colon, way = text.partition(":")
    known = [quantity for quantity in QUANTITIES if quantity != POWER]
    if name not in known:
        raise unknown("quantity of `objective`", name, known)
    if colon and way not in WAYS:
        raise invalid("`objective`", f"be {name}:low or {name}:high", text)
    sign = WAYS[way or "low"]
    return Limit(name, sign, -sign * math.inf, "")
