"""Circuit-level co-simulation of vibro-impact piezoelectric energy harvesters.

    import harvester as hv
    scene = hv.load("examples/plate_with_stop.toml")
    print(hv.Averaged().run(scene))
    print(hv.Ensemble(within="1%").run(scene))

What a name needs is loaded when the name is first used, so that the program's help is there at once.
"""

import importlib
from typing import TYPE_CHECKING, Any

# The one public function whose name a module has, too (`from harvester.sweep import ...`): first come, first served.
from harvester.sweep import sweep as sweep

if TYPE_CHECKING:
    from harvester.engines import Averaged, Cheapest, Ensemble, Ideal, Published, Spice
    from harvester.errors import CannotServeError, HarvesterError, InputError, MissingProgramError, SimulationError
    from harvester.estimate import Estimate, Value
    from harvester.optimum.answer import Optimum
    from harvester.response_table import Response
    from harvester.scene import (
        Excitation,
        Load,
        Netlist,
        Nondimensional,
        OppositeStop,
        Oscillator,
        Piezo,
        Scene,
        Stop,
        load,
        loads,
    )
    from harvester.spaced import linspace, logspace
    from harvester.studies.compare import Comparison, compare
    from harvester.studies.motion import Motion, motion
    from harvester.studies.optimise import optimise
    from harvester.studies.response import response
    from harvester.studies.stability import Stability, stability
    from harvester.sweeps.table import Table

__all__ = [
    "Averaged",
    "CannotServeError",
    "Cheapest",
    "Comparison",
    "Ensemble",
    "Estimate",
    "Excitation",
    "HarvesterError",
    "Ideal",
    "InputError",
    "Load",
    "MissingProgramError",
    "Motion",
    "Netlist",
    "Nondimensional",
    "OppositeStop",
    "Optimum",
    "Oscillator",
    "Piezo",
    "Published",
    "Response",
    "Scene",
    "SimulationError",
    "Spice",
    "Stability",
    "Stop",
    "Table",
    "Value",
    "compare",
    "linspace",
    "load",
    "loads",
    "logspace",
    "motion",
    "optimise",
    "response",
    "stability",
    "sweep",
]
__version__ = "0.1.0"

_NAMES = {
    "harvester.engines": "Averaged Cheapest Ensemble Ideal Published Spice",
    "harvester.errors": "CannotServeError HarvesterError InputError MissingProgramError SimulationError",
    "harvester.estimate": "Estimate Value",
    "harvester.optimum.answer": "Optimum",
    "harvester.response_table": "Response",
    "harvester.scene": "Excitation Load Netlist Nondimensional OppositeStop Oscillator Piezo Scene Stop load loads",
    "harvester.spaced": "linspace logspace",
    "harvester.studies.compare": "Comparison compare",
    "harvester.studies.motion": "Motion motion",
    "harvester.studies.optimise": "optimise",
    "harvester.studies.response": "response",
    "harvester.studies.stability": "Stability stability",
    "harvester.sweeps.table": "Table",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


if not TYPE_CHECKING:  # a type checker would take every name for one of ours

    def __getattr__(name: str) -> Any:
        if name not in _MODULES:
            raise AttributeError(f"module 'harvester' has no attribute {name!r}")
        value = globals()[name] = getattr(importlib.import_module(_MODULES[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
