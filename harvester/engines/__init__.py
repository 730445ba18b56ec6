"""The engines: scene -> Estimate.  What each computes, what it serves, what error it states."""

import dataclasses
from typing import Any

from harvester.engines.common import Engine, Progress, Vectorised
from harvester.engines.ensemble import Ensemble
from harvester.engines.formulas import Averaged, Published
from harvester.engines.spice import READING, Spice
from harvester.errors import unknown

__all__ = [
    "ENGINES",
    "READING",
    "Averaged",
    "Engine",
    "Ensemble",
    "Progress",
    "Published",
    "Spice",
    "Vectorised",
    "engine",
]

ENGINES: dict[str, type[Published] | type[Averaged] | type[Ensemble] | type[Spice]] = {
    engine.NAME: engine for engine in (Published, Averaged, Ensemble, Spice)
}


def engine(name: str, **options: Any) -> Engine:
    """An engine by its name; ``options`` (see `Ensemble`) are checked for all and used by those that sample.

    Raises InputError for an unknown name, with the nearest match, or an option out of range.
    """
    if name not in ENGINES:
        raise unknown("engine", name, ENGINES)
    Ensemble(**options)  # refuses a wrong option, also where the engine samples nothing and needs none
    kind = ENGINES[name]
    return kind(**{field.name: options[field.name] for field in dataclasses.fields(kind) if field.name in options})
