"""Names that move to their own files."""

__all__ = ["Equations", "Scales", "effects", "equations", "natural_length", "physical", "scales"]

from harvester.equations.coefficients import Equations
from harvester.equations.effects import effects
from harvester.equations.from_scene import equations
from harvester.equations.scales import Scales, natural_length, scales
from harvester.equations.to_scene import physical
