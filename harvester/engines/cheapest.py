"""No engine asked for, but an accuracy: the cheapest one that is known to reach it."""

import contextlib
import dataclasses
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from harvester.answers.estimate import Estimate
from harvester.engines.averaged import Averaged
from harvester.engines.compiled import Compiled
from harvester.engines.density import Density
from harvester.engines.ensemble import Ensemble
from harvester.engines.exact import Exact
from harvester.engines.formula import Formula
from harvester.engines.options import MonteCarloOptions, number
from harvester.engines.protocol import AnyScene, Engine, Progress
from harvester.engines.slow import Slow
from harvester.engines.spice.spice import Spice
from harvester.equations.effects import SEVERAL_MODES
from harvester.equations.problem import Problem
from harvester.errors import (
    HarvesterError,
    InputError,
    MissingProgramError,
    SimulationError,
    UnboundedResponseError,
)
from harvester.netlists.part import CircuitPart
from harvester.presentation.diagnostic import has, note

SLOW_SHARE = 0.5  # of what is left, for the slow circuit: no effort makes its error smaller
AGAIN = 1.5  # times its seconds that must be left for an engine to run again
PASSIVE = frozenset({"r", "c", "l", "d"})
# nondimensional time in which a passive circuit charges, up to which no slow circuit is called for
LONG = 300.0
LEAST = 0.1  # part of a budget: if less is left, no further engine begins
SHORTEST = 0.1  # s of a budget
FINER_THAN_SAMPLING = 1e-4  # relative errors at which the density itself is cheaper than any sample


class Cheapest(MonteCarloOptions, Engine):
    """`Exact` if it supports the scene, `Averaged` if its own error allows it, else `Ensemble`.

    For a netlist `Slow` for a chip, `Compiled` if no circuit of ideal elements can be paired with
    ngspice, and `Spice` for others, or if their stated error is too large.

    If ``within`` is finer than sampling reaches in reasonable time, `Density` in place of
    `Ensemble`, if it supports the scene.

    The answer is that engine's, and states why.  `Published` does not know the model error, and
    `Ideal` only after its run.

    Examples
    --------
    >>> import harvester as hv
    >>> scene = hv.Scene(nondimensional=hv.Nondimensional(c1=-0.05, beta=0.05, mu=1.0, D11=0.01))
    >>> hv.Cheapest(within="5%").run(scene).engine
    'exact'

    Parameters
    ----------
    within, budget, seed, duration, trajectories, dt : float or str or int, optional
        the options of `run`.

    Raises
    ------
    InputError
        without ``within``.
    HarvesterError
        of the engine that was chosen.
    """

    NAME = "cheapest"
    chooses = True

    def run(self, scene: AnyScene, progress: Progress | None = None) -> Estimate:
        """The stationary mean square voltage and mean power of a scene."""
        problem = Problem.of(scene)
        within = number(self.within)
        if within is None:
            raise InputError("`within` must be given if no engine is, but is left out")
        if not problem.load.is_in_equations:
            return self._of_netlist(problem, within, progress)
        kind = formula(problem)
        try:
            quick = kind(within=within).run(problem)
        except HarvesterError as error:
            if kind is Exact:
                raise
            return _because(
                self._unaveraged(problem, progress), "refused", within, refused=str(error)
            )
        power = quick.mean_power
        stated = power.known_error95 / abs(power.value) if power.value else 0.0
        if stated <= within:
            return _because(quick, "reached", within, stated)
        return _because(self._unaveraged(problem, progress), "beyond", within, stated, kind.NAME)

    def _of_netlist(self, problem: Problem, within: float, progress: Progress | None) -> Estimate:
        """The answer of the first engine that reaches ``within``, or of the one that comes closest.

        Each has the rest of the budget, and gives it up if it is seen not to reach the target; the
        closest one then continues with the rest.  Raises the first engine's error if none answers.
        """
        budget = number(self.budget)
        end = math.inf if budget is None else time.perf_counter() + budget
        tried: list[Tried] = []
        failed: list[HarvesterError] = []
        kinds = self._for_netlist(problem)
        for k, kind in enumerate(kinds):
            left = end - time.perf_counter()
            if tried and left < LEAST * (budget or 0.0):
                break
            is_last = k == len(kinds) - 1
            share = SLOW_SHARE if kind is Slow and not is_last else 1.0
            engine = self._as(kind, share * left, gives_up=not is_last or bool(tried))
            answer = _answer_or_error(engine, problem, progress, is_first=not tried)
            if isinstance(answer, HarvesterError):
                failed.append(answer)
                continue
            tried.append(Tried(kind, answer))
            if tried[-1].stated <= within:
                return self._chosen(tried, "reached")
            if has(answer.diagnostics, "within_record_join"):  # an error that all engines have
                return self._chosen(tried, "closest")
        if not tried:
            raise failed[0]
        again = min(tried, key=lambda attempt: (attempt.needed, attempt.stated))
        left = end - time.perf_counter()
        if again.needed < math.inf and AGAIN * again.answer.seconds < left < math.inf:
            with contextlib.suppress(SimulationError):
                answer = self._as(again.kind, left).run(problem, progress)
                tried.append(Tried(again.kind, answer))
        return self._chosen(tried, "closest")

    def _chosen(self, tried: "Sequence[Tried]", why: str) -> Estimate:
        """The answer with the smallest error, and why; with the seconds that other engines need."""
        within = number(self.within) or 0.0
        best = min(tried, key=lambda attempt: attempt.stated)
        if best.stated <= within:
            why = "reached"
        needed = {
            f"needed_{attempt.kind.NAME}": attempt.needed
            for attempt in tried
            if attempt.needed < math.inf and (why == "closest" or attempt.kind is not best.kind)
        }
        error = best.stated if best.stated < math.inf else None
        return _because(best.answer, why, within, error, needed=needed)

    def _for_netlist(self, problem: Problem) -> list[type[Slow | Compiled | Spice]]:
        """The engines for a netlist, the cheapest first; `Spice` always knows its error.

        A record repeats in ngspice until the response does, which may last longer than a budget and
        leave `Compiled` nothing of it.
        """
        kinds: list[type[Slow | Compiled | Spice]] = []
        free = (self.trajectories, self.duration, self.dt) == (None, None, None)
        if free and is_slow(problem):
            kinds.append(Slow)
        if Compiled.refusal(problem) is not None:
            return [*kinds, Spice]
        if stands_alone(problem) or problem.equations.record is not None:
            return [*kinds, Compiled, Spice]
        return [*kinds, Spice, Compiled]

    def _as(
        self, kind: type[Slow | Compiled | Spice], left: float, gives_up: bool = False
    ) -> Engine:
        """An engine with those of the options that it has, and the seconds that are ``left``."""
        names = {field.name for field in dataclasses.fields(kind)}
        given = {name: value for name, value in vars(self).items() if name in names}
        budget = None if math.isinf(left) else max(round(left, 1), SHORTEST)
        engine = kind(**{**given, "budget": budget})
        return engine.giving_up() if gives_up else engine

    def _unaveraged(self, problem: Problem, progress: Progress | None) -> Estimate:
        """The answer of `Density` if sampling would be far longer, else of `Ensemble`."""
        within, budget = number(self.within), number(self.budget)
        if within is not None and within <= FINER_THAN_SAMPLING and not Density.refusal(problem):
            return Density(within=within, budget=budget).run(problem, progress)
        return Ensemble(**vars(self)).run(problem, progress)


def _answer_or_error(
    engine: Engine, problem: Problem, progress: Progress | None, is_first: bool
) -> Estimate | HarvesterError:
    """The answer of an engine, or why there is none, if another may have one.

    Raises UnboundedResponseError of the ``is_first`` engine: the growth is that of the scene,
    unless its step is too long.
    """
    try:
        return engine.run(problem, progress)
    except UnboundedResponseError as error:
        from harvester.mechanics.ensemble.trajectories import NotFiniteError

        if is_first and not isinstance(error, NotFiniteError):
            raise
        return error
    except (SimulationError, MissingProgramError) as error:
        return error


def is_slow(problem: Problem) -> bool:
    """Whether the circuit is a chip behind a rectifier, or one whose capacitors charge for long.

    Engines of the whole circuit need less time if it charges within `LONG`/w0.
    """
    if Slow.refusal(problem) is not None:
        return False
    seconds = longest_charging(problem.circuit.parts if problem.circuit else ())
    return seconds * problem.scales.frequency > LONG


def longest_charging(parts: Iterable[CircuitPart]) -> float:
    """The time (s) in which R, C, L and diodes charge at most; infinite for other elements.

    (sum of C) (sum of R)
    """
    total = dict.fromkeys("rc", 0.0)
    for part in parts:
        if part.kind not in PASSIVE:
            return math.inf
        if part.kind in total:
            total[part.kind] += part.effective_value or math.inf
    return total["r"] * total["c"]


def stands_alone(problem: Problem) -> bool:
    """Whether runs of ngspice are not paired with a circuit of ideal elements, and so are few.

    Under a steady excitation of one mode engine `Spice` finds periodic responses, and seeks others.
    """
    from harvester.engines.spice.cheap_model import ideal_elements

    load = problem.circuit
    assert load is not None, "a netlist is a circuit"
    if not SEVERAL_MODES.isdisjoint(problem.effects):
        return True
    return problem.equations.is_random and ideal_elements(problem, load) is None


@dataclasses.dataclass(frozen=True)
class Tried:
    """An engine that was tried, and its answer."""

    kind: type[Slow | Compiled | Spice]
    answer: Estimate

    @property
    def stated(self) -> float:
        """The relative error of the answer's power; infinite if a part is not known."""
        power = self.answer.mean_power
        known = power.error95 is not None and power.value
        return power.known_error95 / abs(power.value) if known else math.inf

    @property
    def needed(self) -> float:
        """The seconds to the target, in all; infinite if they are not known.

        More samples of `Compiled` do not measure its difference from ngspice, if that is missing.
        """
        if self.kind is Compiled and self.answer.mean_power.unknown:
            return math.inf
        missed = [said for said in self.answer.diagnostics if said.code == "target_missed"]
        if not missed or missed[-1].numbers["error"] is None or not missed[-1].numbers["more"]:
            return math.inf  # or no sampling makes the error smaller
        return float(missed[-1].numbers["enough"] or math.inf)


def formula(problem: Problem) -> type[Formula]:
    """The formula with the best known error: `Exact` if linear, else `Averaged`, which may refuse."""
    return Averaged if Exact.refusal(problem) else Exact


def _because(
    answer: Estimate,
    why: str,
    within: float,
    error: float | None = None,
    formula: str = "",
    refused: str = "",
    needed: Mapping[str, float] = MappingProxyType({}),
) -> Estimate:
    """The answer with a note ``why`` its engine was chosen; ``error`` is that of the ``formula``.

    The seconds that engines would have ``needed`` have keys such as ``needed_spice``.
    """
    about = {"why": why, "error": error, "within": within, "formula": formula, "refused": refused}
    numbers = about | dict(needed)
    chosen = note("cheapest", engine=answer.engine, **numbers)
    return dataclasses.replace(answer, diagnostics=(chosen, *answer.diagnostics))
