"""Many scenes through one call of a sampling engine: like ones run side by side.

Each scene gets the same treatment as alone: the burn-in, the step, and averages until its
target is reached.  `harvester.mechanics.ensemble.designs` does all of that for a set of scenes.

Long because a set's rounds and its answers are one computation.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from harvester.answers.estimate import Estimate
from harvester.answers.open_balance import open_balance
from harvester.arrays import Floats
from harvester.engines import sampling
from harvester.engines.moment_existence import MomentExistence, existence
from harvester.engines.options import number
from harvester.engines.protocol import AnyScene, estimate, served
from harvester.engines.sampling import Model
from harvester.equations.bounds import check_bounded
from harvester.equations.impact_order import STRONG, accumulation, step_order
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, answer_or_error
from harvester.presentation.diagnostic import Diagnostic, note, warning
from harvester.uncertainty import controls_of_many as many
from harvester.uncertainty.target import Target, added_effort, best_factor
from harvester.uncertainty.value import Value

if TYPE_CHECKING:
    from harvester.mechanics.ensemble.designs import Design, Designs

MOST = 64  # scenes that run side by side
TRAJECTORIES = 8192  # of all of them

AnyEnsemble: TypeAlias = Any  # an `Ensemble`, whose module imports this one
Indices: TypeAlias = NDArray[np.intp]


def seed_of(seed: int, point: int) -> int:
    """The seed of one of many points, whose noise is independent of that of the others."""
    words = np.random.SeedSequence(seed, spawn_key=(point,)).generate_state(1, np.uint64)
    return int(words[0] >> np.uint64(1))


@dataclass(frozen=True)
class SceneOfMany:
    """A scene that may run with others: its model, and the number of trajectories."""

    problem: Problem
    model: Model
    exists: MomentExistence
    count: int
    seed: int

    @property
    def kind(self) -> object:
        """The common properties of scenes that run side by side."""
        from harvester.mechanics.ensemble.compiled_pair import present
        from harvester.mechanics.kernels.coefficients import coefficients

        numbers = coefficients(self.model.eqs), self.model.circuit
        return present(numbers), self.count, step_order(self.model.eqs) < STRONG


def many_at_once(engine: AnyEnsemble, problem: Problem) -> int:
    """How many scenes like this one the engine runs in one call: 1 if it runs each alone."""
    if not _is_one_of_many(engine, problem):
        return 1
    return max(1, min(MOST, TRAJECTORIES // _count(engine, engine.model(problem))))


def _is_one_of_many(engine: AnyEnsemble, problem: Problem) -> bool:
    """Whether the options and the scene are such that scenes run side by side."""
    from harvester.mechanics.ensemble.designs import can_be_one_of_many

    options = engine.budget, engine.dt, engine.duration
    return (
        engine.runs_together
        and options == (None, None, None)
        and engine.refusal(problem) is None
        and can_be_one_of_many(problem.equations)
    )


def _count(engine: AnyEnsemble, model: Model) -> int:
    """The number of trajectories of a scene, in whole blocks."""
    from harvester.mechanics.kernels.coefficients import BATCH

    given = engine.trajectories or sampling.affordable(
        model.eqs.is_steady, model.circuit, number(engine.within)
    )
    return -(-given // BATCH) * BATCH


def run_many(
    engine: AnyEnsemble, scenes: Sequence[AnyScene], seeds: Sequence[int]
) -> list[Estimate | HarvesterError]:
    """`Ensemble.run` for each scene, or the error that it raises; like scenes run side by side."""
    answers: list[Estimate | None] = [None] * len(scenes)
    sets: dict[object, list[tuple[int, SceneOfMany]]] = {}
    for index, (scene, seed) in enumerate(zip(scenes, seeds, strict=True)):
        member = answer_or_error(lambda pair: _member(engine, pair[0], pair[1]), (scene, seed))
        if isinstance(member, SceneOfMany):  # the run alone raises what is wrong with the others
            sets.setdefault(member.kind, []).append((index, member))
    for together in sets.values():
        size = max(1, TRAJECTORIES // together[0][1].count)
        for first in range(0, len(together), size):
            part = together[first : first + size]
            answered = _side_by_side(engine, [member for _, member in part])
            for (index, _), answer in zip(part, answered, strict=True):
                answers[index] = answer
    return [
        answer_or_error(engine.with_seed(seed).run, scene) if answer is None else answer
        for scene, seed, answer in zip(scenes, seeds, answers, strict=True)
    ]


def _member(engine: AnyEnsemble, scene: AnyScene, seed: int) -> SceneOfMany | None:
    """The scene as one of many; None if it is to run alone.

    Raises the errors of `Ensemble.run` that are known before it runs.
    """
    problem = served(type(engine), scene)
    if not _is_one_of_many(engine, problem):
        return None
    model = engine.model(problem)
    check_bounded(model.eqs, driven=bool(model.circuit))
    return SceneOfMany(problem, model, existence(problem), _count(engine, model), seed)


def _side_by_side(engine: AnyEnsemble, scenes: Sequence[SceneOfMany]) -> list[Estimate | None]:
    """The answers of scenes of one kind; None for each that is to run alone."""
    from harvester.mechanics.ensemble.designs import Designs

    _compile(engine, scenes[0])
    begin = time.perf_counter()
    designs = Designs([_design(scene.model, scene.seed) for scene in scenes], scenes[0].count)
    every = np.arange(len(scenes))
    designs.run_burn_in(every)
    designs.begin_pair(every, designs.elapsed.copy())
    sampler = _Sampler(engine, scenes, designs)
    sampler.refine()
    seconds = (time.perf_counter() - begin) * designs.steps / max(designs.steps.sum(), 1.0)
    return [
        None if designs.left[index] else sampler.answer(index, float(seconds[index]))
        for index in range(len(scenes))
    ]


def _design(model: Any, seed: int) -> "Design":
    """The model of a scene that runs, with its circuit of ideal elements if it has one."""
    from harvester.mechanics.ensemble.designs import Design

    return Design(model.eqs, model.circuit, np.random.SeedSequence(seed))


def _compile(engine: AnyEnsemble, scene: SceneOfMany) -> None:
    """Load the kernel of scenes of a kind."""
    from harvester.mechanics.ensemble.compiled_pair import compile_pair, is_compiled
    from harvester.mechanics.ensemble.trajectories import Trajectories
    from harvester.mechanics.kernels.compiled import compilation

    model = scene.model
    seed = np.random.SeedSequence(scene.seed)
    block = Trajectories(model.eqs, 1, seed, circuit=model.circuit, controlled=engine.CONTROLS)
    if not is_compiled(block):
        with compilation():
            compile_pair(block)


class _Sampler:
    """Averages of scenes side by side, each at its best step until its target is reached."""

    def __init__(
        self, engine: AnyEnsemble, scenes: Sequence[SceneOfMany], designs: "Designs"
    ) -> None:
        self.engine = engine
        self.scenes = scenes
        self.designs = designs
        self.names = list(dict.fromkeys(["V2", scenes[0].model.name]))
        self.power = self.names.index(scenes[0].model.name)
        self.has_balance = not scenes[0].model.circuit
        shape = len(scenes), len(self.names) + self.has_balance
        self.mean = np.zeros(shape)
        self.error = np.zeros(shape)
        self.bias = np.zeros(shape)
        self.bias_error = np.zeros(shape)
        self.entries = np.zeros((len(scenes), designs.count, shape[1]))
        self.balance = np.zeros((len(scenes), 2))  # as it is, and its standard error
        self.look(np.arange(len(scenes)))

    def look(self, which: Indices) -> None:
        """Compute the means of scenes and their errors from the present entries."""
        which = which[~self.designs.left[which]]
        stopped = self.designs.coarse_stopped[which]
        if not stopped.all():
            self._look_at(which[~stopped], range(self.designs.levels))
        if stopped.any():
            self._look_at(which[stopped], range(1))

    def _look_at(self, which: Indices, levels: range) -> None:
        """Compute means, and with several levels the bias of the step."""
        values = np.array([self._values(which, level) for level in levels])
        controls = self.designs.controls(which, levels)
        entries = many.controlled_entries_of_many(values[0], controls[0])
        self.entries[which] = entries
        self.mean[which], self.error[which] = many.means_and_errors(entries)
        if self.has_balance:
            plain = many.means_and_errors(values[0][..., -1:])
            self.balance[which] = np.hstack(plain)
        if len(levels) > 1:
            order = self.designs.order[which]
            self.bias[which], self.bias_error[which] = many.step_biases(values, controls, order)

    def _values(self, which: Indices, level: int) -> Floats:
        """Moments of scenes, and their power balance, shape (scenes, count, quantities)."""
        moments = self.designs.moments(which, level)
        columns = [getattr(moments, name) for name in self.names]
        if self.has_balance:
            balances = [
                moments.row(row).balance(self.scenes[index].model.eqs)
                for row, index in enumerate(which)
            ]
            columns.append(np.array(balances))
        return np.stack(columns, axis=-1)

    def value(self, index: int, quantity: int) -> Value:
        """A scene's mean with its sampling and time-step errors (`sampling.mean_with_errors`)."""
        bias = abs(float(self.bias[index, quantity]))
        if self.designs.order[index] < STRONG:
            bias += Value(0.0, float(self.bias_error[index, quantity])).sampling95
        return Value(float(self.mean[index, quantity]), float(self.error[index, quantity]), bias)

    def relative_bias(self, index: int) -> tuple[float, float]:
        """The bias of a scene's power as a part of it, and the standard error of that."""
        size = abs(float(self.mean[index, self.power])) or 1.0
        bias = float(self.bias[index, self.power])
        return bias / size, float(self.bias_error[index, self.power]) / size

    def refine(self) -> None:
        """Go on until each scene's target is reached."""
        within = number(self.engine.within)
        if within is None:
            return
        target = Target(within)
        going = [
            index
            for index, scene in enumerate(self.scenes)
            if scene.exists.obstacle(within) is None
        ]
        while True:
            going = [
                index
                for index in going
                if not self.designs.left[index]
                and not target.reached(self.value(index, self.power))
            ]
            if not going:
                return
            self._improve(np.array(going, dtype=np.intp), target)
            self.look(np.array(going, dtype=np.intp))

    def _improve(self, going: Indices, target: Target) -> None:
        """One more round for scenes: another step, or more time at this one."""
        designs = self.designs
        factors = np.ones(len(going))
        more = np.zeros(len(going))
        for row, index in enumerate(going):
            bias, bias_error = self.relative_bias(index)
            order = float(designs.order[index])
            factors[row] = best_factor(target.within, abs(bias), bias_error, order)
            if factors[row] != 1.0:
                continue
            if bias_error < sampling.KNOWN * target.within:
                designs.stop_coarse(index)
            value = self.value(index, self.power)
            variance = target.variance(value)
            duration = float(designs.duration[index])
            spread = duration * (value.stderr or 0.0) ** 2
            more[row] = added_effort(duration, spread / variance if variance > 0.0 else np.inf)
        same = factors == 1.0
        if not same.all():
            designs.begin_again(going[~same], factors[~same])
        if same.any():
            designs.extend(going[same], more[same])

    def answer(self, index: int, seconds: float) -> Estimate:
        """The answer of a scene."""
        engine = self.engine
        scene = self.scenes[index]
        model = scene.model
        details = self._details(index)
        diagnostics = [scene.exists.warning, accumulation(model.eqs), *self._of_target(index)]
        diagnostics.append(engine.remark(engine.MODEL_NOTE))
        if self.has_balance:
            diagnostics += [warning("open_circuit")] if model.eqs.load is None else []
            balance = [details[name] for name in BALANCE]
            dof = self.designs.count - 1.0
            diagnostics.append(open_balance(Value(balance[0], balance[1], balance[2], dof=dof)))
        v2, power = (
            sampling.with_model(self.value(index, quantity), None, engine.UNKNOWN)
            .with_unknown(scene.exists.unknown)
            .scaled(factor)
            for quantity, factor in ((0, 1.0), (self.power, model.factor))
        )
        answer = estimate(
            engine=engine.NAME,
            problem=scene.problem,
            v2=v2,
            power=power,
            diagnostics=diagnostics,
            seconds=seconds,
            steps=int(self.designs.steps[index]),
            details=details,
            samples=self.entries[index, :, 0],
            power_samples=self.entries[index, :, self.power] * model.factor,
        )
        remarked: Estimate = engine.remarked(answer, scene.problem)
        return remarked

    def _details(self, index: int) -> dict[str, float]:
        """The numbers of the run, and of a scene without a circuit its power balance."""
        unit = self.scenes[index].problem.units.frequency
        times = {"step": "h", "burn_in": "burn_in", "duration": "duration"}
        details = {
            name: float(getattr(self.designs, array)[index]) / unit for name, array in times.items()
        }
        details["trajectories"] = self.designs.count
        if self.has_balance:
            balance = *self.balance[index], abs(self.bias[index, -1])
            details |= dict(zip(BALANCE, map(float, balance), strict=True))
        return details

    def _of_target(self, index: int) -> list[Diagnostic | None]:
        """The choices for a target, or the reason that it is not promised."""
        within = number(self.engine.within)
        if within is None:
            return []
        scene = self.scenes[index]
        if (obstacle := scene.exists.obstacle(within)) is not None:
            return [obstacle]
        bias, bias_error = self.relative_bias(index)
        details = self._details(index)
        numbers = {name: details[name] for name in ("step", "duration", "trajectories")}
        return [
            note(
                "effort",
                within=within,
                bias=bias,
                bias_error=bias_error,
                physical=scene.problem.physical,
                **numbers,
            )
        ]


BALANCE = ("power_balance", "power_balance_stderr", "power_balance_bias")
