"""The engines: their method, scenes and errors.  All make an `Estimate` of a problem."""

from harvester.engines.averaged import Averaged
from harvester.engines.cheapest import Cheapest
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.ideal import Ideal
from harvester.engines.published import Published
from harvester.engines.selection import ENGINES, engine, serving
from harvester.engines.slow import Slow
from harvester.engines.spice.spice import Spice

__all__ = [
    "ENGINES",
    "Averaged",
    "Cheapest",
    "Compiled",
    "Density",
    "Ensemble",
    "Exact",
    "Ideal",
    "Published",
    "Slow",
    "Spice",
    "engine",
    "serving",
]
