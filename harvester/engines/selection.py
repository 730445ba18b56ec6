"""Which engines there are, which support a problem and why the others do not, which are the default; and `run`."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any, TypeAlias, TypedDict, Unpack, overload

from harvester.answers.estimate import Estimate
from harvester.engines.averaged import Averaged
from harvester.engines.cheapest import Cheapest, is_slow
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import AnyScene, Engine, Progress
from harvester.engines.published import Published
from harvester.engines.slow import Slow
from harvester.engines.spice.spice import Spice
from harvester.equations.problem import Problem
from harvester.errors import (
    HarvesterError,
    InputError,
    OutOfTimeError,
    UnknownArgumentError,
    unknown,
)
from harvester.machine.automatic import reporting
from harvester.presentation.diagnostic import Diagnostic, note, refusal
from harvester.presentation.engine_look import LOOKS

Named: TypeAlias = Engine | str  # an engine, or the name of one
ENGINES: dict[str, type[Engine]] = {
    engine.NAME: engine
    for engine in (Exact, Published, Averaged, Density, Ensemble, Ideal, Compiled, Slow, Spice)
}
LOOKS.update({name: engine.LOOK for name, engine in ENGINES.items()})


class EngineOptions(TypedDict, total=False):
    """The options of engines (`MonteCarloOptions`, `Spice`); each engine has its own."""

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


@overload
def run(  # type: ignore[overload-overlap]  # a text is the path of one file
    scene: AnyScene,
    engine: Named | None = ...,
    *,
    progress: Progress | bool | None = ...,
    **options: Unpack[EngineOptions],
) -> Estimate: ...


@overload
def run(
    scene: Sequence[AnyScene],
    engine: Named | None = ...,
    *,
    progress: Progress | bool | None = ...,
    **options: Unpack[EngineOptions],
) -> list[Estimate]: ...


def run(
    scene: AnyScene | Sequence[AnyScene],
    engine: Named | None = None,
    *,
    progress: Progress | bool | None = None,
    **options: Unpack[EngineOptions],
) -> Estimate | list[Estimate]:
    """Compute the stationary mean power and mean square voltage of a scene.

    Parameters
    ----------
    scene : Scene, path or list of these
        The scene, or the path of a scene file. A list returns a list of estimates in the same order.
    engine : Engine or str, optional
        Name such as "spice", or an engine object such as ``hv.Spice(within="1%")``. Default: with
        ``within`` the cheapest engine that reaches it; otherwise `Exact` if it supports the scene,
        `Slow` for a chip behind a rectifier, `Spice` for other netlists, and `Ensemble`.
    progress : callable or bool, optional
        Called with the completed fraction, from 0 to 1.  By default a bar on a terminal or in a
        notebook, if the computation lasts longer than a second; False: none.
    options
        Options of the engine, by keyword; listed below.

    Other Parameters
    ----------------
    within : float or str
        Target relative error (95 %), 0.01 or "1%".
    budget : float or str
        Time limit in seconds, 30 or "30s". Default: none.
    seed : int
        Random seed. Default: 0.
    trajectories : int
        Number of trajectories. Sampling engines only.
    duration : float or str
        Averaging time of each trajectory (s; 1/w0 for a nondimensional scene).
    dt : float or str
        Time step, in the unit of the duration.
    probe : list of str
        Circuit quantities to report, such as ["store", "i(d1)"]. `Spice` and `Compiled` only.
    ledger : bool
        Also report the power of each circuit element. `Spice` and `Compiled` only.
    reltol : float
        Relative tolerance of ngspice. `Spice` only.
    alone : bool
        Plain averages of ngspice runs from rest, without variance reduction. `Spice` only.
    gaussian : bool
        Gaussian noise in place of the three-point noise of `Ensemble`, with ``alone``. `Spice` only.

    Returns
    -------
    Estimate
        Mean power (W) and mean square voltage (V^2) with their errors; dimensionless for a
        nondimensional scene. A list of scenes gives a list.

    Raises
    ------
    InputError
        Unknown engine or option (with the nearest match), or an option that the engine does not use.
    CannotServeError
        The engine does not support the scene; the message names one that does.
    SimulationError
        The response is unbounded, or the circuit does not converge. For several scenes the first error
        is raised; a note of its traceback gives the index of the scene.

    See Also
    --------
    sweep, optimise, compare

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.run(scene).engine, f"{hv.run(scene, 'published').mean_power:.5f}"
    ('exact', '0.00331')
    >>> [f"{answer.mean_power:.5f}" for answer in hv.run([scene.vary("mu", mu) for mu in (0.5, 1.0, 2.0)])]
    ['0.00274', '0.00323', '0.00280']
    """
    if isinstance(scene, Sequence) and not isinstance(scene, str):
        with reporting(progress, "run") as report:
            return _run_all(scene, engine, report, options)
    problem = Problem.of(scene)
    chosen = default_engine(problem, **options) if engine is None else engine
    (made,) = engines([chosen], **options)
    with reporting(progress, made.NAME) as report:
        return answer_of(made, problem, report)


def sooner(chosen: Engine, scene: AnyScene) -> tuple[str, ...]:
    """The engine that answers sooner than ngspice with the same circuit; () for none."""
    if not isinstance(chosen, Spice) or chosen.probe or chosen.ledger:
        return ()
    return (Slow.NAME,) if is_slow(Problem.of(scene)) else ()


def answer_of(chosen: Engine, scene: AnyScene, progress: Progress | None = None) -> Estimate:
    """The answer of an engine, whose notes name one that answers sooner; raises as its `run`."""
    names = sooner(chosen, scene)
    try:
        answer = chosen.run(scene, progress)
    except OutOfTimeError as error:
        if not names:
            raise
        late = refusal("late_where_slow_serves", why=str(error), other=names[0])
        raise OutOfTimeError(str(late)) from None
    remarks = (note("slow_serves", other=name) for name in names)
    return dataclasses.replace(answer, diagnostics=(*answer.diagnostics, *remarks))


def _run_all(
    scenes: Sequence[AnyScene],
    engine: Named | None,
    progress: Progress | None,
    options: EngineOptions,
) -> list[Estimate]:
    """`run` of each scene."""
    answers: list[Estimate] = []
    for k, scene in enumerate(scenes):
        try:
            answers.append(
                run(scene, engine, progress=partial(_share, progress, k, len(scenes)), **options)
            )
        except HarvesterError as error:
            error.add_note(f"at index {k} of {len(scenes)} scenes")
            raise
        _share(progress, k, len(scenes), 1.0)
    return answers


def _share(progress: Progress | None, index: int, count: int, done: float) -> None:
    """Report how far a list is, if one of its entries is so far."""
    if progress is not None:
        progress((index + done) / count)


def refusals(scene: AnyScene) -> dict[str, Diagnostic | None]:
    """Every engine with the reason why it does not support a scene, None if it does.

    An engine that is about netlists only is not listed for another load.
    """
    problem = Problem.of(scene)
    return {
        name: kind.refusal(problem)
        for name, kind in ENGINES.items()
        if not (kind.needs_netlist and problem.load.refused_by_circuits(name))
    }


def serving(scene: AnyScene) -> list[str]:
    """Names of the engines that support a scene, the fastest first."""
    return [name for name, reason in refusals(scene).items() if reason is None]


def default_engine(scene: AnyScene, **options: Any) -> str:
    """The engine if none is named: the cheapest to reach ``within``, else `Exact`, or one that samples.

    `Spice` looks into the circuit, as ``probe`` and ``ledger`` ask for, and knows its errors.

    That is if `Exact` does not support the scene, or the ``options`` are those of sampling.
    """
    given = {name for name, value in options.items() if value is not None}
    if given & {"probe", "ledger"}:
        return Spice.NAME
    if "within" in given:
        return Cheapest.NAME
    problem = Problem.of(scene)
    if problem.netlist is not None and not given - {*_options(Slow)} and is_slow(problem):
        return Slow.NAME
    return (
        default_sampler(problem)
        if Exact.refusal(problem) or given - {*_options(Exact)}
        else Exact.NAME
    )


def default_sampler(scene: AnyScene) -> str:
    """The engine that samples if none is named: `Spice` for a netlist, else `Ensemble`."""
    return Spice.NAME if Ensemble.refusal(Problem.of(scene)) else Ensemble.NAME


ENGINE_OF_CIRCUITS = Spice.NAME  # where circuits are compared


ALL = "all"  # in place of engines: those that support the scene
CHECKED = 0.05  # relative error of a check by ngspice


def default_engines(scene: AnyScene) -> list[str]:
    """The engines at every point of a sweep: the default, next to those that cost little.

    With a resistor these are formulas; for a linear scene `Exact` is alone.  No formula knows the
    circuit power: next to `Spice` is the circuit of ideal diodes and switches, `Ideal`, if
    there is one.
    """
    problem = Problem.of(scene)
    default, all_of_them = default_engine(problem), serving(problem)
    beside = {Ideal.NAME} if default == Spice.NAME else set()
    if default == Ensemble.NAME:
        beside = {name for name in all_of_them if ENGINES[name].is_formula}
    return [*(name for name in all_of_them if name in beside - {default}), default]


def check_engine(scene: AnyScene) -> Engine | None:
    """The engine that checks `Ensemble` at few points of a sweep; None for other defaults.

    `Density` under white noise, which samples nothing, else ngspice to an error of `CHECKED`.
    """
    problem = Problem.of(scene)
    if default_engine(problem) != Ensemble.NAME:
        return None
    if not problem.equations.coloured and Density.refusal(problem) is None:
        return Density()
    return Spice(within=CHECKED) if Spice.refusal(problem) is None else None


def engine(which: Named, **options: Any) -> Engine:
    """An engine by its name, with its options; an engine is given back with the options replaced.

    Raises InputError for an unknown name or option, with the nearest match, and for an option that
    this engine would ignore.
    """
    return engines([which], **options)[0]


def engines(which: Sequence[Named], **options: Any) -> list[Engine]:
    """Several engines, each with those of the options that it has.

    InputError for an option that none of them has, which would be ignored.
    """
    which = [which] if isinstance(which, str | Engine) else which
    kinds = [_kind(named) for named in which]
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        _check_option(name, kinds)
    made = []
    for named, kind in zip(which, kinds, strict=True):
        its_options: Any = {name: value for name, value in given.items() if name in _options(kind)}
        made.append(
            kind(**its_options)
            if isinstance(named, str)
            else dataclasses.replace(named, **its_options)  # type: ignore[type-var]
        )
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
        raise unknown("option of an engine", name, everybody, UnknownArgumentError)
    if not any(name in _options(kind) for kind in kinds):
        those = ", ".join(repr(known) for known, kind in ENGINES.items() if name in _options(kind))
        ours = " and ".join(repr(kind.NAME) for kind in kinds)
        raise InputError(
            f"`{name}` must be left out with engine {ours}, but is given: it is an option of {those}"
        )


def _options(kind: type[Engine]) -> list[str]:
    return [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
