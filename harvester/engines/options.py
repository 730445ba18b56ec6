"""Options of the engines: what they are, what they may be, and numbers that may be given as a text."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral
from typing import Any, ClassVar, overload

from harvester.errors import InputError, invalid, refused
from harvester.quantities.units import Seconds, fraction, seconds, time


class NumberOrText:
    """An optional number of an engine that may be set as a text: ``within="1%"``, ``budget="30s"``."""

    def __init__(self, read: Callable[[str], float]) -> None:
        self._read, self._name = read, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, engine: None, owner: type) -> None: ...

    @overload
    def __get__(self, engine: object, owner: type) -> float | None: ...

    def __get__(self, engine: Any, owner: type) -> float | None:
        value: float | None = None if engine is None else vars(engine)[self._name]
        return value

    def __set__(self, engine: object, value: float | str | None) -> None:
        if isinstance(value, str):
            try:
                value = self._read(value)
            except ValueError as error:
                raise refused(f"`{self._name}`", error, value) from None
        vars(engine)[self._name] = value


def number(value: float | str | None) -> float | None:
    """The number that a `NumberOrText` holds: mypy takes it for all that it may be set to."""
    assert not isinstance(value, str)
    return value


@dataclass(frozen=True, kw_only=True)
class Request:
    """Options of every engine.

    within
        relative total error of the mean power to reach (sampling at 95 % plus bias), such as .01 or "1%"; None: one
        round.  A formula cannot work towards it: it says where its own error is larger, or not known.
    budget
        seconds that reaching it may take, such as 30 or "30s", burn-in included and compilation not.  Runs of ngspice
        that have not ended then are given up; a burn-in of the mechanics is bounded by its steps, and may take longer.
    seed
        the same seed, the same noise.
    """

    within: NumberOrText = NumberOrText(fraction)
    budget: NumberOrText = NumberOrText(seconds)
    seed: int = 0

    FINEST: ClassVar[float] = 1e-5  # the least ``within`` that may be asked for

    def __post_init__(self) -> None:
        _check_positive(self, "within", "budget")
        if self.within is not None and not self.FINEST <= self.within < 1.0:
            raise invalid("`within`", f"be between {100.0 * self.FINEST:g}% and 100%", f"{self.within:.3g}")
        if not isinstance(self.seed, Integral) or self.seed < 0:
            raise invalid("`seed`", "be a whole number of at least 0", self.seed)


@dataclass(frozen=True, kw_only=True)
class MonteCarloOptions(Request):
    """Options of the engines that sample.

    duration, dt
        of a trajectory after its burn-in, and the step: in seconds for a physical scene (or a text such as "1ms"), else
        nondimensional; None: chosen from the scene.
    trajectories
        independent ones; None: chosen by the engine.
    """

    # What makes means cheaper, where there is any: `harvester cost` measures engines without one of them.
    CONTROLS: ClassVar[bool] = True  # sums of mean zero explain what they can of a mean's spread
    PAIRING: ClassVar[bool] = True  # ngspice's runs go beside a cheap model on the same noise
    SETTLED: ClassVar[bool] = True  # and begin in states of a circuit of ideal elements

    duration: NumberOrText = NumberOrText(time)
    trajectories: int | None = None
    dt: NumberOrText = NumberOrText(time)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_positive(self, "duration", "dt")
        if self.trajectories is not None and not 2 <= self.trajectories <= 1_000_000:
            raise invalid("`trajectories`", "be between 2 and 1000000", self.trajectories)

    def check_times(self, physical: bool) -> None:
        """Refuse times with a unit for a nondimensional scene, in an InputError: its times are multiples of 1/w0."""
        for name in ("duration", "dt"):
            check_time(name, getattr(self, name), physical)


def check_time(name: str, value: float | None, physical: bool) -> None:
    """Refuse a time with a unit for a nondimensional scene, with an InputError."""
    if isinstance(value, Seconds) and not physical:
        raise InputError(
            f"`{name}` must be a number without a unit, in 1/w0, for a nondimensional scene, but is {float(value):g} s"
        )


def _check_positive(options: Request, *names: str) -> None:
    for name in names:
        value = getattr(options, name)
        if value is not None and not (value > 0.0 and math.isfinite(value)):
            raise invalid(f"`{name}`", "be above 0", value)
