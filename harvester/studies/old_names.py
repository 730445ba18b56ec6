"""Functions of version 0.1 whose arguments are others now, which go with version 0.3: the three other searches.

Their other keywords are those of `optimise` in version 0.1 and today.
"""

from collections.abc import Sequence
from typing import Any

from harvester.engines.protocol import AnyScene
from harvester.studies.optimum.objective import POWER
from harvester.studies.optimum.optimise import Texts, optimise
from harvester.studies.optimum.ranges import NETLIST, Range, Vary, ranges


def optimise_circuits(
    scene: AnyScene, circuits: Sequence[str], over: Vary, engine: Any = None, **options: Any
) -> Any:
    """`optimise` of the best circuit, each over the same keys."""
    vary: list[Range | str] = [*ranges(over), f"{NETLIST}={','.join(circuits)}"]
    return optimise(scene, vary=vary, engine=engine, **options)


def optimise_robust(
    scene: AnyScene,
    over: Vary,
    vary: Texts = (),
    share: float | str | None = None,
    limits: Sequence[str] = (),
    engine: Any = None,
    **options: Any,
) -> Any:
    """`optimise` for most devices and under limits."""
    objective = POWER if share is None else share
    return optimise(
        scene,
        vary=over,
        spread=vary,
        objective=objective,
        constraints=limits,
        engine=engine,
        **options,
    )


def pareto(
    scene: AnyScene,
    over: Vary,
    aim: str,
    vary: Texts = (),
    share: float | str | None = None,
    **options: Any,
) -> Any:
    """`optimise` with a second aim."""
    limits = options.pop("limits", ())
    objectives = [aim] if share is None else [share, aim]
    return optimise(
        scene, vary=over, spread=vary, objective=objectives, constraints=limits, **options
    )
