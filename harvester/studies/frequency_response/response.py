"""Frequency response under a harmonic excitation: power, voltage, displacement and phases against the frequency.

A linear scene is solved in closed form, whose peak is then resolved between the frequencies of the
sweep (`closed_form`).  Other scenes are followed up the frequencies and down again by engine
`ensemble`, or `ideal` with a circuit of ideal elements (`continued`); engine `spice` follows the
periodic response (`by_ngspice`).

Long because two public functions explain their arguments to users.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from pathlib import Path
from typing import cast

from harvester.engines import Compiled, Ensemble, Exact, Spice
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import Named
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, names_arguments
from harvester.machine.automatic import reporting
from harvester.machine.progress import ProgressCallback
from harvester.presentation.diagnostic import without_repeats
from harvester.studies.frequency_response.by_ngspice import by_ngspice, directions
from harvester.studies.frequency_response.closed_form import closed_form, power_at, resolved
from harvester.studies.frequency_response.continued import continued
from harvester.studies.frequency_response.curve import Failure, FrequencyResponse
from harvester.studies.frequency_response.driven import HarmonicDrive
from harvester.studies.frequency_response.engines import engines_of
from harvester.studies.frequency_response.responses import FrequencyResponses
from harvester.studies.frequency_response.steps import ResponseJournal, Steps, response_journal
from harvester.studies.output_folder import OutputFolder, provenance_with_engines
from harvester.studies.sweep.points import Points, axis_of, grid, read_axis

LEAST, MOST = 3, 10_000  # frequencies
Values = str | Sequence[float | str]
Sweep = str | Sequence[float]  # the text of `frequencies`, or these themselves
# called with the engine's name after each of the frequencies asked for, each way
Callback = Callable[[str], None]


def frequencies(problem: Problem, text: str) -> tuple[float, ...]:
    """The ascending frequencies of a text ``FROM:TO:COUNT``, in Hz (nondimensional scene: rad).

    They are spaced by ratio if the ends differ tenfold.

    Raises InputError for anything else.
    """
    parts = text.split(":")
    if (
        len(parts) != 3
        or not re.fullmatch("[0-9]{1,5}", parts[2])
        or not LEAST <= int(parts[2]) <= MOST
    ):
        raise invalid(
            "`sweep`",
            f"be FROM:TO:COUNT with a COUNT from {LEAST} to {MOST}, such as 1Hz:10Hz:60",
            text,
        )
    key = "excitation.frequency" if problem.physical else "nondimensional.drive_frequency"
    values = sorted(read_axis(f"{key}={text}").values)
    if values[0] == values[-1]:
        raise invalid("`sweep`", "be between two different frequencies", text)
    return tuple(values)


def _frequencies(problem: Problem, sweep: Sweep) -> tuple[float, ...]:
    return frequencies(problem, sweep) if isinstance(sweep, str) else tuple(sweep)


def points_of(scene: AnyScene, vary: Mapping[str, Values] | Points | None) -> Points | None:
    """The combinations of the varied keys' values.

    InputError for the frequency, and for impossible values.
    """
    if not vary:
        return None
    problem = Problem.of(scene)
    points = (
        vary
        if isinstance(vary, Points)
        else grid([axis_of(key, some) for key, some in vary.items()])
    )
    swept = HarmonicDrive(problem).frequency_key
    if swept in points.keys:
        raise InputError(f"`vary` must leave out {swept}, which `sweep` varies, but names it")
    points.check(problem.scene)
    return points


def rows_of(
    scene: AnyScene, engines: Sequence[Engine], frequencies: int, points: Points | None
) -> dict[str, int]:
    """How often progress is reported for each engine: up and down, or once by ngspice and a linear mass."""
    curves = 1 if points is None else len(points)
    ways = len(directions(HarmonicDrive(Problem.of(scene))))
    return {e.NAME: curves * frequencies * (ways if e.follows_periods else 2) for e in engines}


@names_arguments
def response(
    scene: AnyScene,
    sweep: Sweep,
    seed: int = 0,
    report: Callback | None = None,
    engine: Named | None = None,
    *,
    progress: ProgressCallback | bool | None = None,
) -> FrequencyResponse:
    """The response of a scene with a harmonic excitation at several frequencies.

    Parameters
    ----------
    scene : Scene or path
        a `Scene` with a harmonic excitation, or the path of a scene file.
    sweep : str or list of float
        frequencies in Hz (nondimensional scene: rad), or a text FROM:TO:COUNT such as "3Hz:9Hz:61".
        With a text, a response in closed form has more points than that: its peak, its half-power
        points and some between.
    seed : int, default 0
        the same seed, the same noise.
    report : callable, optional
        is called with the engine's name after each frequency.
    engine : Engine or str, optional
        an engine or its name, as of `responses`.
    progress : callable or bool, optional
        is called with the fraction that is done; by default, or if True, a bar on a terminal or in
        a notebook, and none if False.

    Returns
    -------
    FrequencyResponse
        a point for each frequency and direction, up and down.

    Raises
    ------
    InputError
        for a scene without a harmonic excitation.
    CannotServeError
        for an engine that does not support the scene.
    SimulationError
        if the response grows without bound.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> round(hv.response(scene, "0.8:1.2:5").peak("up").frequency, 3)  # between those of the text
    1.008
    """
    engines = None if engine is None else [engine]
    return responses(scene, sweep, None, engines, seed, report, progress=progress).curves[0]


@names_arguments
def responses(
    scene: AnyScene,
    sweep: Sweep,
    vary: Mapping[str, Values] | Points | None = None,
    engines: Sequence[Named] | None = None,
    seed: int = 0,
    report: Callback | None = None,
    *,
    progress: ProgressCallback | bool | None = None,
) -> FrequencyResponses:
    """The responses for all combinations of the values of scene keys, and by each of some engines.

    Parameters
    ----------
    scene : Scene or path
        a `Scene` with a harmonic excitation, or the path of a scene file.
    sweep : str or list of float
        frequencies, as of `response`.
    vary : mapping or Points, optional
        keys and their values, as of `sweep`: {"load.resistance": "10k:1M:3"}.
    engines : list of Engine or str, optional
        engines or their names: "exact", "ensemble", "ideal", "compiled" and "spice"; by default
        "exact" for a linear scene, "spice" for a netlist, else "ensemble".  "spice" by its name has
        a budget for each point.
    seed : int, default 0
        the same seed, the same noise.
    report : callable, optional
        is called with the engine's name after each frequency.
    progress : callable or bool, optional
        is called with the fraction that is done; by default, or if True, a bar on a terminal or in
        a notebook, and none if False.

    Returns
    -------
    FrequencyResponses
        a curve for each combination of values and each engine.

    Raises
    ------
    InputError
        for a scene without a harmonic excitation, and a key or value that no scene has.
    CannotServeError
        for an engine that does not support the scene.
    SimulationError
        if the response grows without bound.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.2, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0))
    >>> [curve.engine for curve in hv.responses(scene, [0.9, 1.0], {"nondimensional.mu": [0.5, 2.0]}).curves]
    ['exact', 'exact']
    """
    problem = Problem.of(scene)
    HarmonicDrive(problem)
    chosen = engines_of(problem, engines, seed)
    points = points_of(problem, vary)
    rows = rows_of(problem, chosen, len(_frequencies(problem, sweep)), points)
    calls = count(1)

    def tell(name: str) -> None:
        """Report a frequency, and to ``share`` the fraction of all that are done."""
        (share or _nothing)(next(calls) / sum(rows.values()))
        (report or _nothing)(name)

    with reporting(progress, "response") as share:
        return _responses(problem, sweep, points, chosen, tell)


def _nothing(_: object) -> None:
    """Report nothing."""


def _responses(
    problem: Problem,
    sweep: Sweep,
    points: Points | None,
    engines: Sequence[Engine],
    report: Callback,
    report_reused: Callback = _nothing,
    journal: ResponseJournal | None = None,
) -> FrequencyResponses:
    """All curves; each step is written to the ``journal`` at once, and those that were there call ``report_reused``."""
    several = (
        [dict[str, float]()] if points is None else [points.varied(k) for k in range(len(points))]
    )
    curves = list[FrequencyResponse]()
    for number, values in enumerate(several):
        driven = HarmonicDrive(Problem(problem.scene.varied(values)) if values else problem)
        for index, engine in enumerate(engines):
            computed, reused = partial(report, engine.NAME), partial(report_reused, engine.NAME)
            steps = Steps(on_computed=computed)
            if journal is not None:
                steps = journal.steps(number, index, engine.NAME, computed, reused)
            curves.append(_curve(engine, driven, sweep, values, steps))
    return FrequencyResponses(tuple(curves))


def _curve(
    engine: Engine, driven: HarmonicDrive, sweep: Sweep, varied: Mapping[str, float], steps: Steps
) -> FrequencyResponse:
    """One response by one engine."""
    problem = driven.problem
    resolving = isinstance(sweep, str)
    swept = _frequencies(problem, sweep)
    failures = list[Failure]()
    warnings = driven.diagnostics(swept)
    if engine.is_exact:
        if reason := Exact.refusal(problem):
            raise CannotServeError(reason)
        points = closed_form(
            driven, resolved(lambda f: power_at(driven, f), swept) if resolving else swept
        )
        for _ in range(2 * len(swept)):
            steps.on_computed()
    elif engine.follows_periods:
        points, failures, more = by_ngspice(cast(Spice | Compiled, engine), driven, swept, steps)
        warnings = without_repeats([*warnings, *more])
    else:
        # or derived from it: engines_of checks
        points = continued(cast(Ensemble, engine), driven, swept, steps)
    is_resolved = resolving and engine.is_exact
    return FrequencyResponse(
        tuple(points),
        problem.physical,
        remarks=tuple(warnings),
        resolved=is_resolved,
        engine=engine.NAME,
        level=driven.level,
        varied=dict(varied),
        failures=tuple(failures),
    )


def draw(
    scene: AnyScene,
    sweep: Sweep,
    out: str | Path | None,
    seed: int = 0,
    report: Callback | None = None,
    vector: Sequence[str] = (),
    vary: Mapping[str, Values] | Points | None = None,
    engines: Sequence[Named] | None = None,
    per_g: bool = False,
    resume: bool = False,
    report_reused: Callback | None = None,
) -> FrequencyResponses:
    """Compute `responses`, and into the folder ``out`` write their files.

    These are response.csv, response.png, its ``vector`` forms (svg, pdf) and provenance.json.
    ``per_g`` draws power and voltage over the base's amplitude.  Each frequency that is done is in
    response.journal until then; ``resume`` uses those of an earlier run that was interrupted, and
    calls ``report_reused`` (default: ``report``) for each.

    Raises as `responses`, and InputError for an earlier response that was another one.
    """
    problem = Problem.of(scene)
    report = report or _nothing
    HarmonicDrive(problem)
    if per_g and not problem.physical:
        raise InputError(
            "`per_g` must be used with a physical scene, whose base has an acceleration, but is given"
        )
    chosen = engines_of(problem, engines, seed)
    points = points_of(problem, vary)
    if out is None:
        return _responses(problem, sweep, points, chosen, report)
    swept = _frequencies(problem, sweep)
    # which takes no time
    folder = OutputFolder(out, vector)
    counted = [e for e in chosen if not e.is_exact]
    total = sum(rows_of(problem, counted, len(swept), points).values())
    varied = (
        {} if points is None else {"vary": {axis.key: list(axis.values) for axis in points.axes}}
    )
    about = provenance_with_engines(problem, chosen, sweep=list(swept), **varied)
    with response_journal(folder.path, about, resume, total) as journal:
        result = _responses(
            problem,
            sweep,
            points=points,
            engines=chosen,
            report=report,
            report_reused=report_reused or report,
            journal=journal,
        )
        drawn = result.plot(problem.scene.name, per_g)
        folder.save("response", result.table.csv(), drawn, about)
    return result
