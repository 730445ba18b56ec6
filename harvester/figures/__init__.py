"""All drawing: each function makes a `Plot` of a result, whose class it is written for.

The names are in ``__init__.pyi``; matplotlib is loaded when one of them is first used.  A result
finds its drawing in `DRAWINGS` by the name of its class.
"""

from typing import Any

import lazy_loader

from harvester.machine.imports import load_elsewhere

DRAWINGS = {
    "ChargingResult": "charging",
    "Comparison": "comparison",
    "Cosimulation": "cosimulation",
    "Cost": "cost",
    "Densities": "densities",
    "DesignResult": "design",
    "Estimate": "estimate",
    "FrequencyResponse": "response",
    "FrequencyResponses": "response",
    "IdentificationResult": "identification",
    "Motion": "motion",
    "NodeResult": "node",
    "Optimum": "optimum",
    "PaperFigure": "paper",
    "ParetoFront": "front",
    "RecordAnswer": "record",
    "Stability": "region",
    "SweepTable": "sweep",
    "ToleranceResult": "tolerance",
}
_loaded, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name in __all__:
        # which would take the look of figures from a file matplotlibrc
        load_elsewhere("matplotlib")
    return _loaded(name)
