"""Facts about a logger's file that it does not state, and the error that asks for one of them."""

from dataclasses import dataclass

from harvester.errors import InputError


@dataclass(frozen=True)
class RecordFacts:
    """Facts that the options of `harvester record` give; None if the file states them itself.

    ``axis`` is a column, ``rate`` (Hz) the sampling rate, ``unit`` the unit of the acceleration or
    the acceleration of one count, ``time_unit`` one of `harvester.records.time_units.UNITS`,
    ``where`` a word of a column such as "sensor=A".
    """

    axis: str | None = None
    rate: float | None = None
    unit: str | None = None
    time_unit: str | None = None
    where: str | None = None


NO_FACTS = RecordFacts()


class AskedError(InputError):
    """A file leaves a fact open: its ``option``, and its likeliest ``value`` or None."""

    def __init__(self, text: str, option: str = "", value: str | None = None) -> None:
        super().__init__(text)
        self.option = option
        self.value = value


class MendError(InputError):
    """A fault of a record that `harvester record` corrects; ``plain`` is the fault alone."""

    def __init__(self, plain: str) -> None:
        super().__init__(f"{plain}: 'harvester record FILE --out clean.csv' mends it")
        self.plain = plain
