"""An engine around an engine of formulas: its power is that of the worst few per cent of devices, under limits.

Each place of a search represents many devices, whose parts scatter about the values there.  The
engine computes a few of them, the same places of the spreads everywhere, and a polynomial through
these gives the quantile of many.  A place that breaks limits has its power multiplied by
exp(-`PENALTY` v), v being how far it breaks them, relatively: the search comes to the edge of the
region that is allowed, and stays there if the power grows beyond.
"""

import contextlib
import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from harvester.answers.estimate import Estimate
from harvester.arrays import Floats
from harvester.engines.protocol import AnyScene, Engine
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError, SimulationError
from harvester.scene.scene import Scene
from harvester.studies.extremes.levels import linear_peaks
from harvester.studies.optimum.place_peaks import PlacePeaks
from harvester.studies.tolerance import design
from harvester.studies.tolerance.device_limits import Limit
from harvester.studies.tolerance.spreads import spread
from harvester.studies.tolerance.surface import fit
from harvester.uncertainty.value import Value, mean_and_error

DEVICES = 2048  # that a quantile is taken of
PENALTY = 100.0  # relative loss of power for a relative break of a limit
BINDS = 0.005  # how near to its bound, relatively, a limit is felt
CLOSE = 0.01  # relative error of the polynomial from which on devices are computed one by one
SAMPLES = 8  # of them, that are independent
FEWEST, MOST = 8, 1024  # devices of a sample, at first and at most
FIRST_SEED = 2  # of their places
TINIEST = 1e-300  # of a power that is divided by


@dataclass(frozen=True)
class DesignOutcome:
    """The answer of a design: the ``objective`` (power, before any penalty), limited quantities, their ``violation``.

    ``off`` is the relative error of the engine and of the polynomial there, None if it is not
    known; ``quantities`` are those of each limit, in its order.  ``unresolved`` is the part of
    ``off`` by which few devices differ from all of the spread, and ``devices`` how many were
    computed.
    """

    objective: float
    off: float | None
    quantities: tuple[float, ...]
    violation: float
    unresolved: float = 0.0
    devices: int = 1

    def with_unresolved(self, error: float, devices: int) -> "DesignOutcome":
        """The outcome whose devices differ from those of the whole spread by a relative ``error``."""
        off = None if self.off is None else self.off + error
        return dataclasses.replace(self, off=off, unresolved=error, devices=devices)

    @property
    def power(self) -> Value:
        """The objective with its error."""
        return Value(
            self.objective, model=None if self.off is None else self.off * abs(self.objective)
        )


@dataclass(frozen=True)
class Robust(Engine):
    """``engine`` for many devices: the mean of the power (``share`` None), or that exceeded by all but a ``share``.

    ``vary`` are pairs of a key and its spread, about the values of each place; none: the device
    unchanged.  For a limit the value counts that all but the ``share`` of devices keep; peaks are
    those over the ``lifetime``, by Rice's formula or, of a scene that is not linear, by the
    surfaces ``counted``.
    """

    engine: Engine
    vary: tuple[tuple[str, str], ...] = ()
    share: float | None = None
    limits: tuple[Limit, ...] = ()
    lifetime: float | None = None
    counted: PlacePeaks | None = None

    NAME = "robust"
    is_formula = True

    @property
    def path_seed(self) -> int:
        """The seed of trajectories whose peaks are counted."""
        return int(getattr(self.engine, "seed", 0))

    def run_many(
        self, scenes: Sequence[AnyScene], seeds: Sequence[int] | None = None
    ) -> list[Estimate | HarvesterError]:
        """For each scene the estimate of the device unchanged, with the power of its `DesignOutcome`."""
        if not self.vary:
            self._run_devices([Problem.of(scene).scene for scene in scenes])
        return [self._estimate(scene) for scene in scenes]

    def _run_devices(self, scenes: Sequence[Scene]) -> None:
        """Compute devices unchanged at once, which a formula does for little more than one.

        Errors come later.
        """
        new = {key: scene for scene in scenes if (key := scene.to_toml()) not in self._known}
        for (key, scene), answer in zip(
            new.items(), self.engine.run_many([*new.values()]), strict=True
        ):
            if isinstance(answer, Estimate):
                with contextlib.suppress(HarvesterError):  # of the peaks: `outcome` raises it again
                    self._known[key] = answer, self._single_device(scene, answer)

    def _single_device(self, scene: Scene, answer: Estimate) -> DesignOutcome:
        """The outcome of a device unchanged."""
        power, square = (
            np.array([mean.value]) for mean in (answer.mean_power, answer.mean_square_voltage)
        )
        peaks = {name: np.array([v]) for name, v in self._peaks(scene).items()}
        return self._summed(power, square, peaks, _off(answer.mean_power))

    def outcome(self, scene: AnyScene) -> tuple[Estimate, DesignOutcome]:
        """The estimate of the scene unchanged, and the answers of its devices.

        Raises HarvesterError if the engine has no answer for it, or for one of its devices.
        """
        nominal = Problem.of(scene).scene
        key = nominal.to_toml()
        if key not in self._known:  # the values of a series come again and again
            self._known[key] = self._computed(nominal)
        return self._known[key]

    @cached_property
    def _known(self) -> dict[str, tuple[Estimate, DesignOutcome]]:
        """The outcomes of designs, by their scenes."""
        return {}

    def _computed(self, nominal: Scene) -> tuple[Estimate, DesignOutcome]:
        """The `outcome`, computed."""
        devices, x, many = self._devices(nominal)
        first, *answers = self.engine.run_many([nominal, *devices])
        if isinstance(first, HarvesterError):
            raise first
        if not devices:
            return first, self._single_device(nominal, first)
        served = _served(answers)
        scored = len(x) - 2 * len(self.vary)  # the others hold the outer ends
        powers = fit(x, np.array([answer.mean_power.value for answer in served]), scored)
        squares = fit(x, np.array([answer.mean_square_voltage.value for answer in served]), scored)
        peaks = self._peaks_of_many(nominal, devices, x, many)
        outcome = self._summed(
            powers(many), np.maximum(squares(many), 0.0), peaks, _off(first.mean_power)
        )
        scatter = 2.0 * powers.scatter / max(abs(outcome.objective), TINIEST)
        return first, outcome.with_unresolved(scatter, len(devices))

    def resolved(self, nominal: Scene, seconds: float) -> DesignOutcome:
        """The outcome by devices that are computed one by one, until they are enough or the ``seconds`` are over.

        They are `SAMPLES` independent samples of the spread, whose objectives scatter as much as
        that of all of them is off, times the square root of their number.

        Raises SimulationError if one of them has no answer.
        """
        begin = time.perf_counter()
        spreads = [spread(key, written, nominal) for key, written in self.vary]
        keys = [part.key for part in spreads]
        scenes: list[list[Scene]] = [[] for _ in range(SAMPLES)]
        answers: list[list[Estimate]] = [[] for _ in range(SAMPLES)]
        count = FEWEST
        first = self.outcome(nominal)[0]
        while True:
            for seed, (some, known) in enumerate(zip(scenes, answers, strict=True)):
                x = design.values_at(
                    spreads, design.sobol_points(count, len(keys), FIRST_SEED + seed)
                )
                new = [
                    nominal.varied(dict(zip(keys, map(float, row), strict=True)))
                    for row in x[len(some) :]
                ]
                some.extend(new)
                known.extend(_served(self.engine.run_many([*new])))
            outcome = self._of_samples(scenes, answers, _off(first.mean_power))
            took = time.perf_counter() - begin
            if outcome.unresolved <= CLOSE or 2.0 * took > seconds or count >= MOST:
                return outcome
            count *= 2

    def _of_samples(
        self, scenes: list[list[Scene]], answers: list[list[Estimate]], off: float | None
    ) -> DesignOutcome:
        """The outcome of all samples together, and by how much it is off by their scatter."""
        powers, squares = (
            np.array([[getattr(answer, name).value for answer in some] for some in answers])
            for name in ("mean_power", "mean_square_voltage")
        )
        peaks = [self._peaks(scene) for some in scenes for scene in some] if self.lifetime else []
        levels = {name: np.array([level[name] for level in peaks]) for name in (peaks or [{}])[0]}
        outcome = self._summed(powers.ravel(), squares.ravel(), levels, off)
        each = np.array([self._kept(sample, 1) for sample in powers])
        mean = Value(*mean_and_error(each), dof=len(each) - 1.0)
        scatter = mean.sampling95 + abs(mean.value - outcome.objective)
        relative = scatter / max(abs(outcome.objective), TINIEST)
        return outcome.with_unresolved(relative, powers.size)

    def _peaks_of_many(
        self, nominal: Scene, devices: Sequence[AnyScene], x: Floats, many: Floats
    ) -> dict[str, Floats]:
        """The peaks at the keys' values ``many``, by those of ``devices``, at ``x``, or by the counted ones."""
        if self.counted is not None:
            return self.counted.unsafe_levels(
                nominal, {key: many[:, k] for k, (key, _) in enumerate(self.vary)}
            )
        peaks = [self._peaks(device) for device in devices]
        scored = len(x) - 2 * len(self.vary)
        return {
            name: fit(x, np.array([levels[name] for levels in peaks]), scored)(many)
            for name in peaks[0]
        }

    def _peaks(self, scene: AnyScene) -> dict[str, float]:
        """The peaks over the lifetime, at the unsafe end of their error.

        None if no limit asks for them.
        """
        if self.lifetime is None:
            return {}
        if self.counted is not None:
            return {
                name: float(v[0])
                for name, v in self.counted.unsafe_levels(Problem.of(scene).scene).items()
            }
        peaks = linear_peaks(Problem.of(scene), self.lifetime)
        return {name: level.value + level.known_error95 for name, level in peaks.items()}

    def _estimate(self, scene: AnyScene) -> Estimate | HarvesterError:
        try:
            first, outcome = self.outcome(scene)
        except HarvesterError as error:
            return error
        power = outcome.objective * math.exp(-PENALTY * outcome.violation)
        model = None if outcome.off is None else outcome.off * abs(power)
        return dataclasses.replace(first, mean_power=Value(power, model=model), power_samples=None)

    def _summed(
        self, power: Floats, square: Floats, peaks: dict[str, Floats], off: float | None
    ) -> DesignOutcome:
        """The outcome of devices that have these powers, mean square voltages and peaks, each of shape (n,)."""
        values = {
            "mean_power": power,
            "mean_square_voltage": square,
            "voltage_rms": np.sqrt(square),
        }
        values |= peaks
        objective = self._kept(power, 1)
        kept = tuple(self._kept(values[limit.quantity], limit.sign) for limit in self.limits)
        violations = (
            max(-limit.margin(value), 0.0) for limit, value in zip(self.limits, kept, strict=True)
        )
        return DesignOutcome(objective, off, kept, sum(violations))

    def _kept(self, values: Floats, sign: int) -> float:
        """The value that all but a fraction of devices exceed (``sign`` 1) or stay below (-1).

        The mean without one.
        """
        if self.share is None:
            return float(values.mean())
        return float(np.quantile(values, self.share if sign > 0 else 1.0 - self.share))

    @cached_property
    def _cube_points(self) -> tuple[Floats, Floats]:
        """The places of the devices that are computed, and of those that the polynomial represents."""
        keys = len(self.vary)
        inner = design.sobol_points(2 * (keys + 1) * (keys + 2) + 1, keys, 0)
        return np.vstack([inner, design.outer(keys)]), design.sobol_points(DEVICES, keys, 1)

    def _devices(self, scene: Scene) -> tuple[list[AnyScene], Floats, Floats]:
        """The devices that are computed, and the keys' values of these and of the many."""
        if not self.vary:
            return [], np.empty((0, 0)), np.empty((0, 0))
        spreads = [spread(key, written, scene) for key, written in self.vary]
        x, many = (design.values_at(spreads, u) for u in self._cube_points)
        keys = [s.key for s in spreads]
        devices: list[Any] = [
            scene.varied(dict(zip(keys, map(float, row), strict=True))) for row in x
        ]
        return devices, x, many


def _served(answers: Sequence[Estimate | HarvesterError]) -> list[Estimate]:
    """The answers of devices; raises SimulationError if one of them has none."""
    served = [answer for answer in answers if isinstance(answer, Estimate)]
    if len(served) < len(answers):
        failed = next(answer for answer in answers if isinstance(answer, HarvesterError))
        raise SimulationError(
            f"{len(answers) - len(served)} of {len(answers)} devices have no answer: {failed}"
        )
    return served


def _off(power: Value) -> float | None:
    """A power's relative error; None if it is not known."""
    error = power.error95
    return None if error is None or power.value == 0.0 else error / abs(power.value)
