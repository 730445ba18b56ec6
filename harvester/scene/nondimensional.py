"""The table of a nondimensional scene: the parameters of the paper's Eq. 2, and ours beyond it."""

from typing import Annotated, ClassVar

from harvester.errors import InputError, invalid
from harvester.quantities.kinds import NUMBER, NUMBER_ABOVE_0, NUMBER_FROM_0, RESTITUTION
from harvester.scene.checks import (
    check_opposite_stop,
    check_rigid_or_compliant,
    check_shaking,
    check_stop_damping,
)
from harvester.scene.table import NONE, OptNumber, SceneTable, scene_table


@scene_table
class Nondimensional(SceneTable):
    """The parameters of the Entropy 2026 paper's nondimensional Eq. 2, every one optional.

    The noise intensities are N1 = eps1^2 D11 and N2 = eps2^2 D22; eps1 and eps2 are 1 if only their
    D is given; an eps without its D is refused.  Ours: the spring is linear x + alpha2 x^2 + alpha
    x^3 with linear = 1 or -1, the stops are those of `Stop` (stop_stiffness and stop_damping
    instead of restitution) and `OppositeStop`, drive cos(drive_frequency t) is a harmonic
    acceleration; correlation_time, or centre_frequency and bandwidth (rad), filter the external
    noise as in `Excitation`.

    >>> import harvester as hv
    >>> hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01).beta
    0.05
    """

    TABLE: ClassVar[str] = "nondimensional"
    c1: Annotated[OptNumber, NUMBER, "linear damping is -c1", "-0.05"] = NONE
    c2: Annotated[OptNumber, NUMBER, "damping of x^2 is -c2", "-0.02"] = NONE
    c3: Annotated[OptNumber, NUMBER, "damping of x^4"] = NONE
    cv: Annotated[OptNumber, NUMBER_FROM_0, "quadratic damping, of |x'|"] = NONE
    alpha: Annotated[OptNumber, NUMBER, "cubic stiffness"] = NONE
    alpha2: Annotated[OptNumber, NUMBER, "quadratic stiffness"] = NONE
    softening: Annotated[OptNumber, NUMBER_FROM_0, "softening of the ceramic, -x |x|"] = NONE
    inertia: Annotated[OptNumber, NUMBER_FROM_0, "mass 1 + inertia x^2"] = NONE
    linear: Annotated[OptNumber, NUMBER, "1, or -1 for a bistable device", "-1.0"] = NONE
    beta: Annotated[OptNumber, NUMBER_FROM_0, "coupling, theta^2/(K Cp)"] = NONE
    gamma: Annotated[OptNumber, NUMBER, "coupling that grows as 1 + gamma x^2"] = NONE
    mu: Annotated[OptNumber, NUMBER_FROM_0, "load, 1/(R Cp w0)", "1.0"] = NONE
    loss_tangent: Annotated[OptNumber, NUMBER_FROM_0, "dielectric loss, added to mu"] = NONE
    restitution: Annotated[OptNumber, RESTITUTION, "rigid stop"] = NONE
    gap: Annotated[OptNumber, NUMBER, "the stop is at x = -gap", "0.5"] = NONE
    opposite_restitution: Annotated[
        OptNumber,
        RESTITUTION,
        "restitution coefficient of a second rigid stop, at x = +opposite_gap",
    ] = NONE
    opposite_gap: Annotated[OptNumber, NUMBER, "distance of that stop from rest", "0.5"] = NONE
    stop_stiffness: Annotated[
        OptNumber, NUMBER_FROM_0, "compliant stop, instead of restitution", "100.0"
    ] = NONE
    stop_damping: Annotated[OptNumber, NUMBER_FROM_0, "damping of a compliant stop"] = NONE
    eps1: Annotated[OptNumber, NUMBER, "size of the external noise; default 1", "1.0"] = NONE
    eps2: Annotated[OptNumber, NUMBER, "size of the parametric noise; default 1", "1.0"] = NONE
    D11: Annotated[OptNumber, NUMBER_FROM_0, "intensity of the external noise", "0.01"] = NONE
    D22: Annotated[OptNumber, NUMBER_FROM_0, "intensity of the parametric noise", "0.01"] = NONE
    D12: Annotated[OptNumber, NUMBER, "correlation of the two", "0.005"] = NONE
    drive: Annotated[OptNumber, NUMBER_FROM_0, "amplitude of a harmonic acceleration", "0.2"] = NONE
    drive_frequency: Annotated[OptNumber, NUMBER_ABOVE_0, "its frequency over w0 (rad)", "1.0"] = (
        NONE
    )
    correlation_time: Annotated[OptNumber, NUMBER_ABOVE_0, "the external noise is coloured"] = NONE
    centre_frequency: Annotated[
        OptNumber, NUMBER_ABOVE_0, "centre of band-limited external noise (rad)", "1.0"
    ] = NONE
    bandwidth: Annotated[
        OptNumber, NUMBER_ABOVE_0, "half-power bandwidth of that noise (rad)", "0.2"
    ] = NONE

    def __post_init__(self) -> None:
        check_shaking(self, "drive", "drive_frequency", "D11")
        for stop in ("restitution", "opposite_restitution", "stop_stiffness"):
            if self.gamma and getattr(self, stop) is not None:
                raise InputError(
                    f"nondimensional.gamma must be left out with {stop}, but both are given"
                )
        if self.D12 and self.filtered:
            raise InputError(
                "nondimensional.D12 must be left out if the noise is filtered, but both are given"
            )
        for eps, density in (("eps1", "D11"), ("eps2", "D22")):
            if getattr(self, eps) and getattr(self, density) is None:
                raise InputError(
                    f"nondimensional.{density} must be given with {eps}, but is left out"
                )
        if self.linear is not None and abs(self.linear) != 1.0:
            raise invalid("nondimensional.linear", "be 1 or -1", self.linear)
        self._check_stops()
        bound = ((self.D11 or 0.0) * (self.D22 or 0.0)) ** 0.5
        if abs(self.D12 or 0.0) > bound * (1 + 1e-12):
            raise invalid(
                "nondimensional.D12", f"be at most sqrt(D11 D22) = {bound:g} in size", self.D12
            )

    @property
    def filtered(self) -> bool:
        """Whether the external noise is coloured or of a band, rather than white."""
        return self.correlation_time is not None or self.bandwidth is not None

    def _check_stops(self) -> None:
        for key in ("stop_stiffness", "opposite_restitution"):
            if self.inertia and getattr(self, key) is not None:
                raise InputError(
                    f"nondimensional.inertia must be left out if {key} is given, but both are given"
                )
        stop = self.restitution is not None or bool(self.stop_stiffness)
        for key, whole in (("gap", stop), ("opposite_gap", self.opposite_restitution is not None)):
            if getattr(self, key) is not None and not whole:
                raise InputError(
                    f"nondimensional.{key} must be used with a stop, but there is none: give its restitution"
                )
        if stop or self.stop_damping is not None:
            check_rigid_or_compliant(
                "nondimensional", "stop_", self.restitution, self.stop_stiffness, self.stop_damping
            )
            check_stop_damping(
                "nondimensional.stop_damping", self.stop_damping, self.stop_stiffness, 1.0
            )
        if self.opposite_restitution is not None:
            check_opposite_stop(
                "nondimensional.opposite_",
                self.restitution is not None,
                self.gap,
                self.opposite_gap,
            )
