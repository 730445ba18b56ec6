"""Options of the engines: their names, their ranges, and numbers that may be given as a text."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import ClassVar, Self, dataclass_transform

from harvester.errors import InputError, invalid, names_arguments, reading
from harvester.quantities.units import Seconds, fraction, seconds, time


def number(value: float | str | None) -> float | None:
    """The number that an option holds, which may be given as a text (``within="1%"``) and is read at once."""
    assert not isinstance(value, str)
    return value


@dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclass(frozen=True, kw_only=True)
class Request:
    """Options of every engine: a class that derives from it is such a dataclass, which also answers a misspelt keyword.

    within
        relative total mean-power error to reach (sampling at 95 % plus bias), such as 0.01
        or "1%"; None: one round.  A formula cannot work towards it: it states if its own error
        is larger, or not known.
    budget
        seconds that reaching it may need, such as 30 or "30s", burn-in included and compilation
        not.  Runs of ngspice that have not ended then are given up; a burn-in of the mechanics is
        bounded by its steps, and may need longer.
    seed
        the same seed, the same noise.
    """

    within: float | str | None = None
    budget: float | str | None = None
    seed: int = 0

    FINEST: ClassVar[float] = 1e-5  # the least ``within`` that may be asked for
    # whether an engine that is seen not to reach its target leaves the budget to another
    GIVES_UP: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        names_arguments(dataclass(frozen=True, kw_only=True)(cls))

    def __post_init__(self) -> None:
        given = self.within
        within, _ = (
            _read_positive(self, "within", fraction),
            _read_positive(self, "budget", seconds),
        )
        if within is not None and not self.FINEST <= within < 1.0:
            shown = given if isinstance(given, str) else f"{within:.3g}"
            raise invalid("`within`", f"be between {100.0 * self.FINEST:g} % and 100 %", shown)
        if not isinstance(self.seed, Integral) or self.seed < 0:
            raise invalid("`seed`", "be a whole number of at least 0", self.seed)

    def with_seed(self, seed: int) -> Self:
        """The engine with the noise of another seed."""
        return replace(self, seed=seed)

    def giving_up(self) -> Self:
        """The engine that leaves the budget to another if it is seen not to reach its target."""
        engine = replace(self)
        object.__setattr__(engine, "GIVES_UP", True)
        return engine


class MonteCarloOptions(Request):
    """Options of the engines that sample.

    duration, dt
        of a trajectory after its burn-in, and the step: in seconds for a physical scene (or a text
        such as "1ms"), else nondimensional; None: chosen from the scene.
    trajectories
        independent ones; None: chosen by the engine.
    """

    # What makes means cheaper, where there is any: `harvester cost` measures engines without one of
    # them.
    CONTROLS: ClassVar[bool] = True  # sums of mean zero explain what they can of a mean's spread
    PAIRING: ClassVar[bool] = True  # ngspice's runs go beside a cheap model on the same noise
    SETTLED: ClassVar[bool] = True  # and begin in states of a circuit of ideal elements

    duration: float | str | None = None
    trajectories: int | None = None
    dt: float | str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("duration", "dt"):
            _read_positive(self, name, time)
        if self.trajectories is not None and not 2 <= self.trajectories <= 1_000_000:
            raise invalid("`trajectories`", "be between 2 and 1000000", self.trajectories)

    def step(self, frequency: float) -> float | None:
        """The step ``dt`` in 1/w0, of a scene whose unit of time is 1/``frequency``.

        None: chosen from the scene.
        """
        dt = number(self.dt)
        return None if dt is None else dt * frequency

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


def _read_positive(options: Request, name: str, read: Callable[[str], float]) -> float | None:
    """The number of an option, in the place of its text."""
    value: float | str | None = getattr(options, name)
    if isinstance(value, str):
        value = reading(f"`{name}`", read, value)
        object.__setattr__(options, name, value)
    if value is not None and (isinstance(value, bool) or not isinstance(value, Real)):
        raise invalid(f"`{name}`", "be a number or a text", value)
    if value is not None and not (value > 0.0 and math.isfinite(value)):
        raise invalid(f"`{name}`", "be above 0", value)
    return value
