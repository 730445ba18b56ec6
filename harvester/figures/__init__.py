"""All drawing: each function makes a `Plot` of what `figures.shapes` describes, and `save` writes its files."""

from harvester.figures.comparisons import comparison
from harvester.figures.costs import cost
from harvester.figures.estimates import estimate
from harvester.figures.motions import motion
from harvester.figures.optima import optimum
from harvester.figures.papers import paper
from harvester.figures.regions import region
from harvester.figures.responses import response
from harvester.figures.saved import save
from harvester.figures.style import STYLES, Plot, image, new
from harvester.figures.sweeps import sweep

__all__ = [
    "STYLES",
    "Plot",
    "comparison",
    "cost",
    "estimate",
    "image",
    "motion",
    "new",
    "optimum",
    "paper",
    "region",
    "response",
    "save",
    "sweep",
]
