"""SI <-> nondimensional, both ways (paper, the transformations before Eq. 2).

    t = w0 T    x = X/l    V = Cp v/(theta l)       w0 = sqrt(k/M), k = |stiffness|
    alpha = l^2 k3/k    alpha2 = l k2/k    softening = l ka/k
    inertia = l^2 m2/M    gamma = l^2 theta2/theta    stops: gap/l, k_s/k and c_s/(M w0)
    c1 = b1/(M w0)    c2 = b2 l^2/(M w0)    c3 = b3 l^4/(M w0)    cv = b_v l/M
    beta = theta^2/(k Cp)    mu = 1/(R Cp w0) + loss_tangent    v^2/R = (M w0^3 l^2) beta mu V^2
    white base acceleration of one-sided density G:  N1 = G/(4 l^2 w0^3)
    other excitation: amplitude F = A/(l w0^2), frequencies 2 pi f/w0, correlation time w0 T;
    coloured noise as white; a recorded acceleration a of the base is -a/(l w0^2) of the mass
    relative to it

No physical result depends on the length l (a test).
"""

import math
from collections.abc import Callable
from typing import Any

from harvester.equations.coefficients import Equations
from harvester.equations.modes import further_modes
from harvester.equations.repeated_shaking import recorded_shaking
from harvester.equations.scales import Scales
from harvester.errors import InputError
from harvester.quantities.units import LARGEST
from harvester.scene.nondimensional import Nondimensional
from harvester.scene.physical import Excitation
from harvester.scene.scene import Scene

TURN = 2.0 * math.pi  # rad


def equations_at(scene: Scene, s: Scales) -> Equations:
    """The nondimensional coefficients of a scene at given scales.

    Zero coefficients are absent effects.

    InputError if a coefficient is too large to compute with.  A nondimensional scene does not need
    the scales.
    """
    eqs = (
        _from_device(scene, s)
        if scene.nondimensional is None
        else _from_table(scene.nondimensional)
    )
    for name, value in vars(eqs).items():
        if isinstance(value, float) and not abs(value) <= LARGEST:
            source = SOURCES[name] if scene.nondimensional is None else "[nondimensional]"
            raise InputError(
                f"{source} must give {name} of at most {LARGEST:g} in size, but gives {value:g}"
            )
    return eqs


# The coefficients that are a key of a physical scene times a factor of its scales and its stiffness
# k = |stiffness|.
_SCALED: dict[str, tuple[str, Callable[[Scales, float], float]]] = {
    "alpha2": ("oscillator.quadratic_stiffness", lambda s, k: s.length / k),
    "alpha": ("oscillator.cubic_stiffness", lambda s, k: s.length**2 / k),
    "softening": ("oscillator.ceramic_softening", lambda s, k: s.length / k),
    "inertia": ("oscillator.inertia_x2", lambda s, k: s.length**2 / s.mass),
    "gamma": ("piezo.coupling_x2", lambda s, k: s.length**2 / s.coupling),
    "loss_tangent": ("piezo.loss_tangent", lambda s, k: 1.0),
    "c2": ("oscillator.damping_x2", lambda s, k: -(s.length**2) / _rate(s)),
    "c3": ("oscillator.damping_x4", lambda s, k: s.length**4 / _rate(s)),
    "cv": ("oscillator.damping_v", lambda s, k: s.length / s.mass),
    "gap": ("stop.gap", lambda s, k: 1.0 / s.length),
    "stop_stiffness": ("stop.stiffness", lambda s, k: 1.0 / k),
    "stop_damping": ("stop.damping", lambda s, k: 1.0 / _rate(s)),
    "n2": ("excitation.stiffness_noise", lambda s, k: 1.0),
    "correlation_time": ("excitation.correlation_time", lambda s, k: s.frequency),
    "centre": ("excitation.centre_frequency", lambda s, k: TURN / s.frequency),
    "bandwidth": ("excitation.bandwidth", lambda s, k: TURN / s.frequency),
}
# Where the others come from, for an error that names it.
SOURCES = {name: source for name, (source, _) in _SCALED.items()} | {
    "opposite_gap": "opposite_stop.gap",
    "beta": "piezo.coupling",
    "mu": "load.resistance",
    "c1": "oscillator.damping",
    "n1": "excitation.acceleration_psd",
    "drive": "excitation.acceleration_amplitude",
    "drive_frequency": "excitation.frequency",
    "coloured": "excitation.acceleration_psd",
}


def _rate(s: Scales) -> float:
    """The unit M w0 of a damping, in N s/m."""
    return s.mass * s.frequency


def _from_device(scene: Scene, s: Scales) -> Equations:
    modal = scene.modal
    resistance = scene.load.resistance if scene.load else None
    stiffness = abs(modal.stiffness)
    opposite, magnifier = scene.opposite_stop, scene.magnifier
    under = None if magnifier is None else magnifier.restitution
    plain: dict[str, Any] = {
        name: scaled(_given(scene, key), factor(s, stiffness))
        for name, (key, factor) in _SCALED.items()
    }
    if under is not None and magnifier is not None:  # the stop is not that of the device
        plain["gap"] = scaled(magnifier.gap, 1.0 / s.length)
    ends = () if opposite is None else (opposite.restitution, (opposite.gap or 0.0) / s.length)
    if (ball := scene.ball) is not None:  # nor are the ends of its box
        under = ball.restitution
        plain["gap"] = 0.5 * ball.room / s.length
        ends = under, plain["gap"]
    return Equations(
        **plain,
        **_shaking(scene, s),
        linear=-1.0 if modal.stiffness < 0.0 else None,
        beta=modal.coupling**2 / (stiffness * modal.capacitance),
        mu=_discharge(
            None if resistance is None else 1.0 / (resistance * modal.capacitance * s.frequency),
            plain["loss_tangent"],
        ),
        c1=scaled(modal.damping, -1.0 / _rate(s)),
        restitution=under if scene.stop is None else scene.stop.restitution,
        opposite_restitution=ends[0] if ends else None,
        opposite_gap=ends[1] if ends else None,
        modes=further_modes(modal, scene.mode, magnifier, ball, s.length),
    )


def _discharge(load: float | None, loss_tangent: float | None) -> float | None:
    """The discharge rate mu by the load and by dielectric loss."""
    return load if loss_tangent is None else (load or 0.0) + loss_tangent


def _given(scene: Scene, key: str) -> float | None:
    """The value of a scene's key; None if it, or its table, is absent."""
    table, _, name = key.partition(".")
    value: float | None = getattr(getattr(scene, table), name, None)
    return value


def _shaking(scene: Scene, s: Scales) -> dict[str, Any]:
    """The coefficients of the excitation: white or filtered noise, and a drive, a record or a density."""
    excitation = scene.excitation or Excitation()
    noise = scaled(excitation.acceleration_psd, 0.25 / (s.length**2 * s.frequency**3))
    acceleration = 1.0 / (s.length * s.frequency**2)
    record, density = recorded_shaking(scene)
    shaking: dict[str, Any] = {"coloured" if excitation.filtered else "n1": noise}
    if excitation.profile is None:  # else the amplitude and the frequency are those of the profile
        shaking["drive"] = scaled(excitation.acceleration_amplitude, acceleration)
        shaking["drive_frequency"] = scaled(excitation.frequency, TURN / s.frequency)
    shaking["record"] = None if record is None else record.scaled(s.frequency, -acceleration)
    shaking["density"] = None if density is None else density.scaled(s.frequency, acceleration)
    return shaking


# Keys of [nondimensional] that are coefficients as they stand; 0 is an absent effect.
_ALIKE = (
    "alpha",
    "alpha2",
    "softening",
    "inertia",
    "gamma",
    "loss_tangent",
    "beta",
    "c1",
    "c2",
    "c3",
    "cv",
    "gap",
    "stop_stiffness",
    "stop_damping",
    "drive",
)


def _from_table(table: Nondimensional) -> Equations:
    eps1 = 1.0 if table.eps1 is None else table.eps1
    eps2 = 1.0 if table.eps2 is None else table.eps2
    noise = scaled(table.D11, eps1**2)
    return Equations(
        **{name: getattr(table, name) or None for name in _ALIKE},
        mu=_discharge(table.mu or None, table.loss_tangent or None),
        linear=None if table.linear == 1.0 else table.linear,
        restitution=table.restitution,
        opposite_restitution=table.opposite_restitution,
        opposite_gap=None if table.opposite_restitution is None else table.opposite_gap or 0.0,
        n1=None if table.filtered else noise,
        n2=scaled(table.D22, eps2**2),
        n12=scaled(table.D12, eps1 * eps2),
        drive_frequency=table.drive_frequency if table.drive else None,
        coloured=noise if table.filtered else None,
        correlation_time=table.correlation_time,
        centre=table.centre_frequency,
        bandwidth=table.bandwidth,
    )


def scaled(value: float | None, factor: float) -> float | None:
    """Value * factor; an absent or zero coefficient stays absent."""
    return value * factor if value is not None and value * factor != 0.0 else None
