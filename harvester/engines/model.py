"""What an engine of trajectories simulates of a scene."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from harvester.equations.coefficients import Equations

if TYPE_CHECKING:
    from harvester.mechanics.rectifiers.circuit import IdealCircuit


@dataclass(frozen=True)
class Model:
    """What is simulated: the equations, the circuit if it is not a resistor, and what its power is made of.

    Nondimensional, the power is ``factor`` times the moment ``name``.
    """

    eqs: Equations
    circuit: "IdealCircuit | None"
    name: str
    factor: float
