"""The engines: scene -> Estimate.  What each computes, what it serves, what error it states."""

import dataclasses
from typing import Any

from harvester.engines.cheapest import Cheapest
from harvester.engines.ensemble import Ensemble
from harvester.engines.formulas import Averaged, Published
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import Engine, Progress, Vectorised
from harvester.engines.spice.spice import Spice
from harvester.equations.scaling import effects, equations
from harvester.errors import unknown
from harvester.scene.scene import Scene

__all__ = [
    "ENGINES",
    "Averaged",
    "Cheapest",
    "Engine",
    "Ensemble",
    "Ideal",
    "Progress",
    "Published",
    "Spice",
    "Vectorised",
    "candidates",
    "engine",
    "serving",
]

ENGINES: dict[str, type[Published] | type[Averaged] | type[Ensemble] | type[Spice]] = {
    engine.NAME: engine for engine in (Published, Averaged, Ensemble, Ideal, Spice)
}


def engine(name: str, **options: Any) -> Engine:
    """An engine by its name; ``options`` (see `Spice`) are checked for all and used by those that have them.

    Raises InputError for an unknown name, with the nearest match, or an option out of range.
    """
    if name not in ENGINES and name != Cheapest.NAME:
        raise unknown("engine", name, ENGINES)
    Spice(**options)  # refuses a wrong option, also where the engine samples nothing and needs none
    kind = ENGINES.get(name, Cheapest)
    return kind(**{field.name: options[field.name] for field in dataclasses.fields(kind) if field.name in options})


def candidates(scene: Scene) -> list[str]:
    """Names of the engines to try on a scene: all, but `ideal` only where there is a netlist to idealise."""
    netlist = scene.load is not None and scene.load.netlist is not None
    return [name for name in ENGINES if netlist or name != Ideal.NAME]


def serving(scene: Scene) -> list[str]:
    """Those of the `candidates` whose theory knows all effects of a scene."""
    present = set(effects(equations(scene)))
    return [name for name in candidates(scene) if not present & getattr(ENGINES[name], "UNSERVED", frozenset())]
