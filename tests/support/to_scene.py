"""From a scene to its equations at any length, and from equations back to a physical scene."""

import math

from harvester.equations.coefficients import Equations
from harvester.equations.from_scene import TURN, equations_at, scaled
from harvester.equations.scales import Scales, scales
from harvester.errors import invalid
from harvester.scene.load import Load
from harvester.scene.physical import Excitation, OppositeStop, Oscillator, Piezo, Stop
from harvester.scene.scene import Scene


def equations(scene: Scene, length: float | None = None) -> Equations:
    """The nondimensional coefficients of a scene, at the length l (m; a physical scene's `natural_length`)."""
    return equations_at(scene, scales(scene, length))


def physical(eqs: Equations, s: Scales, title: str = "") -> Scene:
    """The physical scene whose equations, at length ``s.length``, are ``eqs``: inverse of `equations`.

    ``s.coupling`` is used where beta is None; else theta = sqrt(beta k Cp).  InputError for correlated noise, and for
    a record, which no physical scene has.
    """
    if eqs.n12 is not None:
        raise invalid("n12", "be absent from a physical scene", eqs.n12)
    if eqs.record is not None or eqs.density is not None:
        raise invalid("record", "be absent, as only a file can hold it", "given")
    stiffness = s.mass * s.frequency**2
    rate = s.mass * s.frequency
    oscillator = Oscillator(
        mass=s.mass,
        stiffness=stiffness * (eqs.linear or 1.0),
        quadratic_stiffness=scaled(eqs.alpha2, stiffness / s.length),
        cubic_stiffness=scaled(eqs.alpha, stiffness / s.length**2),
        ceramic_softening=scaled(eqs.softening, stiffness / s.length),
        inertia_x2=scaled(eqs.inertia, s.mass / s.length**2),
        damping=scaled(eqs.c1, -rate),
        damping_x2=scaled(eqs.c2, -rate / s.length**2),
        damping_x4=scaled(eqs.c3, rate / s.length**4),
        damping_v=scaled(eqs.cv, s.mass / s.length),
    )
    coupling = s.coupling if eqs.beta is None else math.sqrt(eqs.beta * stiffness * s.capacitance)
    noise = Excitation(
        acceleration_psd=scaled(eqs.n1 or eqs.coloured, 4 * s.length**2 * s.frequency**3),
        stiffness_noise=eqs.n2,
        acceleration_amplitude=scaled(eqs.drive, s.length * s.frequency**2),
        frequency=scaled(eqs.drive_frequency, s.frequency / TURN),
        correlation_time=scaled(eqs.correlation_time, 1.0 / s.frequency),
        centre_frequency=scaled(eqs.centre, s.frequency / TURN),
        bandwidth=scaled(eqs.bandwidth, s.frequency / TURN),
    )
    stop = opposite = None
    if eqs.restitution is not None or eqs.stop_stiffness is not None:
        stop = Stop(
            restitution=eqs.restitution,
            gap=scaled(eqs.gap, s.length),
            stiffness=scaled(eqs.stop_stiffness, stiffness),
            damping=scaled(eqs.stop_damping, rate),
        )
    if eqs.opposite_restitution is not None:
        opposite = OppositeStop(
            restitution=eqs.opposite_restitution, gap=scaled(eqs.opposite_gap, s.length)
        )
    return Scene(
        title=title,
        oscillator=oscillator,
        piezo=Piezo(
            coupling=coupling,
            coupling_x2=scaled(eqs.gamma, coupling / s.length**2),
            capacitance=s.capacitance,
            loss_tangent=eqs.loss_tangent,
        ),
        stop=stop,
        opposite_stop=opposite,
        excitation=noise if noise != Excitation() else None,
        load=None if eqs.load is None else Load(resistance=s.resistance(eqs.load)),
    )
