"""The prediction of a real device: interval, computation error, next measurement."""

from typing import ClassVar

from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.result import Result
from harvester.presentation.table import Column, Table
from harvester.uncertainty.value import Value, amount


class RealDevice(Result):
    """A number of a real device: ``median``, and the ends of the 95 % interval, in ``unit``."""

    median: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        median, low, high = (amount(x, self.unit) for x in (self.median, self.low, self.high))
        return f"{median} ({low} to {high})"

    @property
    def ratio(self) -> float | None:
        """The width of the interval: the high end over the low end; None if the low end is 0."""
        return self.high / self.low if self.low > 0.0 else None


class UncertainQuantity(Result):
    """A quantity of a device that the interval rests on.

    ``origin`` is the origin of its number, ``sigma`` the standard deviation of its logarithm
    (None: a uniform range), and ``width_after`` the ratio of the ends of the power's interval
    after the quantity was measured at the level of use; None if a measurement narrows nothing,
    if the low end is 0, or if with points too few devices are left to state it.
    After single points of a datasheet ``factor`` is the median of the quantity over its number in
    the scene, and ``sigma_left`` the standard deviation of its logarithm; None without points.
    """

    quantity: str
    key: str
    origin: str
    sigma: float | None
    width_after: float | None
    source: str
    factor: float | None = None
    sigma_left: float | None = None


class Prediction(Result):
    """The power of a real device, and the error of the computation: two numbers, never one.

    Attributes
    ----------
    engine : str
        the name of the engine that computed the devices.
    prior : str
        the class of the device, by which its priors were chosen.
    computed : Value
        the mean power of the scene as it is written, a `Value` (W) with the error of the
        computation alone.
    power, voltage : RealDevice
        of a real device: ``median``, ``low`` and ``high`` ends of the 95 % interval (W, V rms).
    quantities : tuple of UncertainQuantity
        the quantities that scatter, that whose measurement narrows the interval most first.
    impedance_curve : float or None
        the ratio of the ends of the power's interval after an impedance curve at a low level, by
        which frequency, damping, coupling and capacitance are known; None if it narrows nothing.
    model_sigma : float
        the standard deviation of the logarithm of the power for the model error.
    model_factor : float
        the median of real over computed power: below 1 with a stop.
    samples : int
        the number of devices.
    seconds : float
        the time of computing, without compilation (s).
    physical : bool
        whether its numbers are in SI units: always.
    diagnostics : tuple of Diagnostic
        warnings and notes, each with a code, numbers and a sentence (``str``).

    Examples
    --------
    >>> import harvester as hv
    >>> result = hv.predict("examples/plate_harmonic.toml", samples=256)
    >>> result.power.low < result.power.median < result.power.high
    True
    """

    DERIVED = ("real_device", "next_measurement", "measurements")
    INTERNAL = frozenset({"quantities"})
    NOT_SHOWN = frozenset(
        {
            "power",
            "voltage",
            "impedance_curve",
            "model_sigma",
            "model_factor",
            "samples",
            "quantities",
        }
    )
    NOT_IN_JSON = frozenset({"real_device"})
    SHORT: ClassVar[tuple[str, ...]] = ("engine", "prior", "computed", "next_measurement")

    engine: str
    prior: str
    computed: Value
    power: RealDevice
    voltage: RealDevice
    quantities: tuple[UncertainQuantity, ...]
    impedance_curve: float | None
    model_sigma: float
    model_factor: float
    samples: int
    physical: bool
    seconds: float
    diagnostics: tuple[Diagnostic, ...] = ()

    @property
    def next_measurement(self) -> str:
        """The quantity whose measurement narrows the power's interval most; empty if none does."""
        known = [entry for entry in self.quantities if entry.width_after is not None]
        return min(known, key=lambda entry: entry.width_after or 0.0).quantity if known else ""

    @property
    def real_device(self) -> Table:
        """Median and 95 % limits of a real device's power and voltage."""
        rows = (self.power, self.voltage)
        units = [self.unit_names.power, "V"]
        columns = (
            Column("quantity", ["mean power", "RMS voltage"]),
            Column("median", [row.median for row in rows], units=units, label="median"),
            Column("low", [row.low for row in rows], units=units, label="from"),
            Column("high", [row.high for row in rows], units=units, label="to"),
            Column("width", [row.ratio for row in rows], label="high/low"),
        )
        return Table(columns, "a real device: 95 % of devices are in the interval")

    @property
    def measurements(self) -> Table:
        """The quantities, their origins, and the power's interval after a measurement."""
        some = self.quantities
        sigmas = [None if entry.sigma is None else 100.0 * entry.sigma for entry in some]
        names = [entry.quantity for entry in some]
        origins = [entry.origin for entry in some]
        widths = [entry.width_after for entry in some]
        if self.impedance_curve is not None:
            names.append("impedance curve")
            origins.append("")
            sigmas.append(None)
            widths.append(self.impedance_curve)
        columns: tuple[Column, ...] = (
            Column("quantity", names),
            Column("origin", origins, label="known from"),
            Column("sigma", sigmas, "%", label="standard deviation"),
            Column("width_after", widths, label="high/low if measured"),
        )
        if any(entry.factor is not None for entry in some):
            more = len(names) - len(some)
            left = [None if row.sigma_left is None else 100.0 * row.sigma_left for row in some]
            columns += (
                Column("factor", [*(row.factor for row in some), *[None] * more], label="factor"),
                Column("sigma_left", [*left, *[None] * more], "%", label="after the points"),
            )
        return Table(columns, "spread of each quantity, and the power's interval if it is measured")
