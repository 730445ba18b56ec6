"""The public function of a sweep: from keys and values, as a user writes them, to the points that are computed."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from harvester.engines.protocol import AnyScene
from harvester.engines.selection import Named, default_engines
from harvester.engines.selection import engines as engines_of
from harvester.equations.problem import Problem
from harvester.errors import InputError, names_arguments
from harvester.studies.sweep.compute import compute_table
from harvester.studies.sweep.points import Axis, Points, axis_of, grid
from harvester.studies.sweep.table import SweepTable

Values = str | Sequence[float | str]  # "1k:10M:25", or numbers in SI units and texts with their unit


@names_arguments
def sweep(
    scene: AnyScene,
    over: str | Mapping[str, Values] | Points | Sequence[Axis],
    values: Values | None = None,
    engines: Sequence[Named] | None = None,
    out: str | Path | None = None,
    *,
    resume: bool = False,
    tick: Callable[[str], None] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    vector: Sequence[str] = (),
) -> SweepTable:
    """Run every engine at every value of a scene key, or on the grid of several keys.

    ``over`` is a key and ``values`` its values, or a mapping of keys to values: numbers in SI units, texts with their
    unit ("1 kohm"), or one text FROM:TO:COUNT as on the command line.  ``engines`` are engines or their names, by
    default `Exact` for a linear scene, `Spice` for a netlist, else all that serve it.  ``out`` is a folder for
    sweep.csv, sweep.nc, sweep.png and provenance.json; without it nothing is left on the disk.  ``workers`` (processes;
    None: one a core where there is work for them), ``resume``, ``tick``, ``scheduler`` and ``vector`` are those of
    `harvester.studies.sweep.compute.compute_table`.

    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, D11=0.01))
    >>> table = hv.sweep(scene, "nondimensional.mu", [0.5, 1.0, 2.0], engines=[hv.Averaged()])
    >>> table.column("mean_power", "averaged").round(5).tolist()
    [0.00274, 0.00323, 0.0028]

    Raises
    ------
    InputError
        for a key that no scene has, a value that it cannot take, or a folder that cannot be written.
    HarvesterError
        where every point failed, the last error.
    """
    if isinstance(over, str) != (values is not None):
        said = "is left out" if isinstance(over, str) else "is given"
        raise InputError(f"values must go with a single key, but {said}")
    axes: Points | Sequence[Axis]
    if isinstance(over, str):
        assert values is not None
        axes = [axis_of(over, values)]
    else:
        axes = [axis_of(key, some) for key, some in over.items()] if isinstance(over, Mapping) else over
    if not isinstance(axes, Points) and not axes:
        raise InputError("a sweep must have a key to vary, but has none")
    problem = Problem.of(scene)
    return compute_table(
        problem.scene,
        axes if isinstance(axes, Points) else grid(axes),
        engines_of(default_engines(problem) if engines is None else engines),
        out,
        resume=resume,
        tick=tick,
        workers=workers,
        scheduler=scheduler,
        vector=vector,
    )
