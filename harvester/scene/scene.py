"""What the user asks: one device, its shaking, its load.  Frozen dataclasses; TOML in and out.

Numbers are SI; strings carry their unit.  A table or a key that is left out is an effect that is
absent.  pydantic does the reading and the checking; every error becomes one `InputError` line.
"""

import dataclasses
import difflib
import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import pydantic
from pydantic import BeforeValidator, ConfigDict, ModelWrapValidatorHandler, model_validator
from pydantic.dataclasses import dataclass as checked_dataclass

from harvester.errors import InputError, invalid, shown, unknown
from harvester.scene.units import Kind, any_quantity, with_prefix

NUMBER = Kind("a number", "", "0.05")
POSITIVE = Kind("a number", "", "0.05", least=0.0)
FILES = ("acceleration_file", "acceleration_psd_file")
MOST_BYTES = 16384  # of a scene file; a scene takes less than a thousand


def _field(name: str, unit: str, example: str, **limits: Any) -> tuple[Kind, BeforeValidator]:
    kind = Kind(name, unit, example, **limits)
    return kind, BeforeValidator(kind.read)


_MASS = _field("a mass (kg)", "kg", "'40 g'", above=0.0)
_STIFFNESS = _field("a stiffness (N/m)", "N/m", "'16 N/m'")
_STOP_STIFFNESS = _field("a stiffness (N/m)", "N/m", "'1e5 N/m'", above=0.0)
_QUADRATIC = _field("a quadratic stiffness (N/m^2)", "N/m^2", "1e3")
_CUBIC = _field("a cubic stiffness (N/m^3)", "N/m^3", "1e5")
_DAMPING = _field("a damping coefficient (N s/m)", "N s/m", "'6.4e-3 N s/m'")
_STOP_DAMPING = _field("a damping coefficient (N s/m)", "N s/m", "'1 N s/m'", least=0.0)
_GAP = _field("a distance from rest (m)", "m", "'0.5 mm'")
_DAMPING_X2 = _field("a damping coefficient of X^2 (N s/m^3)", "N s/m^3", "10.0")
_DAMPING_X4 = _field("a damping coefficient of X^4 (N s/m^5)", "N s/m^5", "1e6")
_NUMBER = (NUMBER, BeforeValidator(NUMBER.read))
_POSITIVE = (POSITIVE, BeforeValidator(POSITIVE.read))
_COUPLING = _field("an electromechanical coupling (N/V)", "N/V", "1e-3", above=0.0)
_CAPACITANCE = _field("a clamped capacitance (F)", "F", "'50.2 nF'", above=0.0)
_RESTITUTION = _field("a restitution coefficient", "", "0.96", least=0.0, most=1.0)
_PSD = _field(
    "a one-sided acceleration density ((m/s^2)^2/Hz)", "(m/s^2)^2/Hz", "'0.01 g^2/Hz'", least=0.0, gravity=True
)
_ACCELERATION = _field("an acceleration (m/s^2)", "m/s^2", "'0.1 g'", least=0.0, gravity=True)
_FREQUENCY = _field("a frequency (Hz)", "Hz", "'3.2 Hz'", above=0.0)
_TIME = _field("a time (s)", "s", "'50 ms'", above=0.0)
_ABOVE = _field("a number", "", "1.5", above=0.0)
_RESISTANCE = _field("a load resistance (ohm)", "ohm", "'1 Mohm'", above=0.0)


class _Table:
    """What all tables of a scene share: one-line errors that name the table and the key."""

    TABLE: ClassVar[str] = ""

    @model_validator(mode="wrap")
    @classmethod
    def _one_line(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except pydantic.ValidationError as error:
            raise _in_one_line(error, cls) from None


_FORBID = ConfigDict(extra="forbid")


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Oscillator(_Table):
    """M X'' + (damping + damping_x2 X^2 + damping_x4 X^4) X' + spring = ...

    spring = stiffness X + quadratic_stiffness X^2 + cubic_stiffness X^3: a negative stiffness makes two wells, a
    negative cubic_stiffness a spring that softens.  SI units.  The paper's b1 = -damping, b2 = -damping_x2,
    b3 = damping_x4; damping_ratio is damping / (2 sqrt(|stiffness| mass)).

    >>> import harvester as hv
    >>> hv.Oscillator(mass="40 g", stiffness="16 N/m", damping_ratio=0.004).mass
    0.04
    """

    TABLE: ClassVar[str] = "oscillator"
    mass: Annotated[float, *_MASS, "effective (modal) mass"]
    stiffness: Annotated[float, *_STIFFNESS, "linear spring, in short circuit; negative: two wells"]
    quadratic_stiffness: Annotated[float, *_QUADRATIC, "force of X^2"] | None = None
    cubic_stiffness: Annotated[float, *_CUBIC, "force of X^3; negative: softening"] | None = None
    damping: Annotated[float, *_DAMPING, "linear damping"] | None = None
    damping_ratio: Annotated[float, *_NUMBER, "instead of damping: damping/(2 sqrt(|stiffness| mass))"] | None = None
    damping_x2: Annotated[float, *_DAMPING_X2, "damping of X^2 X'"] | None = None
    damping_x4: Annotated[float, *_DAMPING_X4, "damping of X^4 X'"] | None = None

    def __post_init__(self) -> None:
        if self.stiffness == 0.0:
            raise invalid("oscillator.stiffness", "be other than 0, for it sets the scale of time", self.stiffness)
        if self.damping is not None and self.damping_ratio is not None:
            raise InputError("oscillator.damping_ratio must be left out where damping is given, but both are given")


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Piezo(_Table):
    """Force theta v on the mass, charge theta X into the clamped capacitance (N/V, F).

    >>> import harvester as hv
    >>> hv.Piezo(coupling="1e-3 N/V", capacitance="50 nF").coupling
    0.001
    """

    TABLE: ClassVar[str] = "piezo"
    coupling: Annotated[float, *_COUPLING, "force a volt, which is charge a displacement"]
    capacitance: Annotated[float, *_CAPACITANCE, "clamped capacitance: with the mass held"]


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Stop(_Table):
    """A stop at X = -gap, motion on X > -gap; a negative gap presses the mass on it (preload).

    Rigid: X'+ = -restitution X'-.  Compliant, with ``stiffness`` instead: where X < -gap the force on the mass is
    -stiffness (X + gap) - damping X'; with less than the critical damping, or the mass would not come off.

    >>> import harvester as hv
    >>> hv.Stop(restitution=0.96, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "stop"
    restitution: Annotated[float, *_RESTITUTION, "rigid stop: speed after over speed before an impact"] | None = None
    gap: Annotated[float, *_GAP, "the stop is at X = -gap; 0 where left out, negative: pressed on the mass"] | None = (
        None
    )
    stiffness: Annotated[float, *_STOP_STIFFNESS, "compliant stop, instead of restitution: its stiffness"] | None = None
    damping: Annotated[float, *_STOP_DAMPING, "of a compliant stop"] | None = None

    def __post_init__(self) -> None:
        _rigid_or_compliant("stop", "", self.restitution, self.stiffness, self.damping)


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class OppositeStop(_Table):
    """A second rigid stop, at X = +gap, beside a rigid [stop]: X'+ = -restitution X'-.

    >>> import harvester as hv
    >>> hv.OppositeStop(restitution=0.9, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "opposite_stop"
    restitution: Annotated[float, *_RESTITUTION, "of a second rigid stop, at X = +gap"]
    gap: Annotated[float, *_GAP, "its distance from rest"] | None = None


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Excitation(_Table):
    """Acceleration of the base, and white noise on the stiffness (N2, a number).

    ``acceleration_psd`` is the one-sided density of white noise; with ``correlation_time`` T that at low frequencies of
    noise of density G/(1 + (2 pi f T)^2); with ``centre_frequency`` and ``bandwidth`` (between the half-power points)
    that at the centre of a resonator's band.  ``acceleration_amplitude`` and ``frequency`` are a harmonic motion, which
    white noise may go with; so it may with a record in time, ``acceleration_file``, or a table of the density,
    ``acceleration_psd_file`` (`harvester.scene.records`).

    >>> import harvester as hv
    >>> f'{hv.Excitation(acceleration_psd="1e-5 g^2/Hz").acceleration_psd:.4g} (m/s^2)^2/Hz'
    '0.0009617 (m/s^2)^2/Hz'
    """

    TABLE: ClassVar[str] = "excitation"
    acceleration_psd: Annotated[float, *_PSD, "white noise of the base, one-sided density"] | None = None
    stiffness_noise: Annotated[float, *_POSITIVE, "white noise on the stiffness, N2 = eps2^2 D22"] | None = None
    acceleration_amplitude: Annotated[float, *_ACCELERATION, "harmonic acceleration of the base, peak"] | None = None
    frequency: Annotated[float, *_FREQUENCY, "of the harmonic"] | None = None
    correlation_time: Annotated[float, *_TIME, "the noise is coloured (Ornstein and Uhlenbeck)"] | None = None
    centre_frequency: Annotated[float, *_FREQUENCY, "the noise has a band: its centre"] | None = None
    bandwidth: Annotated[float, *_FREQUENCY, "between the half-power points of that band"] | None = None
    acceleration_file: (
        Annotated[str, "recorded acceleration of the base, a CSV file with units", "'shake.csv'"] | None
    ) = None
    acceleration_psd_file: Annotated[str, "noise of a tabulated density, a CSV file", "'psd.csv'"] | None = None

    def __post_init__(self) -> None:
        _check_shaking(self, "acceleration_amplitude", "frequency", "acceleration_psd")

    @property
    def filtered(self) -> bool:
        """Whether the noise is coloured or of a band."""
        return self.correlation_time is not None or self.bandwidth is not None


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Load(_Table):
    """A load resistance in ohm, or a netlist (a name of netlists/ or a path) and its parameters.

    >>> import harvester as hv
    >>> hv.Load(resistance="1 Mohm").resistance
    1000000.0
    """

    TABLE: ClassVar[str] = "load"
    resistance: Annotated[float, *_RESISTANCE, "load resistor across the electrodes"] | None = None
    netlist: Annotated[str, "instead of resistance: a circuit of netlists/, or a path", "'bridge'"] | None = None
    parameters: Annotated[
        dict[str, Annotated[float, BeforeValidator(any_quantity)]], "of the netlist", "{ R = '1 Mohm' }"
    ] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        if (self.resistance is None) == (self.netlist is None):
            given = "neither is" if self.resistance is None else "both are"
            raise InputError(f"load must have either resistance or netlist, but {given} given")
        if self.netlist is not None and not (self.netlist.strip() and self.netlist.isprintable()):
            raise invalid("load.netlist", "be the name of a netlist or a path", self.netlist)
        if self.parameters and self.netlist is None:
            raise InputError("load.parameters must go with a netlist, but the load is a resistance")


def Netlist(name: str, /, **parameters: float | str) -> Load:  # noqa: N802, as it reads as one of the tables
    """The load of a netlist, by its name in netlists/ or its path, with its parameters (numbers are SI).

    >>> import harvester as hv
    >>> hv.Netlist("bridge", R="1 Mohm", C=1e-5).parameters
    {'R': 1000000.0, 'C': 1e-05}

    Raises
    ------
    InputError
        for a parameter that is no number and no quantity.
    """
    given: Any = parameters  # read by `Load`
    return Load(netlist=name, parameters=given)


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Nondimensional(_Table):
    """The paper's parameters (Eq. 2), every one optional; N1 = eps1^2 D11, N2 = eps2^2 D22.

    eps1 and eps2 are 1 where only their D is given; an eps without its D is refused.  Ours: the spring is
    linear x + alpha2 x^2 + alpha x^3 with linear = 1 or -1, the stops are those of `Stop` (stop_stiffness and
    stop_damping instead of restitution) and `OppositeStop`, drive cos(drive_frequency t) is a harmonic acceleration;
    correlation_time, or centre_frequency and bandwidth (rad), filter the external noise as in `Excitation`.

    >>> import harvester as hv
    >>> hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01).beta
    0.05
    """

    TABLE: ClassVar[str] = "nondimensional"
    c1: Annotated[float, *_NUMBER, "linear damping is -c1"] | None = None
    c2: Annotated[float, *_NUMBER, "damping of x^2 is -c2"] | None = None
    c3: Annotated[float, *_NUMBER, "damping of x^4"] | None = None
    alpha: Annotated[float, *_NUMBER, "cubic stiffness"] | None = None
    alpha2: Annotated[float, *_NUMBER, "quadratic stiffness"] | None = None
    linear: Annotated[float, *_NUMBER, "1, or -1 for two wells"] | None = None
    beta: Annotated[float, *_POSITIVE, "coupling, theta^2/(K Cp)"] | None = None
    mu: Annotated[float, *_POSITIVE, "load, 1/(R Cp w0)"] | None = None
    restitution: Annotated[float, *_RESTITUTION, "rigid stop"] | None = None
    gap: Annotated[float, *_NUMBER, "the stop is at x = -gap"] | None = None
    opposite_restitution: Annotated[float, *_RESTITUTION, "of a second rigid stop, at x = +opposite_gap"] | None = None
    opposite_gap: Annotated[float, *_NUMBER, "its distance from rest"] | None = None
    stop_stiffness: Annotated[float, *_POSITIVE, "compliant stop, instead of restitution"] | None = None
    stop_damping: Annotated[float, *_POSITIVE, "of a compliant stop"] | None = None
    eps1: Annotated[float, *_NUMBER, "size of the external noise; 1 where left out"] | None = None
    eps2: Annotated[float, *_NUMBER, "size of the parametric noise; 1 where left out"] | None = None
    D11: Annotated[float, *_POSITIVE, "intensity of the external noise"] | None = None
    D22: Annotated[float, *_POSITIVE, "intensity of the parametric noise"] | None = None
    D12: Annotated[float, *_NUMBER, "correlation of the two"] | None = None
    drive: Annotated[float, *_POSITIVE, "amplitude of a harmonic acceleration"] | None = None
    drive_frequency: Annotated[float, *_ABOVE, "its frequency over w0 (rad)"] | None = None
    correlation_time: Annotated[float, *_ABOVE, "the external noise is coloured"] | None = None
    centre_frequency: Annotated[float, *_ABOVE, "the external noise has a band: its centre (rad)"] | None = None
    bandwidth: Annotated[float, *_ABOVE, "between the half-power points of that band (rad)"] | None = None

    def __post_init__(self) -> None:
        _check_shaking(self, "drive", "drive_frequency", "D11")
        if self.D12 and self.filtered:
            raise InputError("nondimensional.D12 must be left out where the noise is filtered, but both are given")
        for eps, density in (("eps1", "D11"), ("eps2", "D22")):
            if getattr(self, eps) and getattr(self, density) is None:
                raise InputError(f"nondimensional.{density} must be given with {eps}, but is left out")
        if self.linear is not None and abs(self.linear) != 1.0:
            raise invalid("nondimensional.linear", "be 1 or -1", self.linear)
        self._check_stops()
        bound = ((self.D11 or 0.0) * (self.D22 or 0.0)) ** 0.5
        if abs(self.D12 or 0.0) > bound * (1 + 1e-12):
            raise invalid("nondimensional.D12", f"be at most sqrt(D11 D22) = {bound:g} in size", self.D12)

    @property
    def filtered(self) -> bool:
        """Whether the external noise is coloured or of a band."""
        return self.correlation_time is not None or self.bandwidth is not None

    def _check_stops(self) -> None:
        stop = self.restitution is not None or bool(self.stop_stiffness)
        for key, whole in (("gap", stop), ("opposite_gap", self.opposite_restitution is not None)):
            if getattr(self, key) is not None and not whole:
                raise InputError(f"nondimensional.{key} must go with a stop, but there is none: give its restitution")
        if stop or self.stop_damping is not None:
            _rigid_or_compliant("nondimensional", "stop_", self.restitution, self.stop_stiffness, self.stop_damping)
            _check_contact("nondimensional.stop_damping", self.stop_damping, self.stop_stiffness, 1.0)
        if self.opposite_restitution is not None:
            _check_room("nondimensional.opposite_", self.restitution is not None, self.gap, self.opposite_gap)


TABLES: dict[str, type[_Table]] = {
    table.TABLE: table for table in (Oscillator, Piezo, Stop, OppositeStop, Excitation, Load, Nondimensional)
}


@checked_dataclass(frozen=True, kw_only=True, config=_FORBID)
class Scene(_Table):
    """One device: physical (oscillator, piezo, ...) or nondimensional, never both.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> scene.physical, scene.vary("nondimensional.mu", 2.0).nondimensional.mu
    (False, 2.0)

    Raises
    ------
    InputError
        on the first thing that is wrong, in one line.
    """

    title: str = ""
    oscillator: Oscillator | None = None
    piezo: Piezo | None = None
    stop: Stop | None = None
    opposite_stop: OppositeStop | None = None
    excitation: Excitation | None = None
    load: Load | None = None
    nondimensional: Nondimensional | None = None

    def __post_init__(self) -> None:
        physical = [name for name in TABLES if name != "nondimensional" and getattr(self, name)]
        if self.nondimensional is not None and physical:
            raise InputError(f"[{physical[0]}] must be left out where [nondimensional] is given, but both are given")
        if self.nondimensional is None:
            for name in ("oscillator", "piezo"):
                if name not in physical:
                    raise InputError(f"[{name}] must be given (or [nondimensional] alone), but the table is missing")
            stop, opposite = self.stop or Stop(restitution=1.0), self.opposite_stop
            if self.oscillator is not None:
                _check_contact("stop.damping", stop.damping, stop.stiffness, self.oscillator.mass)
            if opposite is not None:
                rigid = self.stop is not None and self.stop.restitution is not None
                _check_room("opposite_stop.", rigid, stop.gap, opposite.gap)

    @property
    def physical(self) -> bool:
        """Whether the scene is in SI units (else nondimensional)."""
        return self.nondimensional is None

    def with_load(self, load: Load | float) -> "Scene":
        """The same scene with another load: a `Load`, or a resistance in ohm."""
        return dataclasses.replace(self, load=load if isinstance(load, Load) else Load(resistance=load))

    def without_stop(self) -> "Scene":
        """The same scene without its stops."""
        if self.nondimensional is not None:
            keys = ("restitution", "gap", "opposite_restitution", "opposite_gap", "stop_stiffness", "stop_damping")
            bare = dataclasses.replace(self.nondimensional, **dict.fromkeys(keys))
            return dataclasses.replace(self, nondimensional=bare)
        return dataclasses.replace(self, stop=None, opposite_stop=None)

    def vary(self, key: str, value: float) -> "Scene":
        """The same scene with ``key``, such as ``load.resistance``, set to ``value`` (SI); raises as `varied`."""
        return self.varied({key: value})

    def varied(self, values: Mapping[str, float]) -> "Scene":
        """The same scene with several keys set at once: what is checked is the scene with all of them.

        Raises
        ------
        InputError
            for a key that no scene has, or a value that the key cannot take.
        """
        changes: dict[str, dict[str, Any]] = {}
        for key, value in values.items():
            table, name = split_key(key)
            changed = changes.setdefault(table, {})
            if name.startswith("parameters."):
                given = changed.setdefault("parameters", dict(self.load.parameters) if self.load else {})
                given[name.split(".", 1)[1]] = value
            else:
                changed[name] = value
        tables: dict[str, Any] = {}
        for table, changed in changes.items():
            present = getattr(self, table)
            tables[table] = dataclasses.replace(present, **changed) if present else TABLES[table](**changed)
        return dataclasses.replace(self, **tables)

    def tables(self) -> dict[str, Any]:
        """The scene as nested dictionaries of the keys that are present."""
        given: dict[str, Any] = {"title": self.title} if self.title else {}
        for name in TABLES:
            table = getattr(self, name)
            if table is not None:  # an empty table is one too
                given[name] = {k: v for k, v in dataclasses.asdict(table).items() if v is not None and v != {}}
        return given

    def to_toml(self) -> str:
        """The scene file of this scene: `loads` gives the same scene back."""
        import tomli_w

        return tomli_w.dumps(self.tables())

    def _repr_html_(self) -> str:
        from harvester.printing import notebook

        rows = [
            (f"[{table}]", key, str(value), "" if key in ("netlist", *FILES) else _unit(f"{table}.{key}"))
            for table, keys in self.tables().items()
            if isinstance(keys, dict)
            for key, value in keys.items()
        ]
        return notebook.table(self.title or "scene", ("table", "key", "value", "SI unit"), rows)

    @property
    def digest(self) -> str:
        """A short hash of all that the scene says, the contents of its records included."""
        whole = hashlib.sha256(self.to_toml().encode())
        for key in FILES:
            if (name := getattr(self.excitation, key, None)) is not None:
                path = Path(name)
                whole.update(path.read_bytes() if path.is_file() else b"")
        return whole.hexdigest()[:16]


def _check_shaking(table: "Excitation | Nondimensional", amplitude: str, frequency: str, noise: str) -> None:
    """Keys that go together are given together, and the mass is shaken in one way beside white noise at most."""
    pairs = [(amplitude, frequency), (frequency, amplitude), ("centre_frequency", "bandwidth")]
    pairs += [("bandwidth", "centre_frequency"), ("correlation_time", noise), ("bandwidth", noise)]
    for key, other in pairs:
        if getattr(table, key) is not None and getattr(table, other) is None:
            raise InputError(f"{table.TABLE}.{other} must be given with {key}, but is left out")
    names = (amplitude, "correlation_time", "centre_frequency", "acceleration_file", "acceleration_psd_file")
    kinds = [key for key in names if getattr(table, key, None) is not None]
    if len(kinds) > 1:
        raise InputError(f"{table.TABLE}.{kinds[1]} must be left out where {kinds[0]} is given, but both are given")


def _rigid_or_compliant(
    table: str, prefix: str, restitution: float | None, stiffness: float | None, damping: float | None
) -> None:
    """A stop has a restitution coefficient, or a stiffness and maybe a damping."""
    soft = f"{table}.{prefix}stiffness"
    if restitution is not None and stiffness:
        raise InputError(f"{soft} must be left out where {table}.restitution is given, but both are given")
    if not stiffness and damping:
        raise InputError(f"{soft} must be given with {table}.{prefix}damping, but is left out")
    if restitution is None and not stiffness:
        raise InputError(f"{table}.restitution must be given, but is missing (or {soft}, for a compliant stop)")


def _check_contact(key: str, damping: float | None, stiffness: float | None, mass: float) -> None:
    """Less than critical damping: with more the mass would not come off the stop by itself."""
    if damping and stiffness and damping >= (critical := 2.0 * (stiffness * mass) ** 0.5):
        raise invalid(key, f"be below the critical damping of the contact, {critical:.6g}", damping)


def _check_room(where: str, rigid: bool, gap: float | None, opposite_gap: float | None) -> None:
    """An opposite stop has a rigid stop opposite, and room between them."""
    if not rigid:
        raise InputError(f"{where}restitution must go with a rigid stop, but there is none: turn the axis round")
    least, given = 0.0 - (gap or 0.0), opposite_gap or 0.0
    if not given > least:
        raise invalid(f"{where}gap", f"be above {least:g}, so that the stops leave room", given)


def split_key(key: str) -> tuple[str, str]:
    """("load", "resistance") for "load.resistance"; InputError with the nearest match otherwise."""
    table, _, name = key.partition(".")
    if table not in TABLES:
        raise unknown("scene table", table, TABLES)
    fields = [field.replace("parameters", "parameters.R") for field in _fields(TABLES[table])]
    if name not in fields and not key.startswith("load.parameters."):
        raise unknown(f"[{table}] key", name, fields)
    return table, name


def _unit(key: str) -> str:
    table, name = split_key(key) if "parameters" not in key else ("", "")
    return next((kind.unit for kind in _kinds(TABLES[table])[name]), "") if table else ""


def read_value(key: str, text: str) -> float:
    """A value of a scene key as the command line writes it ("1k", "1 Mohm"), in SI units.

    Raises InputError for an unknown key or a value that the key cannot take.
    """
    _, name = split_key(key)
    try:
        if name.startswith("parameters."):
            return any_quantity(text)
        return with_prefix(text, kind_of(key))
    except ValueError as error:
        raise InputError(f"{key} {error}, but is {shown(text)}") from None


def kind_of(key: str) -> Kind:
    """The quantity that a scene key is; InputError for a key that no scene has, or that is no number."""
    table, name = split_key(key)
    kind = next((k for k in _kinds(TABLES[table]).get(name, [])), None)
    if kind is None:
        raise InputError(f"{key} must be a key with a number to be varied")
    return kind


def unit_of(key: str) -> str:
    """The SI unit of a scene key, "1" where it is a number; "" for a netlist's parameter, whose unit is not known."""
    table, name = split_key(key)
    if name.startswith("parameters."):
        return ""
    return next((kind.unit for kind in _kinds(TABLES[table])[name]), "") or "1"


def loads(text: str, folder: Path | None = None) -> Scene:
    """A scene from the text of a scene file; relative paths of its netlist and records start at ``folder``.

    >>> import harvester as hv
    >>> hv.loads("nondimensional = { beta = 0.05 }").nondimensional.beta
    0.05
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # no TOML; a number too long for Python; nested too deep
        raise InputError(f"scene must be TOML, but {str(error).splitlines()[0]}") from None
    load: Any = tables.get("load")
    netlist: Any = load.get("netlist") if isinstance(load, dict) else None
    if folder is not None and isinstance(netlist, str) and ("/" in netlist or netlist.endswith(".cir")):
        tables["load"] = {**load, "netlist": str((folder / netlist).absolute())}
    excitation: Any = tables.get("excitation")
    if folder is not None and isinstance(excitation, dict):
        tables["excitation"] = {**excitation, **_beside(excitation, folder)}
    return Scene(**tables)


def _beside(excitation: dict[str, Any], folder: Path) -> dict[str, str]:
    """The paths of an excitation's files, which must be in the scene's folder."""
    found = {}
    for key in FILES:
        if isinstance(name := excitation.get(key), str):
            path = (folder / name).resolve()
            if not path.is_relative_to(folder.resolve()):
                raise invalid(f"excitation.{key}", "be in the folder of the scene file", name)
            found[key] = str(path)
    return found


def load(path: str | Path) -> Scene:
    """A scene from a scene file.

    >>> import harvester as hv
    >>> hv.load("nowhere/plate.toml")
    Traceback (most recent call last):
    harvester.errors.InputError: scene must be a file, but there is no 'nowhere/plate.toml': ...

    Raises
    ------
    InputError
        where the file cannot be read, is no TOML, or says something that no scene can have.
    """
    given, path = str(path), Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        beside = {p.stem: p.name for p in path.parent.glob("*.toml")}
        near = difflib.get_close_matches(path.stem, beside, n=1)
        hint = f": did you mean {beside[near[0]]!r}?" if near else ": 'harvester new FILE.toml' makes one"
        raise InputError(f"scene must be a file, but there is no {shown(given)}{hint}") from None
    except OSError as error:
        raise InputError(f"scene must be a readable file, but {shown(given)} is not: {error.strerror}") from None
    if len(data) > MOST_BYTES:
        raise InputError(f"scene must be a file of at most {MOST_BYTES} bytes, but {shown(given)} is longer")
    try:
        return loads(data.decode(), path.parent)
    except UnicodeDecodeError:
        raise InputError(f"scene must be UTF-8 text, but {shown(given)} is not") from None


def _fields(table: type) -> list[str]:
    return [field.name for field in dataclasses.fields(table)]


def metadata(table: type, name: str) -> list[Any]:
    """What the annotation of a key holds: its `Kind`, and in words what it is and an example."""
    annotation = table.__annotations__[name]
    return [
        note
        for part in (*getattr(annotation, "__args__", ()), annotation)
        for note in getattr(part, "__metadata__", ())
    ]


def _kinds(table: type) -> dict[str, list[Kind]]:
    """The physical quantity of each key, out of the annotations."""
    return {name: [note for note in metadata(table, name) if isinstance(note, Kind)] for name in table.__annotations__}


def _in_one_line(error: pydantic.ValidationError, table: type[_Table]) -> InputError:
    """The first complaint of pydantic in the words of this package; a misspelt key comes first."""
    first = min(error.errors(include_url=False), key=lambda e: e["type"] != "unexpected_keyword_argument")
    where = [part for part in (table.TABLE, *map(str, first["loc"])) if part]
    key = ".".join(where)
    match first["type"]:
        case "missing":
            return InputError(f"{key} must be given, but is missing")
        case "unexpected_keyword_argument":
            kind = f"[{table.TABLE}] key" if table.TABLE else "scene table"
            return unknown(kind, where[-1], _fields(table))
        case "value_error":
            return InputError(f"{key} {first['ctx']['error']}, but is {shown(first['input'])}")
        case "string_type":
            return invalid(key, "be a text", first["input"])
        case _:
            return invalid(key, "be a table of keys", first["input"])
