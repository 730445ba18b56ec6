"""Functions of version 0.1 whose arguments are others now, which go with version 0.3: the three other searches."""

from collections.abc import Callable, Sequence
from typing import Any

from harvester.engines.protocol import AnyScene
from harvester.machine.execution import Execution, calls_with_fraction
from harvester.machine.progress import NO_PROGRESS
from harvester.studies.optimum.circuits import KEY
from harvester.studies.optimum.objective import POWER
from harvester.studies.optimum.optimise import POINTS, Texts, optimise
from harvester.studies.optimum.ranges import Range, Vary, ranges


def optimise_circuits(
    scene: AnyScene,
    circuits: Sequence[str],
    over: Vary,
    engine: Any = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    **files: Any,
) -> Any:
    """`optimise` of the best circuit, each over the same keys."""
    vary: list[Range | str] = [*ranges(over), f"{KEY}={','.join(circuits)}"]
    return optimise(scene, vary=vary, engine=engine, within=within, budget=budget, execution=_execution(**files))


def optimise_robust(
    scene: AnyScene,
    over: Vary,
    vary: Texts = (),
    share: float | str | None = None,
    limits: Sequence[str] = (),
    engine: Any = None,
    *,
    lifetime: float | str | None = None,
    within: float | str = 0.01,
    budget: float | str = 60.0,
    **files: Any,
) -> Any:
    """`optimise` for most devices and under limits."""
    aim: dict[str, Any] = {
        "objective": POWER if share is None else share,
        "constraints": limits,
        "spread": vary,
        "lifetime": lifetime,
    }
    return optimise(scene, vary=over, engine=engine, within=within, budget=budget, execution=_execution(**files), **aim)


def pareto(
    scene: AnyScene,
    over: Vary,
    aim: str,
    vary: Texts = (),
    share: float | str | None = None,
    limits: Sequence[str] = (),
    engine: Any = None,
    *,
    points: int = POINTS,
    **options: Any,
) -> Any:
    """`optimise` with a second aim."""
    files = {name: options.pop(name) for name in ("out", "tick", "vector") if name in options}
    aims = [aim] if share is None else [share, aim]
    asked = {"constraints": limits, "spread": vary, "points": points, "execution": _execution(**files)}
    return optimise(scene, vary=over, objective=aims, engine=engine, **asked, **options)


def _execution(out: Any = None, tick: Callable[[float], object] | None = None, vector: Sequence[str] = ()) -> Execution:
    """How they said how a study is carried out."""
    return Execution(out=out, formats=vector, progress=NO_PROGRESS if tick is None else calls_with_fraction(tick))
