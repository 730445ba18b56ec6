"""The settings at which each engine is measured, and their names in the table."""

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar, cast

from harvester.engines import Ensemble, Spice
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.studies.work_precision.cost_table import TARGETS
from harvester.studies.work_precision.ngspice_bias import TOLERANCES

ALONE = "spice alone"
# that an engine may lack
PARTS = {"CONTROLS": "no controls", "PAIRING": "no pairing", "SETTLED": "from rest"}
# beside the default of an engine whose error is that of its resolution
ACCURACIES = (1e-2, 1e-3, 1e-7)
FACTORS = (0.5, 1.0, 2.0, 4.0)  # of the default step

Sampler = Ensemble | Spice
Kind = TypeVar("Kind", Ensemble, Spice)


def label(engine: Engine) -> str:
    """The name of an engine in the table.

    Ngspice alone has one of its own, and so has an engine that lacks a part.
    """
    if engine.runs_ngspice and cast(Spice, engine).alone:
        return ALONE
    return ", ".join(
        [engine.NAME, *(text for part, text in PARTS.items() if not getattr(engine, part, True))]
    )


def base_name(name: str) -> str:
    """The name of the engine with all its parts, of the label of one that lacks a part."""
    return name.partition(", ")[0]


def without(kind: type[Kind], part: str) -> type[Kind]:
    """The engine without one of `PARTS`."""
    return cast(type[Kind], type(kind.__name__, (kind,), {part: False}))


def without_each_part(kind: type[Ensemble], with_ngspice: bool, problem: Problem) -> list[Sampler]:
    """The cheap model and, if it was ``with_ngspice``, ngspice, each without one part that makes a mean cheaper.

    Only those that the scene's means have: controls need noise that is new from step to step,
    settled starts a netlist.
    """
    eqs = problem.equations
    if not eqs.is_random:
        return []
    parts = {"CONTROLS": eqs.has_new_noise, "PAIRING": True}
    parts["SETTLED"] = problem.netlist is not None and not eqs.is_shaken_otherwise
    kinds: list[type[Sampler]] = [without(kind, "CONTROLS")] if eqs.has_new_noise else []
    kinds += [without(Spice, part) for part, present in parts.items() if present and with_ngspice]
    return [kind(within=target) for target in TARGETS for kind in kinds]


def setting(engine: Engine) -> str:
    """The options of an engine that differ from its defaults, as a user would write them."""
    options = []
    for option in dataclasses.fields(engine):  # type: ignore[arg-type]
        value = getattr(engine, option.name)
        if value != option.default and option.name not in ("seed", "budget", "alone"):
            options.append(option.name if value is True else f"{option.name}={value:.4g}")
    return " ".join(options) or "default"


def resolved(engine: Any) -> list[Any]:
    """Settings of an engine whose error is that of its resolution: accuracies."""
    return [dataclasses.replace(engine, within=within) for within in ACCURACIES]


def ensembles(kind: type[Ensemble], step: float) -> list[Sampler]:
    """Settings of the cheap model about its default ``step``: steps and sizes, between easy and hard targets."""
    grid = [kind(dt=f * step, trajectories=n) for n in (256, 1024, 4096) for f in FACTORS]
    return _between([kind(within=target) for target in TARGETS], grid)


def paired(step: float, netlist: bool) -> list[Sampler]:
    """Settings of ngspice with its control variate: steps, and tolerances of a netlist, between the targets."""
    grid = [Spice(dt=f * step, trajectories=8) for f in FACTORS]
    grid += [Spice(reltol=r) for r in TOLERANCES if netlist and r != Spice.reltol]
    return _between([Spice(within=target) for target in TARGETS], grid)


def first_alone(burn_in: float | None) -> Spice:
    """The first run of ngspice alone: short.

    With few trajectories if the cheap model knows no burn-in.
    """
    return (
        Spice(alone=True, trajectories=4)
        if burn_in is None
        else Spice(alone=True, duration=burn_in)
    )


def alone(step: float, duration: float, netlist: bool) -> list[Sampler]:
    """Settings of ngspice alone, from a first run's: longer, other noise, steps and tolerances, then the targets."""
    longer = 4.0 * duration
    grid: list[Sampler] = [
        Spice(alone=True, duration=longer),
        Spice(alone=True, duration=longer, gaussian=True),
    ]
    grid += [Spice(alone=True, duration=longer, dt=f * step) for f in reversed(FACTORS) if f != 1.0]
    grid += [
        Spice(alone=True, duration=longer, reltol=r)
        for r in reversed(TOLERANCES)
        if netlist and r != Spice.reltol
    ]
    return [*grid, *(Spice(alone=True, within=target, duration=longer) for target in TARGETS)]


def _between(targets: Sequence[Sampler], grid: Sequence[Sampler]) -> list[Sampler]:
    """The settings in the order in which they are measured: two easy targets, the grid, two hard targets."""
    return [*targets[:2], *grid, *targets[2:]]
