"""The common part of all engines: their base, the checks that a problem is theirs, and the way to an Estimate."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import ClassVar, Self, TypeAlias

from harvester.answers.estimate import UNSETTLED, Estimate
from harvester.arrays import Floats
from harvester.equations.effects import LINEAR, unknown_to
from harvester.equations.power_bound import PowerBound, power_bound
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, HarvesterError, InputError, answer_or_error
from harvester.linear.record_doubts import join_change
from harvester.presentation.diagnostic import Diagnostic, has, refusal, warning
from harvester.presentation.engine_look import EngineLook
from harvester.scene.scene import Scene
from harvester.uncertainty.value import Value

Progress = Callable[[float], None]  # is called with the fraction done
# Warnings that say which part of an error is not known.
ERROR_TOLD = ("within_not_promised", "ideal_elements", "compiled_circuit", "rare_hops")
# a scene, the problem made of it, or the path of a scene file
AnyScene: TypeAlias = Scene | Problem | str | Path


class Engine:
    """The base of all engines: their common part, and the abilities of each.

    Studies, figures and pages ask for an engine's abilities, never for its name or its class.
    """

    NAME: ClassVar[str]
    LOOK: ClassVar[EngineLook] = EngineLook("")
    # samples nothing, and solves many scenes for little more than one
    is_formula: ClassVar[bool] = False
    is_exact: ClassVar[bool] = False  # its only error is rounding
    # means over trajectories, so that more of them make the error smaller
    samples: ClassVar[bool] = False
    # of the power in the keys of a scene, without noise: run_with_slopes
    has_gradient: ClassVar[bool] = False
    # samples nothing; states the error of its resolution, for which is `within`
    is_resolved: ClassVar[bool] = False
    has_first_passages: ClassVar[bool] = False  # of a displacement: their rate, without sampling
    takes_netlists: ClassVar[bool] = False
    needs_netlist: ClassVar[bool] = False  # serves nothing else
    # in processes of their own; it alone sees all nodes of a circuit
    runs_ngspice: ClassVar[bool] = False
    chooses: ClassVar[bool] = False  # another engine for each scene, whose name its answer has
    by_mean_current: ClassVar[bool] = False  # of a rectifier: what is behind it is computed alone
    has_frequency_response: ClassVar[bool] = False
    # from the periodic response of one drive to that of a neighbour: run_from
    follows_periods: ClassVar[bool] = False
    next_fidelity: ClassVar[str | None] = None  # the engine that leaves less out of the model
    share_of_time: ClassVar[float] = 1.0  # beside other engines on the same scene

    @property
    def at_many_points(self) -> Self:
        """The engine as it computes many points, if nobody asked for an accuracy."""
        return self

    @classmethod
    def refusal(cls, problem: Problem) -> Diagnostic | None:
        """Why the engine does not support a problem, and one that does; None if it does."""
        return None

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene.

        An engine has this or `run_many` of its own.
        """
        answer = self.run_many([scene])[0]
        if isinstance(answer, HarvesterError):
            raise answer
        return answer

    def with_seed(self, seed: int) -> Self:
        """The engine with another seed; itself if it draws nothing."""
        return self

    def many_at_once(self, problem: Problem) -> int:
        """How many scenes like this one `run_many` computes together, for less than one by one."""
        return 1

    def run_many(
        self, scenes: Sequence[AnyScene], seeds: Sequence[int] | None = None
    ) -> list[Estimate | HarvesterError]:
        """`run` for each scene, or the error that it raises; ``seeds`` are one for each.

        A scene's answer depends neither on the others nor on how many there are.
        """
        engines = [self] * len(scenes) if seeds is None else [self.with_seed(s) for s in seeds]
        return [
            answer_or_error(engine.run, scene)
            for engine, scene in zip(engines, scenes, strict=True)
        ]

    def continues(self, problem: Problem) -> bool:
        """Whether it finds the answer to such a problem sooner from that of a neighbouring one, and the same answer."""
        return False

    def run_continued(self, scenes: Sequence[AnyScene]) -> list[Estimate | HarvesterError]:
        """`run_many`, each from the answer before if it `continues`."""
        return self.run_many(scenes)


def served(engine: type[Engine], scene: AnyScene) -> Problem:
    """The problem of a scene that an engine supports.

    CannotServeError with the reason if it does not.
    """
    problem = Problem.of(scene)
    if (reason := engine.refusal(problem)) is not None:
        raise CannotServeError(reason)
    return problem


def needs_resistance(problem: Problem, engine: str) -> Diagnostic | None:
    """Why an engine for load resistances does not support a netlist.

    None if the load is not one.
    """
    return problem.load.refused_by_formulas(engine)


def needs_known_effects(
    problem: Problem, engine: type[Engine], unserved: frozenset[str]
) -> Diagnostic | None:
    """Why an engine for load resistances does not support a netlist, or effects that it does not know; None: it can."""
    effects = " and ".join(name for name in problem.effects if name in unserved)
    without = needs_resistance(problem, engine.NAME)
    if without is not None or not effects:
        return without
    numbers = {
        "linear_only": engine.is_exact,
        "linear": unknown_to(LINEAR).isdisjoint(problem.effects),
    }
    return refusal("unserved_effects", engine.NAME, engine=engine.NAME, effects=effects, **numbers)


def unknown_effects(
    problem: Problem, unserved: frozenset[str], who: str, instead: str
) -> Diagnostic | None:
    """Why ``who`` does not support a scene with effects that it does not know.

    None if it knows all.
    """
    unknown = [name for name in problem.effects if name in unserved]
    return (
        refusal("unknown_effects", who=who, effects=" and ".join(unknown), instead=instead)
        if unknown
        else None
    )


def needs_circuit(problem: Problem, engine: str) -> Diagnostic | None:
    """Why an engine of circuits, which supports nothing else, does not support a problem.

    None if it may.

    Raises InputError for a netlist without a solution.
    """
    if (reason := problem.load.refused_by_circuits(engine)) is not None:
        return reason
    from harvester.circuits.solvability import check_solvable

    check_solvable(problem.load_circuit)
    return None


def needs_compiled_circuit(problem: Problem, engine: str) -> Diagnostic | None:
    """Why an engine does not support a netlist, of whose elements no compiled circuit is made.

    None if it can.
    """
    from harvester.circuits.compiled_circuit import compiled_circuit

    try:
        compiled_circuit(problem.load_circuit, problem.scales)
    except InputError as error:
        return refusal("needs_compiled_circuit", engine, engine=engine, why=str(error))
    return None


def impossible_power(problem: Problem, power: Value, bound: PowerBound | None) -> Diagnostic | None:
    """A warning of a mean power (nondimensional) below 0, or surely above the ``bound`` of all devices."""
    watts = problem.units.watts
    unit = "W" if problem.physical else ""
    if power.value < 0.0:
        return warning("negative_power", power=power.value * watts, unit=unit)
    least = (power.value * (1.0 - 1e-9) - power.known_error95) * watts
    if bound is not None and least > bound.value:
        return warning(
            "power_above_bound",
            power=power.value * watts,
            bound=bound.value,
            unit=unit,
            why=str(bound.why),
        )
    return None


def _not_yet_said(diagnostics: Sequence[Diagnostic], power: Value) -> list[Diagnostic]:
    """A warning that a part of the power's error is not known, unless one of the ``diagnostics`` states it."""
    said = has(diagnostics, *UNSETTLED, *ERROR_TOLD)
    return [warning("error_unknown", part=power.unknown)] if power.unknown and not said else []


def estimate(
    engine: str,
    problem: Problem,
    v2: Value,
    power: Value | None,
    diagnostics: Iterable[Diagnostic | None],
    seconds: float,
    steps: int = 0,
    details: dict[str, float] | None = None,
    samples: Floats | None = None,
    power_samples: Floats | None = None,
) -> Estimate:
    """The answer in the scene's units, from a nondimensional E[V^2] and, if it is not beta mu E[V^2], E[P].

    To its ``diagnostics`` (None: nothing to report) come those of the scene.
    """
    eqs = problem.equations
    units = problem.units
    shocks = problem.events
    join = join_change(eqs)
    if power is None:  # E[P] = beta mu E[V^2] (paper, Eq. 31)
        power = v2.scaled((eqs.beta or 0.0) * (eqs.load or 0.0))
    v2, power = (mean.with_model(join) for mean in (v2, power))
    remarks = [diagnostic for diagnostic in diagnostics if diagnostic is not None]
    gives = has(remarks, "netlist_gives")
    bound = None if gives else power_bound(problem)
    impossible = None if gives else impossible_power(problem, power, bound)
    remarks += [] if impossible is None else [impossible]
    remarks += _not_yet_said(remarks, power)
    of_scene = [*problem.value_warnings, *(() if shocks is None else shocks.diagnostics)]
    return Estimate(
        engine=engine,
        physical=problem.physical,
        mean_square_voltage=v2.scaled(units.volts**2),
        mean_power=power.scaled(units.watts),
        nondimensional={
            "mean_square_voltage": v2.value,
            "mean_power": power.value,
            "beta": eqs.beta,
            "mu": eqs.mu,
        },
        effects=problem.present_effects,
        seconds=seconds,
        steps=steps,
        diagnostics=(*of_scene, *remarks),
        details=details or {},
        samples=samples,
        power_samples=None if power_samples is None else power_samples * units.watts,
        events=shocks,
        bound=bound,
    )
