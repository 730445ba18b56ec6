"""What all engines share: the protocol, the loads they serve, and the way to an Estimate."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Protocol, runtime_checkable

from harvester.answers.estimate import Estimate
from harvester.equations.scaling import Equations, effects, equations, scales
from harvester.errors import CannotServeError, HarvesterError
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

Progress = Callable[[float], None]  # told the fraction done


class Engine(Protocol):
    """What all engines have in common."""

    NAME: ClassVar[str]

    def run(self, scene: Scene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        ...


@runtime_checkable
class Vectorised(Protocol):
    """An engine that computes many scenes at once for little more than the price of one."""

    NAME: ClassVar[str]

    def run_many(self, scenes: Sequence[Scene]) -> list[Estimate | HarvesterError]:
        """`Engine.run` for each scene, or the error that it raises."""
        ...


def resistive(scene: Scene, engine: str) -> Equations:
    """The equations of a scene whose load is a resistance or none; CannotServeError for a netlist."""
    if scene.load is not None and scene.load.netlist is not None:
        raise CannotServeError(
            f"engine {engine!r} must have a load resistance, but the load is netlist {scene.load.netlist!r}: "
            "use engine 'spice', or 'ideal' for one of the package's netlists"
        )
    return equations(scene)


def refuse(eqs: Equations, unserved: frozenset[str], who: str, instead: str) -> None:
    """CannotServeError where a scene has effects (by the names of `effects`) that ``who`` does not know."""
    found = [name.replace("_", " ") for name in effects(eqs) if name in unserved]
    if found:
        raise CannotServeError(f"{who} does not know {' and '.join(found)}: use {instead}")


def with_power(v2: Value, eqs: Equations) -> Value:
    """E[P] = beta mu E[V^2] (paper, Eq. 31), nondimensional."""
    return v2.scaled((eqs.beta or 0.0) * (eqs.mu or 0.0))


def estimate(
    engine: str,
    scene: Scene,
    eqs: Equations,
    v2: Value,
    power: Value | None,
    seconds: float,
    steps: int,
    reason: str,
    warnings: tuple[str, ...],
    details: dict[str, float] | None = None,
    samples: Any = None,
    power_samples: Any = None,
) -> Estimate:
    """Put a nondimensional E[V^2] and, where it is not beta mu E[V^2], E[P] into the scene's units."""
    power = with_power(v2, eqs) if power is None else power
    s = scales(scene)
    physical = scene.physical
    return Estimate(
        engine=engine,
        physical=physical,
        mean_square_voltage=v2.scaled(s.volts**2) if physical else v2,
        mean_power=power.scaled(s.watts) if physical else power,
        nondimensional={
            "mean_square_voltage": v2.value,
            "mean_power": power.value,
            "beta": eqs.beta,
            "mu": eqs.mu,
        },
        effects=effects(eqs),
        seconds=seconds,
        steps=steps,
        reason=reason,
        warnings=warnings,
        details=details or {},
        samples=samples,
        power_samples=power_samples if power_samples is None or not physical else power_samples * s.watts,
    )
