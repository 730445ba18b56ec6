"""The engines of a frequency response: which there are, and which of their options it uses."""

import dataclasses
from collections.abc import Sequence

from harvester.engines import ENGINES, selection
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import Named
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, named_once

BUDGET = 20.0  # seconds of a point by ngspice
CIRCUIT_OPTIONS = frozenset({"probe", "ledger"})  # of `Spice`, which a response has no room for
# of the others: they choose step, time and trajectories at each frequency
USED = frozenset({"seed"})


def engines_of(
    scene: AnyScene, engines: Sequence[Named] | None, seed: int = 0, budget: float | None = None
) -> list[Engine]:
    """The engines of a response: by default `Exact` for a linear scene, `Spice` for a netlist, else `Ensemble`.

    ``budget`` is the time of a point by `Spice`, in seconds, by default `BUDGET`.

    Raises InputError for an unknown engine, one named twice, an option that a response does not
    use, and a budget without `Spice`; CannotServeError for an engine that gives no response.
    """
    named = [selection.default_engine(Problem.of(scene))] if engines is None else engines
    made = [
        _responding(choice, seed, budget)
        for choice in ([named] if isinstance(named, str) else named)
    ]
    named_once([engine.NAME for engine in made], "`engine`")
    if budget is not None and not any(engine.runs_ngspice for engine in made):
        ours = " and ".join(repr(engine.NAME) for engine in made)
        raise InputError(
            f"`budget` must be left out with engine {ours}, but is given: it is an option of 'spice'"
        )
    return made


def _responding(choice: Named, seed: int, budget: float | None) -> Engine:
    """The engine that is named, with the seed, and the time of a point by ngspice.

    Refusals as of `engines_of`.
    """
    engine = selection.engine(choice)
    if not engine.has_frequency_response:
        known = ", ".join(
            repr(name) for name, kind in ENGINES.items() if kind.has_frequency_response
        )
        raise CannotServeError(
            f"`engine` {engine.NAME!r} has no frequency response, as its formulas are for noise: use {known}"
        )
    if ignored := _ignored(engine):
        raise InputError(ignored)
    if not isinstance(choice, str) or engine.is_exact:
        return engine
    options = {"budget": BUDGET if budget is None else budget} if engine.runs_ngspice else {}
    return selection.engine(engine, seed=seed, **options)


def _ignored(engine: Engine) -> str:
    """Why an engine's options are refused: those that are given and that a response does not use.

    Empty without.
    """
    fields = dataclasses.fields(engine)  # type: ignore[arg-type]
    given = [field.name for field in fields if getattr(engine, field.name) != field.default]
    unused = [
        name
        for name in given
        if (name in CIRCUIT_OPTIONS if engine.runs_ngspice else name not in USED)
    ]
    if not unused:
        return ""
    names = ", ".join(f"`{name}`" for name in unused)
    verb, pronoun = ("are", "them") if len(unused) > 1 else ("is", "it")
    return (
        f"{names} must be left out of engine {engine.NAME!r} for a frequency response, "
        f"but {verb} given: a response does not use {pronoun}"
    )
