"""The coefficients of the nondimensional equations that are solved (paper, Eq. 2, and what this package adds)."""

from dataclasses import dataclass

from harvester.scene.records import Record, TabulatedDensity


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
