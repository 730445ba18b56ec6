"""The responses that one steady drive may have, where the mass is not linear: what each is, and its mean power."""

from dataclasses import dataclass
from typing import Any

from harvester.uncertainty.value import Value, number


@dataclass(frozen=True)
class SteadyResponse:
    """A response to a steady drive: its mean power in the answer's unit, and the ``share`` of starts that come to it.

    It comes back after so many ``periods`` of the drive, or after none (0): then it is ``chaotic``, or quasi-periodic.
    The mean is that of ``engine``; ``note`` says what another engine finds there.
    """

    mean_power: Value
    share: float
    periods: int
    chaotic: bool
    engine: str
    note: str = ""

    @property
    def kind(self) -> str:
        """What it is, in a few words."""
        if self.periods:
            return "period of the drive" if self.periods == 1 else f"{self.periods} periods of the drive: subharmonic"
        return "chaotic" if self.chaotic else "not periodic, not chaotic"

    def as_json(self) -> dict[str, Any]:
        """The object that ``--json`` prints; ``periods`` is null where nothing comes back."""
        of = {"share_of_starts": self.share, "periods": self.periods or None, "chaotic": self.chaotic}
        return {"mean_power": number(self.mean_power)} | of | {"engine": self.engine, "note": self.note}

    def text(self, unit: str) -> str:
        """Its line in the text of an answer."""
        return f"{self.mean_power.format(unit)}, {self.kind}, from {self.share:.0%} of the starts" + (
            f"; {self.note}" if self.note else ""
        )
