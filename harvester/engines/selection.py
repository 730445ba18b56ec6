"""Which engines there are, which serve a problem and why the others do not, which are the default; and `run`."""

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeAlias, TypedDict, Unpack

from harvester.answers.estimate import Estimate
from harvester.engines.averaged import Averaged
from harvester.engines.cheapest import Cheapest
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import AnyScene, Engine, Progress
from harvester.engines.published import Published
from harvester.engines.spice.spice import Spice
from harvester.equations.problem import Problem
from harvester.errors import InputError, unknown
from harvester.presentation.diagnostic import Diagnostic
from harvester.presentation.engine_look import LOOKS

Named: TypeAlias = Engine | str  # an engine, or the name of one
ENGINES: dict[str, type[Engine]] = {
    engine.NAME: engine for engine in (Exact, Published, Averaged, Density, Ensemble, Ideal, Compiled, Spice)
}
LOOKS.update({name: engine.LOOK for name, engine in ENGINES.items()})


class EngineOptions(TypedDict, total=False):
    """The options of engines (`harvester.engines.options.MonteCarloOptions`, `Spice`); each engine takes its own."""

    within: float | str | None
    budget: float | str | None
    seed: int
    duration: float | str | None
    dt: float | str | None
    trajectories: int | None
    alone: bool
    reltol: float
    gaussian: bool
    probe: Sequence[str]
    ledger: bool


def run(
    scene: AnyScene, engine: Named | None = None, *, progress: Progress | None = None, **options: Unpack[EngineOptions]
) -> Estimate:
    """The stationary mean square voltage and mean power of a scene, with their errors.

    ``scene`` may be the path of a scene file; ``engine`` a name; without it, ``within`` chooses the cheapest engine
    that is known to reach it, and else it is `Exact` where that serves, `Spice` for a netlist, and `Ensemble`.
    ``options`` are the engine's, such as ``within="1%"``.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.run(scene).engine, f"{hv.run(scene, 'published').mean_power.value:.5f}"
    ('exact', '0.00331')

    Raises
    ------
    InputError
        for an unknown engine or option, with the nearest match, and an option that the engine would ignore.
    HarvesterError
        of the engine.
    """
    problem = Problem.of(scene)
    chosen = default_engine(problem, **options) if engine is None else engine
    return engines([chosen], **options)[0].run(problem, progress)


def refusals(scene: AnyScene) -> dict[str, Diagnostic | None]:
    """Every engine with the reason why it cannot serve a scene, None where it can.

    An engine that is about netlists only is not listed for another load.
    """
    problem = Problem.of(scene)
    about = [name for name in ENGINES if problem.netlist is not None or not ENGINES[name].needs_netlist]
    return {name: ENGINES[name].refusal(problem) for name in about}


def serving(scene: AnyScene) -> list[str]:
    """Names of the engines that serve a scene, the fastest first."""
    return [name for name, reason in refusals(scene).items() if reason is None]


def default_engine(scene: AnyScene, **options: Any) -> str:
    """The engine where none is named: the cheapest to reach ``within``, else `Exact`, or one that samples.

    `Spice` alone looks into the circuit, as ``probe`` and ``ledger`` ask for.

    That is where `Exact` does not serve the scene, or the ``options`` are those of sampling.
    """
    given = {name for name, value in options.items() if value is not None}
    if given & {"probe", "ledger"}:
        return Spice.NAME
    if "within" in given:
        return Cheapest.NAME
    problem = Problem.of(scene)
    return default_sampler(problem) if Exact.refusal(problem) or given - {*_options(Exact)} else Exact.NAME


def default_sampler(scene: AnyScene) -> str:
    """The engine that samples where none is named: `Spice` for a netlist, else `Ensemble`."""
    return Ensemble.NAME if Problem.of(scene).netlist is None else Spice.NAME


ENGINE_OF_CIRCUITS = Spice.NAME  # where circuits are compared


def default_engines(scene: AnyScene) -> list[str]:
    """The engines of a sweep: for a linear scene `Exact` and for a netlist `Spice` alone, else all that serve it."""
    problem = Problem.of(scene)
    default = default_engine(problem)
    return serving(problem) if default == Ensemble.NAME else [default]


def engine(which: Named, **options: Any) -> Engine:
    """An engine by its name, with its options; an engine is given back with the options replaced.

    Raises InputError for an unknown name or option, with the nearest match, and for an option that this engine would
    ignore.
    """
    return engines([which], **options)[0]


def engines(which: Sequence[Named], **options: Any) -> list[Engine]:
    """Several engines, each with those of the options that it has.

    InputError for an option that none of them has, which would be ignored.
    """
    which = [which] if isinstance(which, str) else which
    kinds = [_kind(one) for one in which]
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        _check_option(name, kinds)
    made = []
    for one, kind in zip(which, kinds, strict=True):
        own: Any = {name: value for name, value in given.items() if name in _options(kind)}
        made.append(kind(**own) if isinstance(one, str) else dataclasses.replace(one, **own))  # type: ignore[type-var]
    return made


def _kind(which: Named) -> type[Engine]:
    if not isinstance(which, str):
        return type(which)
    if which not in ENGINES and which != Cheapest.NAME:
        raise unknown("engine", which, ENGINES)
    return ENGINES.get(which, Cheapest)


def _check_option(name: str, kinds: Sequence[type[Engine]]) -> None:
    """Refuse an option that no engine has, or none of these ``kinds``, which would ignore it."""
    everybody = {option for kind in (*ENGINES.values(), Cheapest) for option in _options(kind)}
    if name not in everybody:
        raise unknown("option of an engine", name, everybody)
    if not any(name in _options(kind) for kind in kinds):
        those = ", ".join(repr(known) for known, kind in ENGINES.items() if name in _options(kind))
        ours = " and ".join(repr(kind.NAME) for kind in kinds)
        raise InputError(f"`{name}` must be left out with engine {ours}, but is given: it is an option of {those}")


def _options(kind: type[Engine]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
