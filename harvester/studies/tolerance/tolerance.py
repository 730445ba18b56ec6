"""The study of tolerances: many devices whose parts scatter, by the cheapest engine that is good enough for it."""

import operator
import time
from collections.abc import Mapping, Sequence
from typing import TypedDict, Unpack

from harvester.engines.options import Request, number
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import Named
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, invalid, names_arguments
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.tolerance import design
from harvester.studies.tolerance import samples as sampling
from harvester.studies.tolerance.circuit_study import BUDGET, CircuitStudy, is_study_of_circuit
from harvester.studies.tolerance.device_limits import PEAKS, Limit, lifetime_of
from harvester.studies.tolerance.device_limits import limits as read_limits
from harvester.studies.tolerance.first_order import FIRST_ORDER, first_order_engine, linear_law
from harvester.studies.tolerance.spreads import PartSpread, spreads
from harvester.studies.tolerance.study import ToleranceRequest, ToleranceRuns, ToleranceStudy
from harvester.studies.tolerance.tolerance_result import ToleranceResult

SAMPLES = 10_000


class ToleranceOptions(TypedDict, total=False):
    """The options of `tolerance` that few studies need."""

    budget: float | str | None
    lifetime: float | str | None


@names_arguments
def tolerance(
    scene: AnyScene,
    *,
    vary: Mapping[str, str] | Sequence[str],
    limits: Sequence[str] | str = (),
    correlate: Mapping[tuple[str, str], float] | Sequence[str] = (),
    engine: Named | None = None,
    samples: int | None = None,
    runs: int | str | None = None,
    checks: int | None = None,
    within: float | str | None = None,
    seed: int = 0,
    execution: Execution = DEFAULT,
    **options: Unpack[ToleranceOptions],
) -> ToleranceResult:
    """How mean power and voltage scatter over devices whose parts have tolerances, and which tolerance matters.

    For all devices the engine computes some, and a polynomial through them, and through the outer
    ends of each spread, represents the others; a formula computes all if it is rough.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    vary : mapping or list of str
        keys and their spreads, such as "10%", "0.94:0.98", "E24:5%", "normal:2%", "triangular:10%"
        or a measured list "1.1,1.3,1.2"; or a list of texts KEY=SPREAD.
    limits : list of str or str, optional
        texts such as "mean_power > 5 uW" of mean_power, mean_square_voltage or voltage_rms, and of
        a scene under white noise peak_displacement, peak_voltage, peak_strain, peak_impact_speed,
        the level that 95 % of such devices stay below over a ``lifetime``, and impact_rate.
    correlate : mapping or list of str, optional
        pairs of keys and their correlation, from -1 to 1.
    engine : Engine or str, optional
        an engine or its name, by default the cheapest whose error is small against the spread.
    samples, runs : int or str, optional
        how many devices (default: 10,000), and how many of them the engine computes (default: 512
        by a formula, else 24 for each key and 24 more).  "first-order": the power is linear
        in each key, by the gradient of engine `Density`, and each key's ends and two more devices
        measure the remainder; for a netlist by the slopes of its cheapest engine, on common noise.
    checks, within : int or float or str, optional
        how many devices are computed again by a more accurate engine (default: 8, by ngspice 4; 0:
        none), and to which relative error.
    seed : int, default 0
        the same seed, the same devices.
    execution : Execution, optional
        has the folder for tolerance.csv, tolerance.png, provenance.json and a folder for each
        sweep, and chooses the workers.
    options : optional
        ``budget``, seconds for a netlist or a text such as "30s": each part alone, then checks and
        samples (default: 60 s); not with ``runs``, ``checks``, ``lifetime`` or ``resume``.  And
        ``lifetime``, seconds (nondimensional scene: 1/w0) or a text such as "5 years".

    Returns
    -------
    ToleranceResult
        quantiles of power and voltage, the yield within the limits, and each key's fraction of the
        variance.

    Raises
    ------
    InputError
        for a key, spread, limit or correlation that cannot be, and a folder that cannot be written.
    HarvesterError
        if the engine fails at every sample, the last error.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> result = hv.tolerance(
    ...     scene, vary={"nondimensional.c1": "20%"}, limits=["mean_power > 0.0033"], samples=1024
    ... )
    >>> f"{result.met.value:.2f}"
    '0.42'
    """
    begin = time.perf_counter()
    problem = Problem.of(scene)
    spread = spreads(vary, problem.scene)
    matrix = design.correlation(correlate, [part.key for part in spread])
    bounds = read_limits(limits, problem.physical)
    folder = OutputFolder.of(execution)
    linear = runs == FIRST_ORDER
    runs = None if runs is None or linear else _count(runs)
    _check_counts(samples, runs, checks)
    lifetime = options.get("lifetime")
    if linear:
        _refuse_beside_first_order(checks, lifetime, execution.resume or None, bounds)
    years = lifetime_of(bounds, lifetime, problem)
    middle = _middle(problem, spread)
    if linear:
        chosen = first_order_engine(middle, engine, within, seed)
    else:
        chosen = engine_of(sampling.cheapest(middle)(seed=seed) if engine is None else engine)
    _check_served(chosen, middle)
    effort = Request(within=within, budget=options.get("budget"))
    count = SAMPLES if samples is None else samples
    request = ToleranceRequest(
        scene=problem.scene,
        spreads=spread,
        matrix=matrix,
        limits=bounds,
        lifetime=years,
        samples=count,
        runs=runs,
        checks=checks,
        within=number(effort.within),
        seed=seed,
    )
    budget = _budget(chosen, request, number(effort.budget), linear, execution.resume)
    with working_on("tolerance", execution):
        if budget is not None:
            fills = effort.budget is not None
            law = CircuitStudy(request, execution, budget, draws=not linear, fills=fills)
            computed = law.run(chosen)
        else:
            computed = _compute(request, chosen, execution, linear, by_default=engine is None)
        answer = ToleranceResult.of(request, computed, time.perf_counter() - begin)
    if folder is not None:
        correlations = None if matrix is None else matrix.tolist()
        texts = {
            "vary": {s.key: s.written for s in spread},
            "limits": [limit.written for limit in bounds],
        }
        about = provenance(
            problem,
            seed=seed,
            engine=answer.engine,
            **texts,
            correlate=correlations,
            runs=FIRST_ORDER if linear else runs,
            budget=budget,
        )
        folder.save("tolerance", answer.table.csv(), answer.plot(problem.scene.name), about)
    return answer


def _refuse_beside_first_order(
    checks: int | None, lifetime: float | str | None, resume: bool | None, bounds: Sequence[Limit]
) -> None:
    if peaks := [limit.quantity for limit in bounds if limit.quantity in PEAKS]:
        raise InputError(
            f"`limits` must have no peaks with `runs` {FIRST_ORDER!r}, but have {peaks[0]}"
        )
    for name, given in (("checks", checks), ("lifetime", lifetime), ("resume", resume)):
        if given is not None:
            raise InputError(f"`{name}` must be left out with `runs` {FIRST_ORDER!r}, but is given")


def _middle(problem: Problem, spread: Sequence[PartSpread]) -> Problem:
    """The device in the middle of all spreads: a spread gives a scene parts that it may not have itself."""
    values = design.values_at(spread, design.one_by_one(len(spread))[:1])[0]
    keys = [part.key for part in spread]
    return Problem.of(problem.scene.varied(dict(zip(keys, map(float, values), strict=True))))


def _check_served(chosen: Engine, problem: Problem) -> None:
    if chosen.chooses:
        raise InputError(
            "`engine` must be one for all samples, such as 'averaged', but is 'cheapest'"
        )
    if reason := chosen.refusal(problem):
        raise InputError(reason)


def _count(runs: int | str) -> int:
    """The number of ``runs``; InputError for another text."""
    wrong = invalid("`runs`", f"be a whole number or {FIRST_ORDER!r}", runs)
    if isinstance(runs, bool):
        raise wrong
    try:
        return int(runs) if isinstance(runs, str) else operator.index(runs)
    except (TypeError, ValueError):
        raise wrong from None


def _compute(
    request: ToleranceRequest, chosen: Engine, execution: Execution, linear: bool, by_default: bool
) -> ToleranceRuns:
    """The runs of a study by a ``linear`` law, or by a polynomial.

    An engine ``by_default`` is replaced by a more accurate one if its error is not small.
    """
    if linear:
        return linear_law(request, chosen, execution.progress)
    study = ToleranceStudy(request, OutputFolder.of(execution), execution)
    if not by_default:
        return study.run(chosen)
    chosen = sampling.unjudged(chosen)
    computed = study.run(chosen)
    better = sampling.dearer(chosen, seed=request.seed, within=request.within)
    return computed if better is None or computed.samples.small else study.run(better)


def _budget(
    chosen: Engine, request: ToleranceRequest, budget: float | None, linear: bool, resume: bool
) -> float | None:
    """The budget (s) of a study of a netlist without counts, peaks and rows to resume.

    None of another.

    Raises InputError for a ``budget`` that is given to another study.
    """
    excluded = {
        "runs": request.runs is not None or (linear and budget is not None),
        "checks": request.checks is not None,
        "lifetime": request.lifetime is not None,
        "resume": resume,
    }
    others = [name for name, is_present in excluded.items() if is_present]
    is_circuit = is_study_of_circuit(chosen)
    if budget is not None and not is_circuit:
        raise InputError(
            f"`budget` must be left out with engine {chosen.NAME!r}, but is given: it is for "
            "netlists by an engine such as 'slow'; `runs` limits other studies"
        )
    if budget is not None and others:
        raise InputError(f"`{others[0]}` must be left out if `budget` is given, but is given")
    if not is_circuit or others:
        return None
    return BUDGET if budget is None else budget


def _check_counts(samples: int | None, runs: int | None, checks: int | None) -> None:
    """InputError for a number of devices that is out of range."""
    for name, count in (("samples", samples), ("runs", runs)):
        if count is not None and not design.LEAST <= count <= design.MOST:
            raise invalid(f"`{name}`", f"be between {design.LEAST} and {design.MOST}", count)
    if checks is not None and not (checks == 0 or 2 <= checks <= 1000):
        raise invalid("`checks`", "be 0, or between 2 and 1000", checks)
