"""The tables of a physical scene: oscillator, piezo, stops and excitation, in SI units.

Numbers are SI; texts carry their unit.  A table or a key that is left out is an effect that is
absent. Long because users read the explanation of each table.
"""

from collections.abc import Sequence
from typing import Annotated, ClassVar

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import (
    ACCELERATION,
    ACCELERATION_PSD,
    CAPACITANCE,
    CERAMIC_SOFTENING,
    COUPLING,
    COUPLING_X2,
    CUBIC_STIFFNESS,
    DAMPING,
    DAMPING_V,
    DAMPING_X2,
    DAMPING_X4,
    FREQUENCY,
    GAP,
    INERTIA_X2,
    LOSS_TANGENT,
    MAGNIFIER_STIFFNESS,
    MASS,
    MODE_COUPLING,
    NUMBER,
    NUMBER_FROM_0,
    PARTICIPATION,
    QUADRATIC_STIFFNESS,
    QUALITY,
    RESTITUTION,
    ROOM,
    STIFFNESS,
    STOP_DAMPING,
    STOP_STIFFNESS,
    STRAIN_OF,
    TILT,
    TIME,
)
from harvester.records.profiles.catalogue import check_profile
from harvester.scene.checks import check_rigid_or_compliant, check_same, check_shaking
from harvester.scene.table import NONE, Number, OptNumber, Read, SceneTable, scene_table

FILES = ("acceleration_file", "acceleration_psd_file")  # keys of the excitation that name files


@scene_table
class Oscillator(SceneTable):
    """Mass, spring and damper of the harvester, in coordinates relative to the base.

        mass X'' + (damping + damping_x2 X^2 + damping_x4 X^4 + damping_v |X'|) X' + F(X)
            = -mass a(t) - theta v

        F(X) = stiffness X + quadratic_stiffness X^2 + cubic_stiffness X^3 - ceramic_softening X |X|

    With ``inertia_x2`` a force inertia_x2 (X^2 X'' + X X'^2) is added on the left.
    A negative stiffness makes the device bistable, a negative cubic_stiffness softens the spring.
    SI units. Coefficients of the *Entropy* 2026 paper: b1 = -damping, b2 = -damping_x2, b3 =
    damping_x4. Equivalents: damping_ratio is damping / (2 sqrt(|stiffness| mass)), q is 1/(2
    damping_ratio), and the short-circuit resonance ``frequency`` (Hz) gives stiffness = mass (2 pi
    frequency)^2.

    >>> import harvester as hv
    >>> hv.Oscillator(mass="40 g", stiffness="16 N/m", damping_ratio=0.004).mass
    0.04
    """

    TABLE: ClassVar[str] = "oscillator"
    SAME: ClassVar = {("stiffness", "frequency"): True, ("damping", "damping_ratio", "q"): False}
    mass: Annotated[Number, MASS, "effective (modal) mass"]
    stiffness: Annotated[
        OptNumber, STIFFNESS, "linear stiffness in short circuit; negative: bistable"
    ] = NONE
    frequency: Annotated[OptNumber, FREQUENCY, "short-circuit resonance, instead of stiffness"] = (
        NONE
    )
    quadratic_stiffness: Annotated[
        OptNumber, QUADRATIC_STIFFNESS, "coefficient of X^2 in the spring force"
    ] = NONE
    cubic_stiffness: Annotated[
        OptNumber, CUBIC_STIFFNESS, "coefficient of X^3 in the spring force; negative: softening"
    ] = NONE
    ceramic_softening: Annotated[
        OptNumber,
        CERAMIC_SOFTENING,
        "coefficient of -X |X| in the spring force: a strained ceramic",
    ] = NONE
    inertia_x2: Annotated[
        OptNumber, INERTIA_X2, "mass that grows with X^2, such as that of a cantilever's shortening"
    ] = NONE
    damping: Annotated[OptNumber, DAMPING, "linear damping"] = NONE
    damping_ratio: Annotated[
        OptNumber, NUMBER, "instead of damping: damping/(2 sqrt(|stiffness| mass))", "0.01"
    ] = NONE
    q: Annotated[OptNumber, QUALITY, "quality factor in short circuit, instead of damping"] = NONE
    damping_x2: Annotated[OptNumber, DAMPING_X2, "coefficient of X^2 X'"] = NONE
    damping_x4: Annotated[OptNumber, DAMPING_X4, "coefficient of X^4 X'"] = NONE
    damping_v: Annotated[
        OptNumber, DAMPING_V, "quadratic damping: coefficient of |X'| X', such as air's"
    ] = NONE

    def __post_init__(self) -> None:
        if self.stiffness == 0.0:
            raise invalid(
                "oscillator.stiffness",
                "be other than 0, for it sets the scale of time",
                self.stiffness,
            )
        check_same(self)


@scene_table
class Piezo(SceneTable):
    """The piezoelectric transducer: force theta v on the mass, charge theta X into its capacitance.

    theta is the coupling in N/V, the capacitance (F) is that of the clamped piezo.
    ``strain_per_displacement`` (1/m) is the largest strain of the piezo over the displacement: no
    equation has it, but limits and lifetimes have. ``open_circuit_frequency`` f (Hz) represents the
    coupling with stiffness + theta^2/capacitance = mass (2 pi f)^2.

    >>> import harvester as hv
    >>> hv.Piezo(coupling="1e-3 N/V", capacitance="50 nF").coupling
    0.001
    """

    TABLE: ClassVar[str] = "piezo"
    SAME: ClassVar = {("coupling", "open_circuit_frequency"): True}
    coupling: Annotated[OptNumber, COUPLING, "force per volt, which is charge per displacement"] = (
        NONE
    )
    open_circuit_frequency: Annotated[
        OptNumber, FREQUENCY, "open-circuit resonance, instead of coupling", "'4.8 Hz'"
    ] = NONE
    coupling_x2: Annotated[
        OptNumber, COUPLING_X2, "coefficient of X^2 in the coupling: coupling + coupling_x2 X^2"
    ] = NONE
    loss_tangent: Annotated[
        OptNumber,
        LOSS_TANGENT,
        "dielectric loss: a resistance 1/(loss_tangent w0 capacitance) across the piezo",
    ] = NONE
    capacitance: Annotated[Number, CAPACITANCE, "clamped capacitance: with the mass held"]
    strain_per_displacement: Annotated[
        OptNumber, STRAIN_OF, "largest strain of the piezo, for peak_strain"
    ] = NONE

    def __post_init__(self) -> None:
        check_same(self)


@scene_table
class Stop(SceneTable):
    """A stop at X = -gap, motion on X > -gap; a negative gap presses the mass on it (preload).

    Rigid: X'+ = -restitution X'-.  Compliant, with ``stiffness`` instead: if X < -gap the force on
    the mass is -stiffness (X + gap) - damping X'; with less than the critical damping, or the mass
    would not come off.

    >>> import harvester as hv
    >>> hv.Stop(restitution=0.96, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "stop"
    restitution: Annotated[
        OptNumber, RESTITUTION, "rigid stop: speed after over speed before an impact"
    ] = NONE
    gap: Annotated[OptNumber, GAP, "the stop is at X = -gap; default 0, negative: preload"] = NONE
    stiffness: Annotated[
        OptNumber, STOP_STIFFNESS, "compliant stop, instead of restitution: its stiffness"
    ] = NONE
    damping: Annotated[OptNumber, STOP_DAMPING, "damping of a compliant stop"] = NONE

    def __post_init__(self) -> None:
        check_rigid_or_compliant("stop", "", self.restitution, self.stiffness, self.damping)


@scene_table
class OppositeStop(SceneTable):
    """A second rigid stop, at X = +gap, next to a rigid [stop]: X'+ = -restitution X'-.

    >>> import harvester as hv
    >>> hv.OppositeStop(restitution=0.9, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "opposite_stop"
    restitution: Annotated[
        Number, RESTITUTION, "restitution coefficient of a second rigid stop, at X = +gap"
    ]
    gap: Annotated[OptNumber, GAP, "distance of that stop from rest"] = NONE


@scene_table
class Mode(SceneTable):
    """A further mode of vibration, the second to the fourth; the [oscillator] is the first.

        mass (X'' + 2 damping_ratio w X' + w^2 X) + coupling v = -mass base a,    w = 2 pi frequency

    X is the mode's displacement at the point at which that of the [oscillator] is measured, a the
    acceleration of the
    base and ``base`` the mode's participation in it.  A stop meets the sum of all modes'
    displacements, each times its ``at_stop``, which is 1 if the stop is in the place where they are
    measured, such as at the tip.

    >>> import harvester as hv
    >>> hv.Mode(frequency="310 Hz", mass="5 g", damping_ratio=0.01, coupling="-2e-3 N/V", base=-0.6).base
    -0.6
    """

    TABLE: ClassVar[str] = "mode"
    frequency: Annotated[
        Number,
        FREQUENCY,
        "resonance of a further mode in short circuit, in ascending order",
        "'20 Hz'",
    ]
    mass: Annotated[Number, MASS, "modal mass of a further mode", "'15 g'"]
    damping_ratio: Annotated[
        OptNumber, NUMBER_FROM_0, "damping ratio of a further mode", "0.01"
    ] = NONE
    coupling: Annotated[
        OptNumber, MODE_COUPLING, "force per volt on a further mode; left out: none"
    ] = NONE
    base: Annotated[
        OptNumber, PARTICIPATION, "participation in the base acceleration; default 1"
    ] = NONE
    at_stop: Annotated[
        OptNumber, PARTICIPATION, "displacement at the stop over that of the mode; default 1"
    ] = NONE


@scene_table
class Magnifier(SceneTable):
    """A mass on a spring between the base and the device, which shakes the device more than the base does.

    Its displacement Z is relative to the base, that of the [oscillator] relative to the magnifier.
    With a ``restitution`` there is a rigid stop under it at Z = -gap.

    >>> import harvester as hv
    >>> hv.Magnifier(mass="200 g", stiffness="80 N/m", damping="0.05 N s/m").mass
    0.2
    """

    TABLE: ClassVar[str] = "magnifier"
    mass: Annotated[Number, MASS, "mass between the base and the device"]
    stiffness: Annotated[Number, MAGNIFIER_STIFFNESS, "stiffness of its spring to the base"]
    damping: Annotated[OptNumber, STOP_DAMPING, "coefficient of its damper to the base"] = NONE
    restitution: Annotated[
        OptNumber, RESTITUTION, "restitution coefficient of a rigid stop under it; default: no stop"
    ] = NONE
    gap: Annotated[OptNumber, GAP, "that stop is at Z = -gap; default 0"] = NONE

    def __post_init__(self) -> None:
        if self.gap is not None and self.restitution is None:
            raise InputError("magnifier.restitution must be given with gap, but is left out")


@scene_table
class Ball(SceneTable):
    """A free ball in a box on the mass, or at the tip: it moves without friction and hits the box's two ends.

    Its place Z is relative to the base, from the middle of the box: |Z - X| <= room/2, and at an
    end the relative speed turns round times ``restitution``.  With a ``tilt`` of 90 degrees the box
    is upright.

    >>> import harvester as hv
    >>> hv.Ball(mass="2 g", room="4 mm", restitution=0.8).room
    0.004
    """

    TABLE: ClassVar[str] = "ball"
    mass: Annotated[Number, MASS, "mass of a free ball in a box on the mass", "'5 g'"]
    room: Annotated[Number, ROOM, "free way of the ball from end to end of its box"]
    restitution: Annotated[Number, RESTITUTION, "restitution coefficient at both ends of its box"]
    tilt: Annotated[
        OptNumber, TILT, "angle of its path to the horizontal, in degrees; default 0"
    ] = NONE


@scene_table
class Excitation(SceneTable):
    """Base excitation of the device. Several kinds can be combined.

    White noise has the one-sided power spectral density ``acceleration_psd``. With
    ``correlation_time`` T it is coloured, with the density G/(1 + (2 pi f T)^2); with
    ``centre_frequency`` and ``bandwidth`` it is band-limited, with the density at the centre of the
    band. ``acceleration_amplitude`` and ``frequency`` are a harmonic excitation, alone or with
    noise. A recording (``acceleration_file``), a tabulated PSD (``acceleration_psd_file``) and
    a ``profile`` can also be combined with white noise. ``stiffness_noise`` is parametric white
    noise (N2, a number).

    >>> import harvester as hv
    >>> f'{hv.Excitation(acceleration_psd="1e-5 g^2/Hz").acceleration_psd:.4g} (m/s^2)^2/Hz'
    '0.0009617 (m/s^2)^2/Hz'
    """

    TABLE: ClassVar[str] = "excitation"
    acceleration_psd: Annotated[
        OptNumber, ACCELERATION_PSD, "white noise of the base, one-sided power spectral density"
    ] = NONE
    stiffness_noise: Annotated[
        OptNumber, NUMBER_FROM_0, "parametric white noise, N2 = eps2^2 D22"
    ] = NONE
    acceleration_amplitude: Annotated[
        OptNumber, ACCELERATION, "peak of the harmonic excitation, or of a shock"
    ] = NONE
    frequency: Annotated[
        OptNumber,
        FREQUENCY,
        "frequency of the harmonic excitation; rotation or step rate of a profile",
    ] = NONE
    correlation_time: Annotated[
        OptNumber, TIME, "the noise is coloured (Ornstein and Uhlenbeck)"
    ] = NONE
    centre_frequency: Annotated[OptNumber, FREQUENCY, "centre of band-limited noise"] = NONE
    bandwidth: Annotated[
        OptNumber, FREQUENCY, "half-power bandwidth of band-limited noise", "'0.5 Hz'"
    ] = NONE
    acceleration_file: (
        Annotated[str, "recorded acceleration of the base, a CSV file with units", "'shake.csv'"]
        | None
    ) = None
    acceleration_psd_file: (
        Annotated[str, "tabulated noise PSD (log-log; a ramp to a 0), CSV", "'psd.csv'"] | None
    ) = None
    profile: (
        Annotated[str, "vibration profile by name, listed by 'harvester keys profile'", "'walking'"]
        | None
    ) = None
    level: Annotated[
        OptNumber, NUMBER, "factor on the accelerations of a profile; negative: reversed", "0.5"
    ] = NONE
    pulse_duration: Annotated[
        OptNumber, TIME, "duration of a shock; decay time to 1/e of a damped sine", "'11 ms'"
    ] = NONE
    event_rate: Annotated[
        OptNumber, FREQUENCY, "shocks per second; default: a single one, from rest", "'0.5 Hz'"
    ] = NONE
    harmonics: Annotated[
        Read[tuple[Annotated[float, ACCELERATION], ...] | None, Sequence[float | str] | None],
        "peaks of a machine at 1, 2, ... times its frequency",
        "['0.1 g', '0.03 g']",
    ] = NONE

    def __post_init__(self) -> None:
        check_profile(vars(self))
        check_shaking(self, "acceleration_amplitude", "frequency", "acceleration_psd")

    @property
    def filtered(self) -> bool:
        """Whether the noise is coloured or of a band, rather than white."""
        return self.correlation_time is not None or self.bandwidth is not None
