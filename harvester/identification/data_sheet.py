"""Single numbers of a datasheet in a fit: resonances, capacitance, quality, voltage and power.

Each is a channel of one point: its logarithm is normal about that of the device, with the error of
the meter and of the model of a linear device (`harvester.studies.prediction.evidence`), or with the
spread of a datasheet (`harvester.studies.prediction.priors`).  If nothing determines the damping,
its prior is one point more, about the median of the class.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, reading, unknown
from harvester.identification import quantities
from harvester.identification.fit import Channel
from harvester.identification.measurement import StatedNumber
from harvester.linear.single_points import LOADED, OPEN, DataSheetPoint, LinearDevice, read_point
from harvester.quantities.kinds import CAPACITANCE, FREQUENCY, QUALITY
from harvester.studies.prediction import priors
from harvester.studies.prediction.evidence import METER, MODEL_SHARE, RESONANCE

KINDS = {"frequency": FREQUENCY, RESONANCE: FREQUENCY, "capacitance": CAPACITANCE, "q": QUALITY}
NAMES = (*KINDS, OPEN, LOADED)
# The spread of a number of a datasheet, by the quantity of the priors.
SPREAD = {"capacitance": "capacitance", "q": "damping"}
PRIOR = "prior of the damping"
WIDE = 3.0  # half-width of the logarithm of a number that neither points nor priors determine
USUAL_PSI = 1e4  # V/m
BETAS = (1e-4, 1e-3, 0.01, 0.05, 0.2, 0.8)  # to begin from


@dataclass(frozen=True)
class DataSheet:
    """The numbers of a datasheet, and the prior that a damping of the class has."""

    numbers: tuple[StatedNumber, ...]
    points: Mapping[str, DataSheetPoint]
    prior: StatedNumber

    def value(self, name: str) -> float | None:
        """A stated number; None if the datasheet has none."""
        return next((number.value for number in self.numbers if number.name == name), None)

    @property
    def names(self) -> frozenset[str]:
        """The names of its numbers."""
        return frozenset(number.name for number in self.numbers)


def read_sheet(points: Mapping[str, str], device_class: str) -> DataSheet:
    """The datasheet from texts.

    Raises InputError for another name or form, and for a class that is not known.
    """
    priors.check_class(device_class)
    if not isinstance(points, Mapping):
        raise invalid("`points`", "be a mapping such as {'frequency': '60 Hz'}", points)
    model = float(priors.data()["model"]["linear"])
    read: dict[str, DataSheetPoint] = {}
    numbers = []
    for name, text in points.items():
        if name not in NAMES:
            raise unknown("point of `points`", name, NAMES)
        if name in KINDS:
            value = float(reading(f"`{name}`", KINDS[name].read, text))
        else:
            read[name] = read_point(name, text)
            value = read[name].value
        if name in SPREAD:
            sigma = _prior(SPREAD[name], "datasheet", device_class).sigma or 0.0
        else:
            sigma = math.hypot(
                METER.get(name, METER[RESONANCE]), MODEL_SHARE.get(name, 0.0) * model
            )
        numbers.append(StatedNumber(name, value, sigma))
    quality, spread = priors.unknown_quality(device_class)
    return DataSheet(tuple(numbers), read, StatedNumber(PRIOR, quality, spread))


def _prior(quantity: str, origin: str, device_class: str) -> priors.Prior:
    """A prior that every class has."""
    prior = priors.prior_of(quantity, origin, device_class)
    assert prior is not None, "the data file has it for any class"
    return prior


def fitted_names(
    sheet: DataSheet, of_files: Sequence[str], known: Mapping[str, float]
) -> tuple[str, ...]:
    """The parameters that files, points and priors determine together, without the known ones.

    Raises InputError, with the missing numbers, if they do not determine the device.
    """
    _refuse_twice(sheet, known)
    _refuse_missing(sheet, {*of_files, *known})
    sought = [name for name in ("beta", "psi") if name not in of_files]
    if "mass" in known and "psi" in sought:
        sought.remove("psi")
    stated = {*of_files, *known, *sheet.names}
    # two resonances determine the coupling, but no mass
    pair = "beta" in sought and stated >= {"frequency", RESONANCE}
    if (shortfall := len(sought) - len(sheet.points) - pair) > 0:
        raise InputError(
            f"points must determine the {' and '.join(WORDS[name] for name in sought)}, but with "
            f"{written(sheet.names)} they do not: {_remedy(sheet, stated, sought, shortfall)}"
        )
    names = dict.fromkeys([*of_files, "frequency", "quality", "capacitance", *sought])
    return tuple(name for name in names if name not in known)


def _remedy(sheet: DataSheet, stated: set[str], sought: Sequence[str], shortfall: int) -> str:
    """The numbers that determine the rest: ``shortfall`` of those that are not given."""
    numbers = [f"`{name}`" for name in (OPEN, LOADED) if name not in sheet.names]
    if "beta" in sought and not stated >= {"frequency", RESONANCE}:
        absent = [name for name in ("frequency", RESONANCE) if name not in stated]
        numbers.append(" with ".join(f"`{name}`" for name in absent))
    count = "one" if shortfall == 1 else "two"
    addition = f"add {count} of {', '.join(numbers)}" if len(numbers) > 1 else f"add {numbers[0]}"
    if "psi" not in sought:
        return addition
    if shortfall == 1:
        return f"give the mass in `known`, or {addition}"
    return f"give the mass in `known` and add one of {', '.join(numbers)}, or {addition}"


def _refuse_twice(sheet: DataSheet, known: Mapping[str, float]) -> None:
    """InputError for a number that is known and stated, and for resonances in a wrong order."""
    for name, parameter in (("capacitance", "capacitance"), ("q", "quality")):
        if name in sheet.names and parameter in known:
            raise InputError(f"`{name}` must be given once, but `known` has it as well")
    short = sheet.value("frequency")
    opened = sheet.value(RESONANCE)
    if short and opened and opened <= short:
        raise InputError(
            f"`{RESONANCE}` must be above `frequency`, which is that of a short circuit, "
            f"{short:g} Hz, but is {opened:g} Hz"
        )


def _refuse_missing(sheet: DataSheet, others: set[str]) -> None:
    """InputError if neither the datasheet nor ``others`` have a frequency or a capacitance."""
    have = others | sheet.names
    first = next(name for name in NAMES if name in sheet.names)
    if have.isdisjoint({"frequency", RESONANCE}):
        raise InputError(
            f"`frequency` or `{RESONANCE}` must be given with `{first}`, but is left out"
        )
    if "capacitance" not in have:
        raise InputError(f"`capacitance` must be given with `{first}`, but is left out")


WORDS = {"beta": "coupling", "psi": "mass"}


def written(names: frozenset[str]) -> str:
    """The points by their names."""
    return ", ".join(f"`{name}`" for name in NAMES if name in names)


def channels(
    sheet: DataSheet, of_files: Sequence[str], known: Mapping[str, float]
) -> tuple[Channel, ...]:
    """A channel for each number, and for the prior of the damping if nothing else determines it."""
    numbers = list(sheet.numbers)
    if has_prior(sheet, of_files, known):
        numbers.append(sheet.prior)
    return tuple(_channel(number, sheet.points.get(number.name)) for number in numbers)


def has_prior(sheet: DataSheet, of_files: Sequence[str], known: Mapping[str, float]) -> bool:
    """Whether the prior of the damping is in the fit."""
    return "quality" not in {*of_files, *known} and "q" not in sheet.names


def _channel(number: StatedNumber, point: DataSheetPoint | None) -> Channel:
    """A channel of one point."""

    def model(values: dict[str, float], _: Floats) -> Floats:
        try:
            with np.errstate(all="ignore"):
                value = _of(number.name, point, values)
        except (OverflowError, ZeroDivisionError):  # far from any device: as bad as no number
            value = math.nan
        return np.array([math.log(max(value, 1e-300))])

    return Channel(
        source=number,
        name="number",
        x=np.zeros(1),
        values=np.array([math.log(number.value)]),
        model=model,
        given_noise=number.sigma,
    )


def _of(name: str, point: DataSheetPoint | None, values: dict[str, float]) -> float:
    """The number that a device with these parameters has."""
    if point is not None:
        return point.of(linear_device(values))
    if name == RESONANCE:
        return values["frequency"] * math.sqrt(1.0 + values["beta"])
    return values["quality" if name in ("q", PRIOR) else name]


def linear_device(values: dict[str, float]) -> LinearDevice:
    """The device in SI units of a fit's parameters."""
    return LinearDevice(
        mass=quantities.mass(values),
        frequency=2.0 * math.pi * values["frequency"],
        q=values["quality"],
        capacitance=values["capacitance"],
        coupling=quantities.coupling(values),
    )


def starts(
    sheet: DataSheet,
    names: Sequence[str],
    of_files: Sequence[Mapping[str, float]],
    known: Mapping[str, float],
) -> list[dict[str, float]]:
    """Values to begin from: those of the files, and of several couplings if no file has one."""
    begins = []
    for base in of_files or [{}]:
        for beta in [base["beta"]] if "beta" in base else _betas(sheet):
            values = _stated(sheet, beta) | {**base, **known}
            if "mass" not in known and "psi" in names and "psi" not in base:
                values["psi"] = _psi(sheet, values)
            begins.append({name: values[name] for name in names})
    return begins


def _betas(sheet: DataSheet) -> list[float]:
    """Couplings theta^2/(K C): that of two resonances, and usual ones."""
    short = sheet.value("frequency")
    opened = sheet.value(RESONANCE)
    pair = [(opened / short) ** 2 - 1.0] if short and opened else []
    return [*pair, *BETAS]


def _stated(sheet: DataSheet, beta: float) -> dict[str, float]:
    """The parameters that the datasheet states, for a coupling; psi is 1 V/m."""
    values = {"beta": beta, "psi": 1.0, "quality": sheet.value("q") or sheet.prior.value}
    if capacitance := sheet.value("capacitance"):
        values["capacitance"] = capacitance
    opened = sheet.value(RESONANCE) or 0.0
    values["frequency"] = sheet.value("frequency") or opened / math.sqrt(1.0 + beta)
    return values


def _psi(sheet: DataSheet, values: dict[str, float]) -> float:
    """The voltage per metre of the first point, by which voltages are scaled."""
    point = next(iter(sheet.points.values()), None)
    if point is None:
        return USUAL_PSI
    ratio = point.value / point.of(linear_device(values))
    return ratio if point.name == OPEN else math.sqrt(ratio)
