"""The public function of a sweep: from keys and values, as a user writes them, to the points that are computed."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from harvester.engines.compiled import Compiled
from harvester.engines.ideal import Ideal
from harvester.engines.protocol import AnyScene, Engine
from harvester.engines.selection import ALL, Named, check_engine, default_engines, serving
from harvester.engines.selection import engines as engines_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.machine.automatic import called
from harvester.machine.execution import DEFAULT, Execution
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.points import Axis, Points, Values, axes_of, grid
from harvester.studies.sweep.sweep_table import SweepTable


@names_arguments
def sweep(
    scene: AnyScene,
    *,
    vary: Mapping[str, Values] | Points | Sequence[Axis | str] | str,
    engines: Sequence[Named] | str | None = None,
    execution: Execution = DEFAULT,
    common_noise: bool = False,
) -> SweepTable:
    """Run every engine at every value of a scene key, or on the grid of several keys.

    Parameters
    ----------
    scene : Scene or path
        a `Scene`, or the path of a scene file.
    vary : mapping or Points or list of Axis or str, or str
        scene keys, such as "load.resistance", and their values: numbers in SI units, texts with
        their unit ("1 kohm"), or one text FROM:TO:COUNT as on the command line, such as
        "1k:10M:25", whose values each are the same multiple of the one before. Texts have the form
        of the command line, such as "load.resistance=1k:10M:25".
    engines : list of Engine or str, or str, optional
        engines or their names; "all" for those that support the scene.  By default `Exact` for a
        linear scene, for a netlist `Spice` next to `Ideal`, else `Ensemble` next to the formulas,
        which `Density`, or `Spice` to 5 %, checks at a third of the points, at most three.  For a
        netlist `Ideal`, else `Compiled`, is computed in place of formulas.
    execution : Execution, optional
        who computes, how progress is shown, and the folder for sweep.csv, sweep.nc, sweep.png and
        provenance.json; without a folder nothing is left on the disk.
    common_noise : bool, default False
        let all points have the same noise, so that differences between points have a smaller error;
        by default each point has independent noise.

    Returns
    -------
    SweepTable
        a row for each point and engine, in SI units (nondimensional scene: without units); a point
        that failed has its reason in place of numbers.

    Raises
    ------
    InputError
        for a key that no scene has, a value that it cannot have, or a folder that cannot be
        written.
    HarvesterError
        if every point failed, the last error.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> table = hv.sweep(scene, vary={"nondimensional.mu": [0.5, 1.0, 2.0]}, engines=[hv.Averaged()])
    >>> table.column("mean_power", "averaged").round(5).tolist()
    [0.00274, 0.00323, 0.0028]
    """
    if not isinstance(vary, Points) and not vary:
        raise InputError(
            "`vary` must have a scene key, such as {'load.resistance': '1k:10M:25'}, but has none"
        )
    problem = Problem.of(scene)
    axes = vary if isinstance(vary, Points) else axes_of(vary, problem.scene.tables())
    points = axes if isinstance(axes, Points) else grid(axes)
    which = chosen(points.middle(problem.scene), engines)
    with called("sweep"):
        return compute_table(
            problem.scene,
            points,
            engines_of(which.engines),
            execution,
            in_place_of=which.stand_ins,
            common_noise=common_noise,
            check=which.check,
        )


class SweepEngines(NamedTuple):
    """The engines of a sweep, the formulas that each replaces, and which one checks the others at few points."""

    engines: Sequence[Named]
    stand_ins: dict[str, list[str]]
    check: str | None


def chosen(problem: Problem, which: Sequence[Named] | None) -> SweepEngines:
    """The engines that are asked for, all that support the scene for `ALL`, or those of a sweep if none are."""
    if which:
        everybody = which == ALL or list(which) == [ALL]
        return SweepEngines(*for_circuit(problem, serving(problem) if everybody else which), None)
    check = check_engine(problem)
    named, stand_ins = for_circuit(problem, default_engines(problem))
    checks = [] if check is None else [check]
    return SweepEngines([*named, *checks], stand_ins, None if check is None else check.NAME)


def for_circuit(
    problem: Problem, which: Sequence[Named]
) -> tuple[Sequence[Named], dict[str, list[str]]]:
    """Engines whose answers share one figure, and for each that is in place of formulas the names of these.

    No formula knows a netlist: in their place is the circuit of ideal elements, `Ideal`, else
    `Compiled`.
    """
    which = [which] if isinstance(which, str | Engine) else which
    known = dict(zip(which, engines_of(which), strict=True))
    formulas = [
        engine.NAME
        for engine in known.values()
        if engine.is_formula and problem.load.refused_by_formulas(engine.NAME)
    ]
    instead = [
        kind.NAME for kind in (Ideal, Compiled) if formulas and kind.refusal(problem) is None
    ][:1]
    if not instead:
        return which, {}
    others = [named for named, engine in known.items() if not engine.is_formula]
    return [*({*instead} - {known[named].NAME for named in others}), *others], {
        instead[0]: formulas
    }
