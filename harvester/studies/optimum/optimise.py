"""The one search for the largest mean power: over loads, circuits and other keys, for most devices, or as a front."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict, Unpack, overload

from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, names_arguments
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.studies.optimum.circuit_choice import best_circuit
from harvester.studies.optimum.front import front
from harvester.studies.optimum.objective import Objective, ObjectiveSpec
from harvester.studies.optimum.optimum_result import Optimum
from harvester.studies.optimum.pareto_front import ParetoFront
from harvester.studies.optimum.ranges import Range, Vary, varied
from harvester.studies.optimum.sampled_front import sampled_front
from harvester.studies.optimum.search import Search, SearchRequest
from harvester.studies.optimum.under_limits import robust_request, under_limits
from harvester.studies.output_folder import OutputFolder, provenance

POINTS, MOST_POINTS = 9, 50  # of a front
Texts = Mapping[str, str] | Sequence[str]


class SearchOptions(TypedDict, total=False):
    """The options of `optimise` whose types are those of the function below its overloads."""

    constraints: Sequence[str] | str
    spread: Texts
    engine: Named | None
    lifetime: float | str | None
    within: float | str
    budget: float | str
    points: int | None
    execution: Execution


@overload
def optimise(
    scene: AnyScene,
    *,
    vary: Vary,
    objective: Literal["mean_power"] = "mean_power",
    **options: Unpack[SearchOptions],
) -> Optimum: ...
@overload
def optimise(
    scene: AnyScene, *, vary: Vary, objective: ObjectiveSpec, **options: Unpack[SearchOptions]
) -> Any: ...
@names_arguments
def optimise(
    scene: AnyScene,
    *,
    vary: Vary,
    objective: ObjectiveSpec = "mean_power",
    constraints: Sequence[str] | str = (),
    spread: Texts = (),
    engine: Named | None = None,
    lifetime: float | str | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    points: int | None = None,
    execution: Execution = DEFAULT,
) -> Optimum | ParetoFront:
    """Find the values of keys with the largest mean power, or its Pareto front with another quantity.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    vary : list of Range or str, or mapping
        each key with the ends of its range, numbers in SI units or texts with their unit, or a text
        such as "1k:10M" or "E24:1k:10M", the values of a series; or a list of texts KEY=LOW:HIGH.
        Several names of "load.netlist" make it choose between circuits, each with its own best
        values of the other keys; all have the ``budget`` each.
    objective : str, float or list of these, default "mean_power"
        "mean_power"; or a fraction such as "5%": the power of which only 5 % of the devices have
        less, whose parts scatter by ``spread``; or a second quantity such as "peak_displacement",
        to be low (with ":high" behind it high), which makes the answer a Pareto front; or a list
        of both.
    constraints : list of str or str, optional
        texts such as "voltage_rms < 2 V".  For a limited quantity the value counts that all but the
        share keep.
    spread, lifetime : mapping, list of str, float or str, optional
        as ``vary`` and ``lifetime`` of `tolerance`; a percentage is of the values of each place.
    engine : Engine or str, optional
        an engine or its name, by default `Exact` for a linear scene, else `Ensemble`, for a netlist
        `Spice`.  With a fraction, constraints or a spread it is one of formulas, by default
        `Exact` if it supports, else `Averaged`; for a front without ``spread`` it may sample as
        well.
    within : float or str, default 0.01
        the relative power error at the optimum (0.01 or "1%"); at the ends of the keys' intervals,
        at most a quarter of it is lost.  Only engines that sample, and `Density`, can work towards
        it.
    budget : float or str, default 60.0
        seconds, compilation included, or a text such as "30s".
    points : int, optional
        the most designs of a front (default: 9).
    execution : Execution, optional
        has the folder for optimise.csv (all evaluations), optimise.png and provenance.json; for
        circuits also of circuits.csv and a folder each; for a front for pareto.csv and pareto.png.

    Returns
    -------
    Optimum
        with the best values and their intervals; a `CircuitChoice` of circuits, a `RobustOptimum`
        with a fraction, constraints or a spread, and a `ParetoFront` with a second quantity.

    Raises
    ------
    InputError
        for a range, an objective, a constraint or a spread that cannot be, the engine 'cheapest', a
        target or a budget out of range, a fraction without a spread, or a folder that cannot be
        written.
    HarvesterError
        if the engine fails everywhere, the last error.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> best = hv.optimise(scene, vary={"nondimensional.mu": (0.1, 10.0)}, engine="averaged")
    >>> f"{best.keys[0].value:.2f}"  # sqrt(1 + beta)
    '1.02'
    """
    target = Objective.of(objective)
    circuits, ranges = varied(vary)
    kind = kind_of_search(vary, objective, constraints, spread, lifetime)
    _check_points(points, target)
    with working_on("optimise", execution) as progress:
        if kind == "circuits":
            return best_circuit(
                scene,
                circuits,
                vary=ranges,
                engine=engine,
                within=within,
                budget=budget,
                execution=execution,
            )
        folder = OutputFolder.of(execution)
        devices_differ = bool(spread) or target.share is not None
        by_samples = target.second is not None and _samples(engine) and not devices_differ
        if kind == "plain" or by_samples:
            request = SearchRequest.of(scene, ranges, engine, within, budget)
        else:
            request = robust_request(
                scene,
                ranges,
                objective=target,
                constraints=constraints,
                spread=spread,
                engine=engine,
                lifetime=lifetime,
                within=within,
                budget=budget,
            )
        if kind == "plain":
            return Search.begin(request, progress).finish(folder)
        if target.second is None:
            return under_limits(request, progress, folder)
        if by_samples:
            answer = sampled_front(request, target.second, constraints, lifetime, progress)
        else:
            answer = front(request, points or POINTS, progress)
        if folder is not None:
            _write_front(folder, answer, Problem.of(scene), ranges, constraints)
        return answer


def _check_points(points: int | None, target: Objective) -> None:
    """Raise InputError for a number of points out of range, and without a second quantity."""
    if points is None:
        return
    if target.second is None:
        raise InputError(
            "`points` must be used with a second quantity in `objective`, but there is none"
        )
    if not 2 <= points <= MOST_POINTS:
        raise invalid("`points`", f"be between 2 and {MOST_POINTS}", points)


def kind_of_search(
    vary: Vary,
    objective: ObjectiveSpec = "mean_power",
    constraints: Sequence[str] | str = (),
    spread: Texts = (),
    lifetime: float | str | None = None,
) -> Literal["circuits", "devices", "plain"]:
    """Whether `optimise` chooses between circuits, computes "devices" by formulas for another objective, or neither.

    Raises InputError for circuits next to such an objective, and for anything that cannot be
    varied.
    """
    circuits, ranges = varied(vary)
    series = any(r.steps for r in ranges)
    special = (
        bool(constraints or spread or series)
        or lifetime is not None
        or Objective.of(objective) != Objective()
    )
    if circuits and special:
        names = "`constraints`, `lifetime`, `spread`, `objective` and series"
        raise InputError(f"{names} must be left out if circuits are compared, but one is given")
    return "circuits" if circuits else "devices" if special else "plain"


def _samples(engine: Named | None) -> bool:
    return engine is not None and not engine_of(engine).is_formula


def _write_front(
    folder: OutputFolder,
    answer: ParetoFront,
    problem: Problem,
    ranges: Sequence[Range],
    constraints: Sequence[str] | str,
) -> None:
    """The files of a front."""
    texts = [constraints] if isinstance(constraints, str) else [*constraints]
    options = {
        "over": {r.key: [r.low, r.high] for r in ranges},
        "pareto": f"{answer.quantity}:{answer.sense}",
    }
    about = provenance(problem, **options, limits=texts, engine=answer.engine)
    folder.save("pareto", answer.table.csv(), answer.plot(problem.scene.name), about)
