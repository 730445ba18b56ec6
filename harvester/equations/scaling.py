"""SI <-> nondimensional, both ways (paper, the transformations before Eq. 2).

    t = w0 T    x = X/l    V = Cp v/(theta l)       w0 = sqrt(k/M), k = |stiffness|
    alpha = l^2 k3/k    alpha2 = l k2/k    stops: gap/l, k_s/k and c_s/(M w0)
    c1 = b1/(M w0)    c2 = b2 l^2/(M w0)    c3 = b3 l^4/(M w0)
    beta = theta^2/(k Cp)    mu = 1/(R Cp w0)    v^2/R = (M w0^3 l^2) beta mu V^2
    white base acceleration of one-sided density G:  N1 = G/(4 l^2 w0^3)
    other shaking: amplitude F = A/(l w0^2), frequencies 2 pi f/w0, correlation time w0 T; coloured noise as white;
    a recorded acceleration a of the base is -a/(l w0^2) of the mass relative to it

No physical result depends on the length l (a test).
"""

import math
from dataclasses import dataclass

from harvester.errors import InputError, invalid
from harvester.scene.load import Load
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.physical import Excitation, OppositeStop, Oscillator, Piezo, Stop
from harvester.scene.records import Record, TabulatedDensity, read_density, read_record
from harvester.scene.scene import Scene
from harvester.scene.units import LARGEST, SMALLEST

TURN = 2.0 * math.pi  # rad


@dataclass(frozen=True, kw_only=True)
class Equations:
    """The coefficients of Eq. 2; None is an effect that is absent.

    The spring is linear x + alpha2 x^2 + alpha x^3; ``linear`` None is 1.  The stop is at x = -gap (None: at rest,
    x = 0), rigid where ``restitution`` is given, compliant where ``stop_stiffness`` is; the opposite one is rigid,
    at x = opposite_gap.  n1 = eps1^2 D11, n2 = eps2^2 D22 and n12 = eps1 eps2 D12 are the noise intensities.
    beta None is a voltage without force on the mass, mu None an open circuit, restitution None
    no stop, and so on.

    Other shaking than white noise, one kind at most (`harvester.mechanics.kernels.shaking`): ``drive``
    cos(drive_frequency t); noise of low-frequency intensity ``coloured`` with a ``correlation_time``; or of intensity
    ``coloured`` at the frequency ``centre`` with the half-power ``bandwidth``; a ``record``, or records of a
    ``density``.
    """

    alpha: float | None = None
    beta: float | None = None
    mu: float | None = None
    c1: float | None = None
    c2: float | None = None
    c3: float | None = None
    restitution: float | None = None
    n1: float | None = None
    n2: float | None = None
    n12: float | None = None
    linear: float | None = None
    alpha2: float | None = None
    gap: float | None = None
    opposite_restitution: float | None = None
    opposite_gap: float | None = None
    stop_stiffness: float | None = None
    stop_damping: float | None = None
    drive: float | None = None
    drive_frequency: float | None = None
    coloured: float | None = None
    correlation_time: float | None = None
    centre: float | None = None
    bandwidth: float | None = None
    record: Record | None = None
    density: TabulatedDensity | None = None


@dataclass(frozen=True, kw_only=True)
class Scales:
    """The device that turns nondimensional numbers into SI: M (kg), w0 (rad/s), l (m), theta (N/V), Cp (F).

    Raises
    ------
    InputError
        for a device so far from any real one that its scales could over- or underflow.
    """

    mass: float
    frequency: float
    length: float
    coupling: float
    capacitance: float

    def __post_init__(self) -> None:
        # In this order: a power is taken only of what is already known to be of a sane size.
        _within("w0 = sqrt(stiffness/mass)", self.frequency)
        _within("length scale, from acceleration_psd, mass, stiffness and cubic_stiffness,", self.length)
        _within("voltage scale coupling l/capacitance", self.volts)
        _within("power scale mass w0^3 l^2", self.watts)

    @property
    def volts(self) -> float:
        """v/V = theta l/Cp, in volt."""
        return self.coupling * self.length / self.capacitance

    @property
    def watts(self) -> float:
        """(v^2/R) / (beta mu V^2) = M w0^3 l^2, in watt."""
        return self.mass * self.frequency**3 * self.length**2

    def resistance(self, mu: float) -> float:
        """Load resistance of a time-constant ratio, R = 1/(mu Cp w0), in ohm."""
        return 1.0 / (mu * self.capacitance * self.frequency)


# The device that carries a nondimensional scene into ngspice: the mass, frequency and capacitance
# of the plate of Shock and Vibration 2019, 9093605, Table 2, with its coupling set by beta.
DEFAULT_MASS, DEFAULT_FREQUENCY, DEFAULT_LENGTH = 0.04, 20.0, 1e-3
DEFAULT_COUPLING, DEFAULT_CAPACITANCE = 1e-3, 50.2e-9


def equations(scene: Scene, length: float | None = None) -> Equations:
    """The nondimensional coefficients of a scene; zero coefficients are absent effects.

    ``length`` is the l (m) of a physical scene (default `natural_length`); a nondimensional scene
    has none.

    Raises
    ------
    InputError
        where a coefficient or a scale is too large, or a scale too small, to compute with.
    """
    found = _of_device(scene, length) if scene.nondimensional is None else _of_table(scene.nondimensional)
    for name, value in vars(found).items():
        if isinstance(value, float) and not abs(value) <= LARGEST:
            source = _SOURCES[name] if scene.physical else "[nondimensional]"
            raise InputError(f"{source} must give {name} of at most {LARGEST:g} in size, but gives {value:g}")
    return found


_SOURCES = {
    "alpha": "oscillator.cubic_stiffness",
    "alpha2": "oscillator.quadratic_stiffness",
    "gap": "stop.gap",
    "opposite_gap": "opposite_stop.gap",
    "stop_stiffness": "stop.stiffness",
    "stop_damping": "stop.damping",
    "beta": "piezo.coupling",
    "mu": "load.resistance",
    "c1": "oscillator.damping",
    "c2": "oscillator.damping_x2",
    "c3": "oscillator.damping_x4",
    "n1": "excitation.acceleration_psd",
    "drive": "excitation.acceleration_amplitude",
    "drive_frequency": "excitation.frequency",
    "coloured": "excitation.acceleration_psd",
    "correlation_time": "excitation.correlation_time",
    "centre": "excitation.centre_frequency",
    "bandwidth": "excitation.bandwidth",
}


def _of_device(scene: Scene, length: float | None) -> Equations:
    oscillator, piezo = _device(scene)
    s = scales(scene, length)
    rate = s.mass * s.frequency  # M w0
    damping = oscillator.damping
    if oscillator.damping_ratio is not None:
        damping = 2.0 * oscillator.damping_ratio * rate
    stiffness = abs(oscillator.stiffness)
    stop, opposite = scene.stop or Stop(restitution=1.0), scene.opposite_stop
    excitation = scene.excitation or Excitation()
    noise = _scaled(excitation.acceleration_psd, 0.25 / (s.length**2 * s.frequency**3))
    resistance = scene.load.resistance if scene.load else None
    record, density = _recorded(excitation)
    return Equations(
        linear=-1.0 if oscillator.stiffness < 0.0 else None,
        alpha2=_scaled(oscillator.quadratic_stiffness, s.length / stiffness),
        alpha=_scaled(oscillator.cubic_stiffness, s.length**2 / stiffness),
        beta=piezo.coupling**2 / (stiffness * piezo.capacitance),
        mu=None if resistance is None else 1.0 / (resistance * piezo.capacitance * s.frequency),
        c1=_scaled(damping, -1.0 / rate),
        c2=_scaled(oscillator.damping_x2, -(s.length**2) / rate),
        c3=_scaled(oscillator.damping_x4, s.length**4 / rate),
        restitution=None if scene.stop is None else stop.restitution,
        gap=_scaled(stop.gap, 1.0 / s.length),
        opposite_restitution=None if opposite is None else opposite.restitution,
        opposite_gap=None if opposite is None else (opposite.gap or 0.0) / s.length,
        stop_stiffness=_scaled(stop.stiffness, 1.0 / stiffness),
        stop_damping=_scaled(stop.damping, 1.0 / rate),
        n1=None if excitation.filtered else noise,
        n2=excitation.stiffness_noise or None,
        drive=_scaled(excitation.acceleration_amplitude, 1.0 / (s.length * s.frequency**2)),
        drive_frequency=_scaled(excitation.frequency, TURN / s.frequency),
        coloured=noise if excitation.filtered else None,
        correlation_time=_scaled(excitation.correlation_time, s.frequency),
        centre=_scaled(excitation.centre_frequency, TURN / s.frequency),
        bandwidth=_scaled(excitation.bandwidth, TURN / s.frequency),
        record=None if record is None else record.scaled(s.frequency, -1.0 / (s.length * s.frequency**2)),
        density=None if density is None else density.scaled(s.frequency, 1.0 / (s.length * s.frequency**2)),
    )


def _recorded(excitation: Excitation) -> tuple[Record | None, TabulatedDensity | None]:
    """The base's acceleration in time, and its density, in SI units."""
    record, density = excitation.acceleration_file, excitation.acceleration_psd_file
    return (
        None if record is None else read_record(record),
        None if density is None else read_density(density),
    )


def scales(scene: Scene, length: float | None = None) -> Scales:
    """The scales of a scene; for a nondimensional one, those of the default device."""
    if scene.nondimensional is not None:
        beta = scene.nondimensional.beta
        stiffness = DEFAULT_MASS * DEFAULT_FREQUENCY**2
        coupling = math.sqrt(beta * stiffness * DEFAULT_CAPACITANCE) if beta else DEFAULT_COUPLING
        return Scales(
            mass=DEFAULT_MASS,
            frequency=DEFAULT_FREQUENCY,
            length=DEFAULT_LENGTH,
            coupling=coupling,
            capacitance=DEFAULT_CAPACITANCE,
        )
    oscillator, piezo = _device(scene)
    return Scales(
        mass=oscillator.mass,
        frequency=math.sqrt(abs(oscillator.stiffness) / oscillator.mass),
        length=natural_length(scene) if length is None else length,
        coupling=piezo.coupling,
        capacitance=piezo.capacitance,
    )


def natural_length(scene: Scene) -> float:
    """A length that makes the numbers of a physical scene of order one, in metre.

    With noise, l = sqrt(G/(4 w0^3)), so that N1 = 1; under a harmonic drive alone, l = A/w0^2, so that F = 1, and
    under a record with its RMS for A; without any, the length where the cubic force equals the linear one, or 1 mm.
    """
    oscillator, _ = _device(scene)
    stiffness = abs(oscillator.stiffness)
    excitation = scene.excitation or Excitation()
    if excitation.acceleration_psd:
        return 0.5 * math.sqrt(excitation.acceleration_psd) * math.pow(oscillator.mass / stiffness, 0.75)
    if excitation.acceleration_amplitude:
        return excitation.acceleration_amplitude * oscillator.mass / stiffness
    for recorded in _recorded(excitation):
        if recorded is not None:
            return recorded.rms * oscillator.mass / stiffness
    if oscillator.cubic_stiffness:
        return math.sqrt(stiffness / abs(oscillator.cubic_stiffness))
    return 1e-3


def physical(eqs: Equations, s: Scales, title: str = "") -> Scene:
    """The physical scene whose equations, at length ``s.length``, are ``eqs``: inverse of `equations`.

    ``s.coupling`` is used where beta is None; else theta = sqrt(beta k Cp).

    Raises
    ------
    InputError
        for correlated noise, and for a record, which no physical scene has.
    """
    if eqs.n12 is not None:
        raise invalid("n12", "be absent from a physical scene", eqs.n12)
    if eqs.record is not None or eqs.density is not None:
        raise invalid("record", "be absent, as only a file can hold it", "given")
    stiffness, rate = s.mass * s.frequency**2, s.mass * s.frequency
    oscillator = Oscillator(
        mass=s.mass,
        stiffness=stiffness * (eqs.linear or 1.0),
        quadratic_stiffness=_scaled(eqs.alpha2, stiffness / s.length),
        cubic_stiffness=_scaled(eqs.alpha, stiffness / s.length**2),
        damping=_scaled(eqs.c1, -rate),
        damping_x2=_scaled(eqs.c2, -rate / s.length**2),
        damping_x4=_scaled(eqs.c3, rate / s.length**4),
    )
    coupling = s.coupling if eqs.beta is None else math.sqrt(eqs.beta * stiffness * s.capacitance)
    noise = Excitation(
        acceleration_psd=_scaled(eqs.n1 or eqs.coloured, 4 * s.length**2 * s.frequency**3),
        stiffness_noise=eqs.n2,
        acceleration_amplitude=_scaled(eqs.drive, s.length * s.frequency**2),
        frequency=_scaled(eqs.drive_frequency, s.frequency / TURN),
        correlation_time=_scaled(eqs.correlation_time, 1.0 / s.frequency),
        centre_frequency=_scaled(eqs.centre, s.frequency / TURN),
        bandwidth=_scaled(eqs.bandwidth, s.frequency / TURN),
    )
    stop = opposite = None
    if eqs.restitution is not None or eqs.stop_stiffness is not None:
        stop = Stop(
            restitution=eqs.restitution,
            gap=_scaled(eqs.gap, s.length),
            stiffness=_scaled(eqs.stop_stiffness, stiffness),
            damping=_scaled(eqs.stop_damping, rate),
        )
    if eqs.opposite_restitution is not None:
        opposite = OppositeStop(restitution=eqs.opposite_restitution, gap=_scaled(eqs.opposite_gap, s.length))
    return Scene(
        title=title,
        oscillator=oscillator,
        piezo=Piezo(coupling=coupling, capacitance=s.capacitance),
        stop=stop,
        opposite_stop=opposite,
        excitation=noise if noise != Excitation() else None,
        load=None if eqs.mu is None else Load(resistance=s.resistance(eqs.mu)),
    )


def effects(eqs: Equations) -> tuple[str, ...]:
    """Names of the effects present, in the order of the equations; nothing else is computed."""
    names = {
        "linear": "negative_stiffness",
        "alpha2": "quadratic_stiffness",
        "alpha": "softening_stiffness" if (eqs.alpha or 0.0) < 0.0 else "cubic_stiffness",
        "c1": "linear_damping",
        "c2": "damping_x2",
        "c3": "damping_x4",
        "restitution": "impact",
        "stop_stiffness": "compliant_stop",
        "gap": "gap",
        "opposite_restitution": "opposite_stop",
        "n1": "external_noise",
        "n2": "parametric_noise",
        "n12": "correlated_noise",
        "drive": "harmonic_drive",
        "coloured": "coloured_noise" if eqs.bandwidth is None else "band_pass_noise",
        "record": "recorded_acceleration",
        "density": "tabulated_noise",
        "beta": "back_coupling",
        "mu": "resistive_load",
    }
    return tuple(name for field, name in names.items() if getattr(eqs, field) is not None)


def _of_table(table: Nondimensional) -> Equations:
    eps1 = 1.0 if table.eps1 is None else table.eps1
    eps2 = 1.0 if table.eps2 is None else table.eps2
    noise = _scaled(table.D11, eps1**2)
    return Equations(
        linear=None if table.linear == 1.0 else table.linear,
        alpha2=table.alpha2 or None,
        alpha=table.alpha or None,
        beta=table.beta or None,
        mu=table.mu or None,
        c1=table.c1 or None,
        c2=table.c2 or None,
        c3=table.c3 or None,
        restitution=table.restitution,
        gap=table.gap or None,
        opposite_restitution=table.opposite_restitution,
        opposite_gap=None if table.opposite_restitution is None else table.opposite_gap or 0.0,
        stop_stiffness=table.stop_stiffness or None,
        stop_damping=table.stop_damping or None,
        n1=None if table.filtered else noise,
        n2=_scaled(table.D22, eps2**2),
        n12=_scaled(table.D12, eps1 * eps2),
        drive=table.drive or None,
        drive_frequency=table.drive_frequency if table.drive else None,
        coloured=noise if table.filtered else None,
        correlation_time=table.correlation_time,
        centre=table.centre_frequency,
        bandwidth=table.bandwidth,
    )


def _scaled(value: float | None, factor: float) -> float | None:
    """Value * factor; an absent or zero coefficient stays absent."""
    return value * factor if value is not None and value * factor != 0.0 else None


def _within(what: str, value: float) -> None:
    if not SMALLEST <= value <= LARGEST:
        raise InputError(f"the {what} must be between {SMALLEST:g} and {LARGEST:g} in SI units, but is {value:g}")


def _device(scene: Scene) -> tuple[Oscillator, Piezo]:
    assert scene.oscillator is not None and scene.piezo is not None, "Scene checks this"
    return scene.oscillator, scene.piezo
