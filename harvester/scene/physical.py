"""The tables of a physical scene: oscillator, piezo, stops and excitation, in SI units.

Numbers are SI; texts carry their unit.  A table or a key that is left out is an effect that is absent.
"""

from typing import Annotated, ClassVar

from pydantic.dataclasses import dataclass as checked_dataclass

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import (
    ACCELERATION,
    ACCELERATION_PSD,
    CAPACITANCE,
    COUPLING,
    CUBIC_STIFFNESS,
    DAMPING,
    DAMPING_X2,
    DAMPING_X4,
    FREQUENCY,
    GAP,
    MASS,
    NUMBER,
    NUMBER_FROM_0,
    QUADRATIC_STIFFNESS,
    RESTITUTION,
    STIFFNESS,
    STOP_DAMPING,
    STOP_STIFFNESS,
    STRAIN_OF,
    TIME,
)
from harvester.records.profiles.catalogue import check_profile
from harvester.scene.checks import check_rigid_or_compliant, check_shaking
from harvester.scene.table import CONFIG, SceneTable

FILES = ("acceleration_file", "acceleration_psd_file")  # keys of the excitation that name files


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Oscillator(SceneTable):
    """The mass on its spring and its damper, which moves relative to the base.

        M X'' + (damping + damping_x2 X^2 + damping_x4 X^4) X' + spring = ...

    spring = stiffness X + quadratic_stiffness X^2 + cubic_stiffness X^3: a negative stiffness makes two wells, a
    negative cubic_stiffness a spring that softens.  SI units.  The paper's b1 = -damping, b2 = -damping_x2,
    b3 = damping_x4; damping_ratio is damping / (2 sqrt(|stiffness| mass)).

    >>> import harvester as hv
    >>> hv.Oscillator(mass="40 g", stiffness="16 N/m", damping_ratio=0.004).mass
    0.04
    """

    TABLE: ClassVar[str] = "oscillator"
    mass: Annotated[float, MASS, "effective (modal) mass"]
    stiffness: Annotated[float, STIFFNESS, "linear spring, in short circuit; negative: two wells"]
    quadratic_stiffness: Annotated[float, QUADRATIC_STIFFNESS, "force of X^2"] | None = None
    cubic_stiffness: Annotated[float, CUBIC_STIFFNESS, "force of X^3; negative: softening"] | None = None
    damping: Annotated[float, DAMPING, "linear damping"] | None = None
    damping_ratio: Annotated[float, NUMBER, "instead of damping: damping/(2 sqrt(|stiffness| mass))"] | None = None
    damping_x2: Annotated[float, DAMPING_X2, "damping of X^2 X'"] | None = None
    damping_x4: Annotated[float, DAMPING_X4, "damping of X^4 X'"] | None = None

    def __post_init__(self) -> None:
        if self.stiffness == 0.0:
            raise invalid("oscillator.stiffness", "be other than 0, for it sets the scale of time", self.stiffness)
        if self.damping is not None and self.damping_ratio is not None:
            raise InputError("oscillator.damping_ratio must be left out where damping is given, but both are given")


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Piezo(SceneTable):
    """The piezoelectric transducer: force theta v on the mass, charge theta X into its capacitance.

    theta is the coupling in N/V, the capacitance (F) is that of the clamped piezo.  ``strain_per_displacement`` (1/m)
    is the largest strain of the piezo over the displacement: no equation has it, but limits and lifetimes have.

    >>> import harvester as hv
    >>> hv.Piezo(coupling="1e-3 N/V", capacitance="50 nF").coupling
    0.001
    """

    TABLE: ClassVar[str] = "piezo"
    coupling: Annotated[float, COUPLING, "force a volt, which is charge a displacement"]
    capacitance: Annotated[float, CAPACITANCE, "clamped capacitance: with the mass held"]
    strain_per_displacement: Annotated[float, STRAIN_OF, "largest strain of the piezo, for peak_strain"] | None = None


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Stop(SceneTable):
    """A stop at X = -gap, motion on X > -gap; a negative gap presses the mass on it (preload).

    Rigid: X'+ = -restitution X'-.  Compliant, with ``stiffness`` instead: where X < -gap the force on the mass is
    -stiffness (X + gap) - damping X'; with less than the critical damping, or the mass would not come off.

    >>> import harvester as hv
    >>> hv.Stop(restitution=0.96, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "stop"
    restitution: Annotated[float, RESTITUTION, "rigid stop: speed after over speed before an impact"] | None = None
    gap: Annotated[float, GAP, "the stop is at X = -gap; 0 where left out, negative: pressed on the mass"] | None = None
    stiffness: Annotated[float, STOP_STIFFNESS, "compliant stop, instead of restitution: its stiffness"] | None = None
    damping: Annotated[float, STOP_DAMPING, "of a compliant stop"] | None = None

    def __post_init__(self) -> None:
        check_rigid_or_compliant("stop", "", self.restitution, self.stiffness, self.damping)


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class OppositeStop(SceneTable):
    """A second rigid stop, at X = +gap, beside a rigid [stop]: X'+ = -restitution X'-.

    >>> import harvester as hv
    >>> hv.OppositeStop(restitution=0.9, gap="0.5 mm").gap
    0.0005
    """

    TABLE: ClassVar[str] = "opposite_stop"
    restitution: Annotated[float, RESTITUTION, "of a second rigid stop, at X = +gap"]
    gap: Annotated[float, GAP, "its distance from rest"] | None = None


@checked_dataclass(frozen=True, kw_only=True, config=CONFIG)
class Excitation(SceneTable):
    """What shakes the device: an acceleration of its base, and white noise on its stiffness (N2, a number).

    ``acceleration_psd`` is the one-sided density of white noise; with ``correlation_time`` T that at low frequencies of
    noise of density G/(1 + (2 pi f T)^2); with ``centre_frequency`` and ``bandwidth`` (between the half-power points)
    that at the centre of a resonator's band.  ``acceleration_amplitude`` and ``frequency`` are a harmonic motion, which
    white noise may go with; so it may with a record in time, ``acceleration_file``, a table of the density,
    ``acceleration_psd_file`` (`harvester.records.records`), or a ``profile`` by name (`harvester.records.profiles`).

    >>> import harvester as hv
    >>> f'{hv.Excitation(acceleration_psd="1e-5 g^2/Hz").acceleration_psd:.4g} (m/s^2)^2/Hz'
    '0.0009617 (m/s^2)^2/Hz'
    """

    TABLE: ClassVar[str] = "excitation"
    acceleration_psd: Annotated[float, ACCELERATION_PSD, "white noise of the base, one-sided density"] | None = None
    stiffness_noise: Annotated[float, NUMBER_FROM_0, "white noise on the stiffness, N2 = eps2^2 D22"] | None = None
    acceleration_amplitude: Annotated[float, ACCELERATION, "harmonic of the base, peak; or that of a shock"] | None = (
        None
    )
    frequency: Annotated[float, FREQUENCY, "of the harmonic; of a profile: turns, steps, ... a second"] | None = None
    correlation_time: Annotated[float, TIME, "the noise is coloured (Ornstein and Uhlenbeck)"] | None = None
    centre_frequency: Annotated[float, FREQUENCY, "the noise has a band: its centre"] | None = None
    bandwidth: Annotated[float, FREQUENCY, "between the half-power points of that band"] | None = None
    acceleration_file: (
        Annotated[str, "recorded acceleration of the base, a CSV file with units", "'shake.csv'"] | None
    ) = None
    acceleration_psd_file: (
        Annotated[str, "noise of a tabulated density (log-log; a ramp to a 0), CSV", "'psd.csv'"] | None
    ) = None
    profile: Annotated[str, "shaking by name, listed by 'harvester keys profile'", "'walking'"] | None = None
    level: Annotated[float, NUMBER, "times the accelerations of a profile; negative: turned round"] | None = None
    pulse_duration: Annotated[float, TIME, "of a shock; of a damped sine the time to 1/e"] | None = None
    event_rate: Annotated[float, FREQUENCY, "shocks a second; left out: a single one, from rest"] | None = None
    harmonics: (
        Annotated[
            tuple[Annotated[float, ACCELERATION], ...],
            "of a machine: peaks at 1, 2, ... times its frequency",
            "['0.1 g', '0.03 g']",
        ]
        | None
    ) = None

    def __post_init__(self) -> None:
        check_profile(vars(self))
        check_shaking(self, "acceleration_amplitude", "frequency", "acceleration_psd")

    @property
    def filtered(self) -> bool:
        """Whether the noise is coloured or of a band, rather than white."""
        return self.correlation_time is not None or self.bandwidth is not None
