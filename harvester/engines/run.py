"""The shortest way to an answer: a scene, maybe an engine, and what is asked of it."""

from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.protocol import AnyScene, Progress
from harvester.engines.selection import Named, default_engine
from harvester.engines.selection import engine as engine_of
from harvester.equations.problem import Problem


def run(scene: AnyScene, engine: Named | None = None, *, progress: Progress | None = None, **options: Any) -> Estimate:
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
    return engine_of(chosen, **options).run(problem, progress)
