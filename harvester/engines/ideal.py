"""Engine `ideal`: Monte Carlo with the netlist's circuit made of ideal diodes and switches."""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

from harvester.answers.estimate import Estimate
from harvester.engines.ensemble import Ensemble, Model
from harvester.engines.protocol import Progress, refuse
from harvester.equations.scaling import equations, scales
from harvester.errors import CannotServeError
from harvester.scene.scene import Scene

# Effects that the ideal circuits' kernel does not know
SHAKING = frozenset({"harmonic_drive", "coloured_noise", "band_pass_noise", "recorded_acceleration", "tabulated_noise"})
UNIDEAL = SHAKING | {"negative_stiffness", "quadratic_stiffness", "compliant_stop", "gap", "opposite_stop"}


@dataclass(frozen=True, kw_only=True)
class Ideal(Ensemble):
    """The coupled equations with a load circuit that is piecewise linear (`harvester.mechanics.rectifiers.circuit`).

    >>> import harvester as hv
    >>> hv.Ideal(within="2%", budget="1min").budget
    60.0

    Raises
    ------
    CannotServeError
        for a load resistance, a netlist of the user's own, whose switches are not known, and the effects `UNIDEAL`.
    UnboundedResponseError
        where no stationary response exists.
    """

    NAME: ClassVar[str] = "ideal"
    REASON: ClassVar[str] = "the error of ideal diodes and switches is not known from within: compare with 'spice'"

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """As `Ensemble.run`."""
        answer = super().run(scene, progress)
        return dataclasses.replace(answer, effects=(*answer.effects, "ideal_circuit"))

    def model(self, scene: Scene) -> Model:
        """What is simulated for a scene; raises as the class says."""
        from harvester.circuit.idealised import ideal_circuit

        if scene.load is None or scene.load.netlist is None:
            raise CannotServeError("engine 'ideal' must have a netlist as load, but has none: use engine 'ensemble'")
        circuit = ideal_circuit(scene.load, scales(scene))
        if circuit is None:
            raise CannotServeError(
                f"engine 'ideal' must have one of the package's netlists, but the load is {scene.load.netlist!r}: "
                "use engine 'spice'"
            )
        eqs = equations(scene)
        refuse(eqs, UNIDEAL, f"engine {self.NAME!r}", "engine 'spice'")
        return Model(eqs, circuit, "load", eqs.beta or 0.0)
