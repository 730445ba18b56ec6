"""The responses that one steady drive may have, where the mass is not linear: what each is, and its mean power."""

from dataclasses import dataclass
from typing import ClassVar

from harvester.presentation.result import Result
from harvester.uncertainty.value import Value


@dataclass(frozen=True, repr=False, eq=False)
class SteadyResponse(Result):
    """A response to a steady drive: its mean power in the answer's unit, and the share of starts that come to it.

    It comes back after so many ``periods`` of the drive, or after none (None): then it is ``chaotic``, or
    quasi-periodic.  The mean is that of ``engine``; ``note`` says what another engine finds there.
    """

    SHORT: ClassVar[tuple[str, ...]] = ("mean_power", "periods", "share_of_starts")

    mean_power: Value
    share_of_starts: float
    periods: int | None
    chaotic: bool
    engine: str
    note: str = ""
