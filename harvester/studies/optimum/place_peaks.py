"""The limited peaks at any place of a search whose scene is not linear: surfaces through counted trajectories.

Places of the ranges and devices about them are drawn together, evenly, with the ends of each; a
path of each is counted (`harvester.studies.tolerance.peaks`), and polynomials of the keys, by ratio
if a range is searched by ratio, represent all others.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harvester.arrays import Floats
from harvester.errors import SimulationError
from harvester.machine.progress import NO_PROGRESS, Progress
from harvester.scene.keys import full_key, split_key
from harvester.scene.scene import Scene
from harvester.studies.optimum.ranges import Range
from harvester.studies.tolerance import design
from harvester.studies.tolerance.peaks import COUNTED, PeakSurfaces, peak_surfaces
from harvester.studies.tolerance.spreads import spread

SHARE = 0.6  # of the budget, for the trajectories at most


@dataclass(frozen=True)
class PlacePeaks:
    """Peaks over a lifetime as surfaces of ``keys``, the values of those in ``by_ratio`` as logarithms."""

    keys: tuple[str, ...]
    by_ratio: frozenset[str]
    surfaces: PeakSurfaces

    def unsafe_levels(
        self, scene: Scene, varied: Mapping[str, Floats] | None = None
    ) -> dict[str, Floats]:
        """The level of each quantity, shape (n,), at a place whose devices have the ``varied`` values, each (n,).

        It is at the unsafe end of its error.  None: the device unchanged, n = 1.
        """
        values = {key: np.atleast_1d(_value(scene, key)) for key in self.keys} | dict(varied or {})
        count = max(len(column) for column in values.values())
        columns = [
            np.broadcast_to(_axis(values[key], key, self.by_ratio), count) for key in self.keys
        ]
        levels, off = self.surfaces(np.stack(columns, axis=1))
        return {name: level * (1.0 + off[name]) for name, level in levels.items()}


def place_peaks(
    scene: Scene,
    ranges: Sequence[Range],
    vary: Sequence[tuple[str, str]],
    lifetime: float,
    budget: float,
    seed: int,
    progress: Progress = NO_PROGRESS,
) -> PlacePeaks:
    """Count at places of the ranges and devices about them.

    ``progress`` shows the share of trajectories done.

    Raises HarvesterError if a place has no peaks, and SimulationError if `SHARE` of the budget
    is too short.
    """
    begin = time.perf_counter()
    count = len(ranges) + len(vary)
    inner = design.sobol_points(COUNTED * (count + 1), count, 0)
    u = np.vstack([inner, design.outer(count)])
    keys = tuple(dict.fromkeys([*(r.key for r in ranges), *(full_key(key) for key, _ in vary)]))
    by_ratio = frozenset(r.key for r in ranges if r.logarithmic)
    scenes = [_device(scene, ranges, vary, row) for row in u]
    x = np.array(
        [
            [float(_axis(np.array(_value(device, key)), key, by_ratio)) for key in keys]
            for device in scenes
        ]
    )

    def done(number: int) -> None:
        taken = time.perf_counter() - begin
        if number > 1 and taken > SHARE * budget:
            raise SimulationError(
                f"the budget of {budget:g} s ended after {number} of the {len(scenes)} paths whose peaks are counted: "
                f"allow a `budget` of {1.2 * taken / number * len(scenes) / SHARE:.0f} s"
            )
        progress.step(number / len(scenes))

    return PlacePeaks(keys, by_ratio, peak_surfaces(scenes, x, len(inner), lifetime, seed, done))


def _device(
    scene: Scene, ranges: Sequence[Range], vary: Sequence[tuple[str, str]], u: Floats
) -> Scene:
    """The device at a place u of the unit cube: the values of the ranges, and the spreads about them."""
    nominal = scene.varied(
        {r.key: r.value(float(np.clip(a, 0.0, 1.0))) for r, a in zip(ranges, u, strict=False)}
    )
    parts = [spread(key, written, nominal) for key, written in vary]
    values = {part.key: float(part.at(a)) for part, a in zip(parts, u[len(ranges) :], strict=True)}
    return nominal.varied(values) if values else nominal


def _value(scene: Scene, key: str) -> float:
    """The value of a key that the scene has, in SI units."""
    table, name = split_key(key)
    return float(scene.tables()[table][name])


def _axis(values: Floats, key: str, by_ratio: frozenset[str]) -> Floats:
    return np.log(values) if key in by_ratio else values
